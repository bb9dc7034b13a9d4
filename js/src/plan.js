// Checks that a plan says only what the player understands. What it does not understand might change the light.

/** A plan that the player does not understand, or a wrong use of it. */
export class PlanError extends Error {
  name = "PlanError";
}

/** @typedef {(value: any, path: string) => void} Check */

/** @returns {never} */
const refuse = (/** @type {string} */ path, /** @type {string} */ problem) => {
  throw new PlanError(`${path} ${problem}.`);
};

const shown = (/** @type {any} */ value) => JSON.stringify(value)?.slice(0, 40) ?? "missing";

const NEWER = "the plan may be of a newer version of Halflight";

/** @type {Check} */
const string = (value, path) => {
  if (typeof value !== "string") refuse(path, `is ${shown(value)}: it must be a text`);
};

/** @type {Check} */
const name = (value, path) => {
  if (typeof value !== "string" || value === "") refuse(path, `is ${shown(value)}: it must be a name`);
};

/** @type {Check} */
const number = (value, path) => {
  if (!Number.isFinite(value)) refuse(path, `is ${shown(value)}: it must be a number`);
};

/** @type {Check} */
const boolean = (value, path) => {
  if (typeof value !== "boolean") refuse(path, `is ${shown(value)}: it must be true or false`);
};

/** @returns {Check} */
const whole = (/** @type {number} */ least) => (value, path) => {
  if (!Number.isInteger(value) || value < least)
    refuse(path, `is ${shown(value)}: it must be a whole number of at least ${least}`);
};

/** @returns {Check} */
const oneOf = (/** @type {readonly any[]} */ values) => (value, path) => {
  if (!values.includes(value)) refuse(path, `is ${shown(value)}: known are ${values.join(", ")}; ${NEWER}`);
};

/** @returns {Check} */
const list = (/** @type {Check} */ check, /** @type {number | undefined} */ length) => (value, path) => {
  if (!Array.isArray(value)) refuse(path, `is ${shown(value)}: it must be a list`);
  if (length !== undefined && value.length !== length)
    refuse(path, `has ${value.length} entries: it must have ${length}`);
  value.forEach((/** @type {any} */ entry, /** @type {number} */ i) => check(entry, `${path}[${i}]`));
};

const isRecord = (/** @type {any} */ value) => typeof value === "object" && value !== null && !Array.isArray(value);

/** @returns {Check} */
const record =
  (/** @type {Record<string, Check>} */ required, /** @type {Record<string, Check>} */ optional = {}) =>
  (value, path) => {
    if (!isRecord(value)) refuse(path, `is ${shown(value)}: it must be an object`);
    for (const key of Object.keys(value)) {
      if (!Object.hasOwn(required, key) && !Object.hasOwn(optional, key))
        refuse(`${path}.${key}`, `is not known: ${NEWER}`);
    }
    for (const [key, check] of Object.entries(required)) {
      if (!Object.hasOwn(value, key)) refuse(`${path}.${key}`, "is missing");
      check(value[key], `${path}.${key}`);
    }
    for (const [key, check] of Object.entries(optional)) {
      if (Object.hasOwn(value, key)) check(value[key], `${path}.${key}`);
    }
  };

/** Objects that are told apart by a key which only one of them has. @returns {Check} */
const having = (/** @type {[string, Check][]} */ kinds) => (value, path) => {
  if (!isRecord(value)) refuse(path, `is ${shown(value)}: it must be an object`);
  const kind = kinds.find(([key]) => Object.hasOwn(value, key));
  if (!kind) return refuse(path, `has none of ${kinds.map(([key]) => key).join(", ")}: ${NEWER}`);
  kind[1](value, path);
};

const side = having([
  ["fixed", record({ fixed: whole(1) })],
  ["of", record({ of: oneOf(["width", "height"]), divide: whole(1), plus: whole(0), per: whole(1), times: whole(1) })],
]);

const squares = record({ divide: whole(1), times_squares: number, least: number });

/** @type {Check} */
const atZero = (value, path) => (typeof value === "number" ? number(value, path) : squares(value, path));

