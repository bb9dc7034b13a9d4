// Types of the package.

/** A number of texels or workgroups along one side: fixed, or `times * ceil((ceil(of / divide) + plus) / per)`. */
export type Side =
  { fixed: number } | { of: "width" | "height"; divide: number; plus: number; per: number; times: number };

/** `max(times_squares * (ceil(width / divide)^2 + ceil(height / divide)^2), least)`. */
export interface Squares {
  divide: number;
  times_squares: number;
  least: number;
}

/** How a number follows a setting: `times * v^power`, or the number of frames after which this share remains. */
export type BySetting = { setting: string; at_zero?: number | Squares } & (
  { power: { times: number; power: 1 | 2 } } | { frames_until: number }
);

export type FieldType = "f32" | "i32" | "u32" | "vec2f" | "vec3f" | "vec4f" | "vec2u" | "vec3u" | "vec4u" | "mat4x4f";

/** A field whose value every frame has. */
export interface FrameField {
  name: string;
  offset: number;
  type: FieldType;
  from:
    | "camera.world_to_view"
    | "camera.view_to_world"
    | "camera.tan_half_fov"
    | "camera.near"
    | "display.size"
    | "frame.number"
    | "frame.seed"
    | "frame.unchanged"
    | "previous.view_to_previous"
    | "previous.tan_half_fov"
    | "previous.valid"
    | "dispatch.workgroup"
    | "dispatch.invocation";
}

/** A field whose value the plan gives. */
export interface PlanField {
  name: string;
  offset: number;
  type: FieldType;
  value: number | number[];
  by_size?: Squares;
  by_setting?: BySetting;
}

/** A uniform block. */
export interface Block {
  name: string;
  size: number;
  fields: (FrameField | PlanField)[];
}

/** A resource variable of a shader. */
export type Binding = { name: string; group: number; index: number } & (
  | { kind: "texture"; texture: string; dimension: "2d" | "2d-array" }
  | { kind: "storage_texture"; texture: string; access: "write-only" }
  | { kind: "uniform"; block: string }
  | { kind: "sampler"; filter: "linear" | "nearest" }
);

/** A compute pass. */
export interface Pass {
  name: string;
  reason: string;
  shader: string;
  entry: string;
  constants: Record<string, number>;
  workgroup_size: [number, number, number];
  workgroups: [Side, Side];
  work: number;
  bindings: Binding[];
}

/** What plan.json holds. docs/export.md describes it, plan.schema.json checks it. */
export interface Plan {
  version: 1;
  program: string;
  command: string;
  technique: string;
  summary: string;
  display: { exported: [number, number]; valid: "any" | "exported"; reason?: string };
  notes: string[];
  settings: {
    name: string;
    value: number | string | boolean;
    doc: string;
    unit: string;
    change: "live" | "export" | "none";
    range?: { at_least: number; at_most: number; above: boolean; whole: boolean };
  }[];
  inputs: { name: string; doc: string; formats: string[] }[];
  outputs: { name: string; texture: string; doc: string }[];
  textures: {
    name: string;
    format: GPUTextureFormat;
    size: [Side, Side];
    layers: number;
    mips: 1;
    usage: ("texture-binding" | "storage-binding" | "copy-src")[];
    reason: string;
  }[];
  histories: { now: string; before: string }[];
  uniforms: Block[];
  passes: Pass[];
}

/** A plan with the texts of its shaders. */
export interface LoadedPlan {
  plan: Plan;
  /** Text of each shader file, by its name. */
  shaders: Record<string, string>;
}

/** The camera of a frame: a perspective, right-handed, +y up, that looks along -z. */
export interface Camera {
  /** World to view space: 16 numbers, column by column (three.js: `camera.matrixWorldInverse.elements`). */
  worldToView: ArrayLike<number>;
  /** Projection matrix: 16 numbers, column by column. Only its field of view is read. */
  projection?: ArrayLike<number>;
  /** Tangents of half the field of view, horizontal and vertical, instead of a projection. */
  tanHalfFov?: ArrayLike<number>;
  /** Distance of the near plane, scene units. A camera that moves 50,000 times as far in one frame has been moved elsewhere. */
  near: number;
  /** Whether this frame shows something else than the one before: its histories are not used. */
  cut?: boolean;
}

/** Inputs of a frame. The plan says which textures it needs, and what their texels are. All have the same size. */
export interface Frame {
  /** Planar view depth in scene units, 0 where there is no surface. */
  depth?: GPUTexture;
  /** Unit normal in view space. */
  normal?: GPUTexture;
  /** Linear radiance after direct light. */
  direct?: GPUTexture;
  /** Linear diffuse reflectance. */
  albedo?: GPUTexture;
  camera: Camera;
  /** Whether scene and light are as in the frame before. If the camera is, too, a temporal filter averages without limit. */
  unchanged?: boolean;
  /**
   * Number of the frame: it seeds the random numbers. Frames are counted by default. After another number than the next one,
   * no history is used.
   */
  number?: number;
}

/** Options of a player. */
export interface Options {
  /** Values of live settings. */
  settings?: Record<string, number>;
  /** Seed of random numbers: a whole number from 0. */
  seed?: number;
  /** Prefix of the labels of all objects. */
  label?: string;
  /** Whether passes are timed, if the device has the feature `timestamp-query`; true by default. */
  timestamps?: boolean;
  /** Work of one dispatch, in fetches of a texel. Longer dispatches are divided. 2^29 by default. */
  workAtOnce?: number;
}

/** Plays a plan. */
export interface Halflight {
  readonly plan: Plan;
  /** Width and height of the display, pixels; zeros before the first frame. */
  readonly size: number[];
  /** Results of the last frame by name. They are other textures after a resize, and some after every frame. */
  readonly outputs: Record<string, GPUTexture>;
  /** Irradiance divided by pi, without albedo: final = direct + albedo * indirect. */
  readonly indirect: GPUTexture | undefined;
  /** Values of all settings. */
  readonly settings: Record<string, number | string | boolean>;
  /** Changes live settings. The next frame uses them. */
  set(settings: Record<string, number>): void;
  /** Makes the textures for this size. `encode` does it where the size of the inputs has changed. */
  resize(width: number, height: number): void;
  /** Forgets the frames before. */
  reset(): void;
  /** Records the passes of a frame. Submit it before you encode the next one. */
  encode(encoder: GPUCommandEncoder, frame: Frame): void;
  /** Times of the passes of the last submitted frame, milliseconds; null if there are none. */
  times(): Promise<{ name: string; milliseconds: number }[] | null>;
  /** Frees everything. */
  destroy(): void;
}

/** A plan that the player does not understand, or a wrong use of it: one sentence. */
export class PlanError extends Error {}

/** Creates a player. Rejects with a `PlanError` that names the field of a plan that it does not understand. */
export function createHalflight(
  device: GPUDevice,
  plan: unknown,
  shaders: Record<string, string>,
  options?: Options,
): Promise<Halflight>;

/** Fetches plan.json and its shaders from a folder. */
export function loadPlan(folder: string | URL): Promise<LoadedPlan>;

/** Checks a plan and returns it. */
export function checkPlan(plan: unknown): Plan;
