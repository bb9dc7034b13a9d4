// The smallest program with a G-buffer: a room with a sphere and a lamp, ray-cast by a fragment shader. It stands for an
// engine; nothing here is Halflight's.

const GBUFFER = /* wgsl */ `
struct Frame { eye: vec3f, tan_half_fov: vec2f, size: vec2f }
struct Targets {
    // Planar view depth: the camera looks along -z, and rays have z = -1.
    @location(0) depth: vec4f,
    // In view space, which has the axes of the world here.
    @location(1) normal: vec4f,
    @location(2) direct: vec4f,
    @location(3) albedo: vec4f,
}
@group(0) @binding(0) var<uniform> frame: Frame;

const ROOM = vec3f(1.6, 1.0, 2.0);
const SPHERE = vec4f(0.5, -0.5, -0.8, 0.5);
const LAMP = vec3f(-0.2, 0.8, -0.6);
const INTENSITY = vec3f(6.0, 5.6, 5.0);

/// Distance to the sphere in lengths of the ray; negative if it misses.
fn sphere(origin: vec3f, ray: vec3f) -> f32 {
    let offset = origin - SPHERE.xyz;
    let a = dot(ray, ray);
    let b = dot(offset, ray);
    let d = b * b - a * (dot(offset, offset) - SPHERE.w * SPHERE.w);
    return select((-b - sqrt(max(d, 0.0))) / a, -1.0, d < 0.0);
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(vec2u(index & 1u, index >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn fragment(@builtin(position) pixel: vec4f) -> Targets {
    let ray = vec3f((pixel.xy / frame.size * 2.0 - 1.0) * vec2f(1.0, -1.0) * frame.tan_half_fov, -1.0);
    // The walls of the room, from inside.
    let walls = (sign(ray) * ROOM - frame.eye) / ray;
    var depth = min(walls.x, min(walls.y, walls.z));
    var normal = -sign(ray) * vec3f(walls == vec3f(depth));
    var albedo = vec3f(0.8);
    if normal.x != 0.0 {
        albedo = select(vec3f(0.15, 0.5, 0.2), vec3f(0.7, 0.15, 0.1), normal.x > 0.0);
    }
    let nearer = sphere(frame.eye, ray);
    if nearer > 0.0 && nearer < depth {
        depth = nearer;
        normal = (frame.eye + depth * ray - SPHERE.xyz) / SPHERE.w;
        albedo = vec3f(0.75);
    }
    let point = frame.eye + depth * ray;
    let way = LAMP - point;
    let shadow = sphere(point + 1e-3 * normal, way);
    let visible = select(1.0, 0.0, shadow > 0.0 && shadow < 1.0);
    let cosine = max(dot(normal, way), 0.0) * inverseSqrt(dot(way, way));
    // The lamp shines downwards.
    let downwards = max(way.y, 0.0) * inverseSqrt(dot(way, way));
    let direct = albedo / 3.14159265 * INTENSITY * visible * downwards * cosine / dot(way, way);
    return Targets(vec4f(depth), vec4f(normal, 0.0), vec4f(direct, 1.0), vec4f(albedo, 1.0));
}`;

const COMPOSE = /* wgsl */ `
@group(0) @binding(0) var direct: texture_2d<f32>;
@group(0) @binding(1) var albedo: texture_2d<f32>;
@group(0) @binding(2) var indirect: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(vec2u(index & 1u, index >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn fragment(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let at = vec2u(pixel.xy);
    let own = textureLoad(direct, at, 0).rgb;
    let light = own + textureLoad(albedo, at, 0).rgb * textureLoad(indirect, at, 0).rgb;
    return vec4f(pow(light / (1.0 + light), vec3f(1.0 / 2.2)), 1.0);
}`;

const FORMATS = { depth: "r32float", normal: "rgba16float", direct: "rgba16float", albedo: "rgba8unorm" };
const NEAR = 0.1;
const TAN_HALF_FOV = 0.6;

/** Opens a device that draws to a canvas. */
export async function openHost(canvas) {
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter) throw new Error("This browser has no WebGPU.");
  const device = await adapter.requestDevice();
  const context = canvas.getContext("webgpu");
  const format = navigator.gpu.getPreferredCanvasFormat();
  context.configure({ device, format });

  const pipeline = (label, code, targets) => {
    const module = device.createShaderModule({ label, code });
    return device.createRenderPipeline({ label, layout: "auto", vertex: { module }, fragment: { module, targets } });
  };
  const draw = (encoder, label, views, pipe, entries) => {
    const attachment = (view) => ({ view, loadOp: "clear", storeOp: "store" });
    const pass = encoder.beginRenderPass({ label, colorAttachments: views.map(attachment) });
    const resources = entries.map((resource, binding) => ({ binding, resource }));
    pass.setPipeline(pipe);
    pass.setBindGroup(0, device.createBindGroup({ layout: pipe.getBindGroupLayout(0), entries: resources }));
    pass.draw(3);
    pass.end();
  };
  const gbufferPipeline = pipeline(
    "gbuffer",
    GBUFFER,
    Object.values(FORMATS).map((format) => ({ format })),
  );
  const composePipeline = pipeline("compose", COMPOSE, [{ format }]);
  const uniforms = device.createBuffer({ size: 32, usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST });

  const isStill = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const host = { device, black: null, targets: null };
  const texture = (label, format, size) =>
    device.createTexture({
      label,
      format,
      size,
      usage: GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.TEXTURE_BINDING,
    });

  /** Textures of the canvas's size. */
  const resize = (size) => {
    for (const old of [host.black, ...Object.values(host.targets ?? {})]) old?.destroy();
    [canvas.width, canvas.height] = size;
    const targets = Object.entries(FORMATS).map(([name, format]) => [name, texture(name, format, size)]);
    host.targets = Object.fromEntries(targets);
    host.black = texture("black", "rgba8unorm", size);
  };

  host.drawGBuffer = (encoder, time) => {
    const size = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.max(1, Math.round(side)));
    if (!host.targets || size[0] !== canvas.width || size[1] !== canvas.height) resize(size);
    const eye = [isStill ? 0 : 0.3 * Math.sin(time / 2000), 0, 1.9];
    const tanHalfFov = [(TAN_HALF_FOV * size[0]) / size[1], TAN_HALF_FOV];
    device.queue.writeBuffer(uniforms, 0, new Float32Array([...eye, 0, ...tanHalfFov, ...size]));
    const views = Object.values(host.targets).map((target) => target.createView());
    draw(encoder, "gbuffer", views, gbufferPipeline, [{ buffer: uniforms }]);
    const worldToView = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -eye[0], -eye[1], -eye[2], 1];
    return { ...host.targets, camera: { worldToView, tanHalfFov, near: NEAR } };
  };

  host.compose = (encoder, indirect) => {
    const { direct, albedo } = host.targets;
    const views = [direct, albedo, indirect].map((target) => target.createView());
    draw(encoder, "compose", [context.getCurrentTexture().createView()], composePipeline, views);
  };
  return host;
}