const bySetting = having([
  ["power", record({ setting: name, power: record({ times: number, power: oneOf([1, 2]) }) }, { at_zero: atZero })],
  ["frames_until", record({ setting: name, frames_until: number }, { at_zero: atZero })],
]);

/** Numbers of each type of a field. */
export const COMPONENTS = /** @type {const} */ ({
  f32: 1,
  i32: 1,
  u32: 1,
  vec2f: 2,
  vec3f: 3,
  vec4f: 4,
  vec2u: 2,
  vec3u: 3,
  vec4u: 4,
  mat4x4f: 16,
});

/** The values that a field may take from a frame, with their type. */
export const FROM = /** @type {const} */ ({
  "camera.world_to_view": "mat4x4f",
  "camera.view_to_world": "mat4x4f",
  "camera.tan_half_fov": "vec2f",
  "camera.near": "f32",
  "display.size": "vec2f",
  "frame.number": "u32",
  "frame.seed": "u32",
  "frame.unchanged": "u32",
  "previous.view_to_previous": "mat4x4f",
  "previous.tan_half_fov": "vec2f",
  "previous.valid": "u32",
  "dispatch.workgroup": "vec2u",
  "dispatch.invocation": "vec2u",
});

const type = oneOf(Object.keys(COMPONENTS));

/** @type {Check} */
const value = (found, path) => (Array.isArray(found) ? list(number, undefined)(found, path) : number(found, path));

const field = having([
  ["from", record({ name, offset: whole(0), type, from: oneOf(Object.keys(FROM)) })],
  ["value", record({ name, offset: whole(0), type, value }, { by_size: squares, by_setting: bySetting })],
]);

const variable = { name, group: whole(0), index: whole(0) };

/** @type {Record<string, Check>} */
const BINDINGS = {
  texture: record({ ...variable, kind: string, texture: name, dimension: oneOf(["2d", "2d-array"]) }),
  storage_texture: record({ ...variable, kind: string, texture: name, access: oneOf(["write-only"]) }),
  uniform: record({ ...variable, kind: string, block: name }),
  sampler: record({ ...variable, kind: string, filter: oneOf(["linear", "nearest"]) }),
};

/** @type {Check} */
const binding = (found, path) => {
  if (!isRecord(found)) refuse(path, `is ${shown(found)}: it must be an object`);
  oneOf(Object.keys(BINDINGS))(found.kind, `${path}.kind`);
  BINDINGS[found.kind](found, path);
};

export const FORMATS = [
  "r32float",
  "r32uint",
  "rg32float",
  "rg32uint",
  "rgba8unorm",
  "rgba16float",
  "rgba16uint",
  "rgba32float",
  "rgba32uint",
];

/** @type {Check} */
const constants = (found, path) => {
  if (!isRecord(found)) refuse(path, `is ${shown(found)}: it must be an object`);
  for (const [key, constant] of Object.entries(found)) number(constant, `${path}.${key}`);
};

const shape = record({
  version: oneOf([1]),
  program: string,
  command: string,
  technique: name,
  summary: string,
  display: record({ exported: list(whole(1), 2), valid: oneOf(["any", "exported"]) }, { reason: string }),
  notes: list(string, undefined),
  settings: list(
    record(
      { name, value: () => {}, doc: string, unit: string, change: oneOf(["live", "export", "none"]) },
      { range: record({ at_least: number, at_most: number, above: boolean, whole: boolean }) },
    ),
    undefined,
  ),
  inputs: list(record({ name, doc: string, formats: list(string, undefined) }), undefined),
  outputs: list(record({ name, texture: name, doc: string }), undefined),
  textures: list(
    record({
      name,
      format: oneOf(FORMATS),
      size: list(side, 2),
      layers: whole(1),
      mips: oneOf([1]),
      usage: list(oneOf(["texture-binding", "storage-binding", "copy-src"]), undefined),
      reason: string,
    }),
    undefined,
  ),
  histories: list(record({ now: name, before: name }), undefined),
  uniforms: list(record({ name, size: whole(4), fields: list(field, undefined) }), undefined),
  passes: list(
    record({
      name,
      reason: string,
      shader: name,
      entry: name,
      constants,
      workgroup_size: list(whole(1), 3),
      workgroups: list(side, 2),
      work: whole(0),
      bindings: list(binding, undefined),
    }),
    undefined,
  ),
});

