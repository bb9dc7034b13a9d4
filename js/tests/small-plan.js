// A small plan of two passes for tests: a history, a rule for a size, a live setting, and a division.

export const shaders = { "00_first.wgsl": "first", "01_second.wgsl": "second" };

const side = (of, more = {}) => ({ of, divide: 2, plus: 0, per: 1, times: 1, ...more });
const texture = (name, usage = ["texture-binding", "storage-binding"]) => ({
  name,
  format: "rgba32float",
  size: [side("width"), side("height")],
  layers: 1,
  mips: 1,
  usage,
  reason: "test",
});
const uniform = (name, group, index, block) => ({ name, group, index, kind: "uniform", block });

export const smallPlan = () => ({
  version: 1,
  program: "test",
  command: "evaluator export",
  technique: "small",
  summary: "test",
  display: { exported: [16, 9], valid: "any" },
  notes: [],
  settings: [
    {
      name: "radius",
      value: 2,
      doc: "Radius.",
      unit: "scene units",
      change: "live",
      range: { at_least: 0, at_most: 10, above: false, whole: false },
    },
    {
      name: "share",
      value: 0.5,
      doc: "Share.",
      unit: "1",
      change: "live",
      range: { at_least: 0, at_most: 0.9, above: true, whole: false },
    },
    {
      name: "count",
      value: 4,
      doc: "Count.",
      unit: "1",
      change: "live",
      range: { at_least: 1, at_most: 8, above: false, whole: true },
    },
    { name: "slices", value: 1, doc: "Slices.", unit: "1", change: "export" },
    { name: "rays", value: 8, doc: "Rays.", unit: "1", change: "none" },
  ],
  inputs: [
    { name: "depth", doc: "Depth.", formats: ["r32float"] },
    { name: "direct", doc: "Light.", formats: ["rgba16float"] },
  ],
  outputs: [{ name: "indirect", texture: "light", doc: "Light." }],
  textures: [
    texture("half"),
    texture("light", ["texture-binding", "storage-binding", "copy-src"]),
    texture("light_before"),
  ],
  histories: [{ now: "light", before: "light_before" }],
  uniforms: [
    {
      name: "view",
      size: 168,
      fields: [
        { name: "world_to_view", offset: 0, type: "mat4x4f", from: "camera.world_to_view" },
        { name: "view_to_world", offset: 64, type: "mat4x4f", from: "camera.view_to_world" },
        { name: "tan_half_fov", offset: 128, type: "vec2f", from: "camera.tan_half_fov" },
        { name: "display_size", offset: 136, type: "vec2f", from: "display.size" },
        { name: "near", offset: 144, type: "f32", from: "camera.near" },
        { name: "frame", offset: 148, type: "u32", from: "frame.number" },
        { name: "seed", offset: 152, type: "u32", from: "frame.seed" },
        { name: "valid", offset: 156, type: "u32", from: "previous.valid" },
        { name: "still", offset: 160, type: "u32", from: "frame.unchanged" },
      ],
    },
    {
      name: "previous",
      size: 64,
      fields: [{ name: "view_to_previous", offset: 0, type: "mat4x4f", from: "previous.view_to_previous" }],
    },
    {
      name: "division",
      size: 16,
      fields: [
        { name: "workgroup", offset: 0, type: "vec2u", from: "dispatch.workgroup" },
        { name: "invocation", offset: 8, type: "vec2u", from: "dispatch.invocation" },
      ],
    },
    {
      name: "first.params",
      size: 24,
      fields: [
        {
          name: "radius",
          offset: 0,
          type: "f32",
          value: 2,
          by_setting: { setting: "radius", power: { times: 0.5, power: 2 }, at_zero: 1e15 },
        },
        { name: "area", offset: 4, type: "f32", value: 337, by_size: { divide: 1, times_squares: 1, least: 4 } },
        {
          name: "settle",
          offset: 8,
          type: "u32",
          value: 8,
          by_setting: { setting: "share", frames_until: 0.00390625 },
        },
        {
          name: "count",
          offset: 12,
          type: "i32",
          value: 4,
          by_setting: { setting: "count", power: { times: 1, power: 1 } },
        },
        { name: "pair", offset: 16, type: "vec2f", value: [0.25, -1] },
      ],
    },
  ],
  passes: [
    {
      name: "first",
      reason: "test",
      shader: "00_first.wgsl",
      entry: "first",
      constants: { STEPS: 4 },
      workgroup_size: [8, 4, 1],
      workgroups: [side("width", { per: 8 }), side("height", { per: 4, plus: 1 })],
      work: 10,
      bindings: [
        uniform("view", 0, 0, "view"),
        uniform("params", 0, 1, "first.params"),
        { name: "depth", group: 0, index: 2, kind: "texture", texture: "depth", dimension: "2d" },
        { name: "half", group: 0, index: 3, kind: "storage_texture", texture: "half", access: "write-only" },
        uniform("division", 1, 0, "division"),
      ],
    },
    {
      name: "second",
      reason: "test",
      shader: "01_second.wgsl",
      entry: "second",
      constants: {},
      workgroup_size: [8, 8, 1],
      workgroups: [side("width", { per: 8 }), { fixed: 3 }],
      work: 0,
      bindings: [
        uniform("previous", 0, 0, "previous"),
        { name: "half", group: 0, index: 1, kind: "texture", texture: "half", dimension: "2d" },
        { name: "before", group: 0, index: 2, kind: "texture", texture: "light_before", dimension: "2d" },
        { name: "direct", group: 0, index: 3, kind: "texture", texture: "direct", dimension: "2d" },
        { name: "light", group: 0, index: 4, kind: "storage_texture", texture: "light", access: "write-only" },
        { name: "linear", group: 0, index: 5, kind: "sampler", filter: "linear" },
      ],
    },
  ],
});
