// Constants of WebGPU that TypeScript's own library does not have yet.

declare const GPUBufferUsage: Record<
  "MAP_READ" | "MAP_WRITE" | "COPY_SRC" | "COPY_DST" | "UNIFORM" | "STORAGE" | "QUERY_RESOLVE",
  number
>;
declare const GPUTextureUsage: Record<
  "COPY_SRC" | "COPY_DST" | "TEXTURE_BINDING" | "STORAGE_BINDING" | "RENDER_ATTACHMENT",
  number
>;
declare const GPUMapMode: Record<"READ" | "WRITE", number>;