/**
 * Checks a plan.
 * @param {any} plan What plan.json holds.
 * @returns {import("../halflight.js").Plan} The same plan.
 */
export function checkPlan(plan) {
  if (!isRecord(plan)) refuse("plan", "is not an object: pass what plan.json holds");
  // A newer version may have anything else.
  if (plan.version !== 1)
    refuse("plan.version", `is ${shown(plan.version)}: this version of halflight plays version 1`);
  shape(plan, "plan");
  references(plan);
  return plan;
}

/** Checks that names refer to something, once. @param {import("../halflight.js").Plan} plan */
function references(plan) {
  const names = (/** @type {string} */ key) => {
    const entries = /** @type {any} */ (plan)[key];
    const found = new Map();
    entries.forEach((/** @type {any} */ entry, /** @type {number} */ i) => {
      if (found.has(entry.name)) refuse(`plan.${key}[${i}].name`, `is ${shown(entry.name)} a second time`);
      found.set(entry.name, entry);
    });
    return found;
  };
  const [settings, inputs, textures, uniforms] = ["settings", "inputs", "textures", "uniforms"].map(names);
  names("passes");
  names("outputs");
  const among = (/** @type {Map<string, any>[]} */ maps, /** @type {string} */ found, /** @type {string} */ path) => {
    if (!maps.some((map) => map.has(found))) refuse(path, `is ${shown(found)}, which the plan does not have`);
  };
  plan.outputs.forEach((output, i) => among([textures], output.texture, `plan.outputs[${i}].texture`));
  plan.histories.forEach((history, i) => {
    among([textures], history.now, `plan.histories[${i}].now`);
    among([textures], history.before, `plan.histories[${i}].before`);
    const [now, before] = [history.now, history.before].map((one) => textures.get(one));
    if (now.format !== before.format || JSON.stringify(now.size) !== JSON.stringify(before.size))
      refuse(`plan.histories[${i}]`, `is a pair of textures of different formats or sizes`);
  });
  plan.settings.forEach((setting, i) => {
    if (setting.change === "live" && (!setting.range || typeof setting.value !== "number"))
      refuse(`plan.settings[${i}].range`, "is missing: a live setting has a number and a range");
  });
  plan.uniforms.forEach((block, i) => {
    block.fields.forEach((one, k) => {
      const path = `plan.uniforms[${i}].fields[${k}]`;
      const count = COMPONENTS[one.type];
      if (one.offset % 4 !== 0 || one.offset + 4 * count > block.size)
        refuse(`${path}.offset`, `is ${one.offset}: a ${one.type} is not inside ${block.size} bytes there`);
      if ("from" in one) {
        if (FROM[one.from] !== one.type) refuse(`${path}.type`, `is ${one.type}: ${one.from} is a ${FROM[one.from]}`);
        return;
      }
      if ([one.value].flat().length !== count) refuse(`${path}.value`, `has not the ${count} numbers of a ${one.type}`);
      if ((one.by_size || one.by_setting) && count !== 1)
        refuse(`${path}.type`, `is ${one.type}: only numbers follow a rule`);
      if (one.by_setting) {
        among([settings], one.by_setting.setting, `${path}.by_setting.setting`);
        if (settings.get(one.by_setting.setting).change !== "live")
          refuse(`${path}.by_setting.setting`, `is ${shown(one.by_setting.setting)}, which is not live`);
      }
    });
  });
  plan.passes.forEach((pass, i) => {
    pass.bindings.forEach((one, k) => {
      const path = `plan.passes[${i}].bindings[${k}]`;
      if (one.kind === "texture") among([textures, inputs], one.texture, `${path}.texture`);
      if (one.kind === "storage_texture") among([textures], one.texture, `${path}.texture`);
      if (one.kind === "uniform") among([uniforms], one.block, `${path}.block`);
    });
  });
}
