// Plans that the package does not understand are refused by one sentence that names the field.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { describe, it } from "node:test";

import { checkPlan, createHalflight, PlanError } from "../src/index.js";
import { COMPONENTS, FORMATS, FROM } from "../src/plan.js";
import { shaders, smallPlan } from "./small-plan.js";

/** The sentence that refuses a plan with this fault. */
function refused(fault) {
  const plan = smallPlan();
  fault(plan);
  try {
    checkPlan(plan);
  } catch (error) {
    assert.ok(error instanceof PlanError, String(error));
    assert.ok(!error.message.includes("\n") && error.message.endsWith("."), error.message);
    return error.message;
  }
  return assert.fail("the plan is accepted");
}

describe("a plan is refused", () => {
  for (const [what, fault, sentence] of [
    ["of another version", (p) => (p.version = 2), "plan.version is 2: this version of halflight plays version 1."],
    [
      "without a version",
      (p) => delete p.version,
      "plan.version is missing: this version of halflight plays version 1.",
    ],
    ["without passes", (p) => delete p.passes, "plan.passes is missing."],
    [
      "with a field that is not known",
      (p) => (p.passes[1].repeat = 2),
      "plan.passes[1].repeat is not known: the plan may be of a newer version of Halflight.",
    ],
    [
      "with a field of the name of a method",
      (p) => (p.passes[1].constructor = 2),
      "plan.passes[1].constructor is not known: the plan may be of a newer version of Halflight.",
    ],
    [
      "with another kind of binding",
      (p) => (p.passes[0].bindings[2].kind = "storage_buffer"),
      'plan.passes[0].bindings[2].kind is "storage_buffer": known are texture, storage_texture, uniform, sampler; the plan may be of a newer version of Halflight.',
    ],
    [
      "with another source of a value",
      (p) => (p.uniforms[0].fields[0].from = "camera.colour"),
      'plan.uniforms[0].fields[0].from is "camera.colour": known are camera.world_to_view, camera.view_to_world, camera.tan_half_fov, camera.near, display.size, frame.number, frame.seed, frame.unchanged, previous.view_to_previous, previous.tan_half_fov, previous.valid, dispatch.workgroup, dispatch.invocation; the plan may be of a newer version of Halflight.',
    ],
    [
      "with another rule of a size",
      (p) => (p.textures[0].size[0] = { log2: 3 }),
      "plan.textures[0].size[0] has none of fixed, of: the plan may be of a newer version of Halflight.",
    ],
    [
      "with another function of a setting",
      (p) => (p.uniforms[3].fields[0].by_setting = { setting: "radius", sine: 1 }),
      "plan.uniforms[3].fields[0].by_setting has none of power, frames_until: the plan may be of a newer version of Halflight.",
    ],
    [
      "with mip levels",
      (p) => (p.textures[1].mips = 4),
      "plan.textures[1].mips is 4: known are 1; the plan may be of a newer version of Halflight.",
    ],
    [
      "with another access",
      (p) => (p.passes[0].bindings[3].access = "read-write"),
      'plan.passes[0].bindings[3].access is "read-write": known are write-only; the plan may be of a newer version of Halflight.',
    ],
    [
      "with a format that is not for storage",
      (p) => (p.textures[2].format = "bc1-rgba-unorm"),
      /^plan\.textures\[2\]\.format is "bc1-rgba-unorm": known are r32float/,
    ],
    [
      "with a size of zero",
      (p) => (p.passes[0].workgroup_size[1] = 0),
      "plan.passes[0].workgroup_size[1] is 0: it must be a whole number of at least 1.",
    ],
    [
      "with a constant that is no number",
      (p) => (p.passes[0].constants.STEPS = "4"),
      'plan.passes[0].constants.STEPS is "4": it must be a number.',
    ],
    [
      "with a texture that it lacks",
      (p) => (p.passes[1].bindings[1].texture = "quarter"),
      'plan.passes[1].bindings[1].texture is "quarter", which the plan does not have.',
    ],
    [
      "that writes an input",
      (p) => (p.passes[1].bindings[4].texture = "depth"),
      'plan.passes[1].bindings[4].texture is "depth", which the plan does not have.',
    ],
    [
      "with a block that it lacks",
      (p) => (p.passes[0].bindings[0].block = "camera"),
      'plan.passes[0].bindings[0].block is "camera", which the plan does not have.',
    ],
    [
      "with an output that it lacks",
      (p) => (p.outputs[0].texture = "final"),
      'plan.outputs[0].texture is "final", which the plan does not have.',
    ],
    [
      "with two textures of a name",
      (p) => (p.textures[1].name = "half"),
      'plan.textures[1].name is "half" a second time.',
    ],
    [
      "with a history of two sizes",
      (p) => (p.textures[2].size = [{ fixed: 1 }, { fixed: 1 }]),
      "plan.histories[0] is a pair of textures of different formats or sizes.",
    ],
    [
      "with a field outside of its block",
      (p) => (p.uniforms[3].fields[4].offset = 20),
      "plan.uniforms[3].fields[4].offset is 20: a vec2f is not inside 24 bytes there.",
    ],
    [
      "with a value of another type",
      (p) => (p.uniforms[0].fields[5].type = "f32"),
      "plan.uniforms[0].fields[5].type is f32: frame.number is a u32.",
    ],
    [
      "with too few numbers",
      (p) => (p.uniforms[3].fields[4].value = 1),
      "plan.uniforms[3].fields[4].value has not the 2 numbers of a vec2f.",
    ],
    [
      "that follows a setting which is not live",
      (p) => (p.uniforms[3].fields[0].by_setting.setting = "slices"),
      'plan.uniforms[3].fields[0].by_setting.setting is "slices", which is not live.',
    ],
    [
      "with a live setting without a range",
      (p) => delete p.settings[0].range,
      "plan.settings[0].range is missing: a live setting has a number and a range.",
    ],
    ["with a list that is none", (p) => (p.inputs = {}), "plan.inputs is {}: it must be a list."],
  ]) {
    it(what, () => {
      const found = refused(fault);
      if (sentence instanceof RegExp) assert.match(found, sentence);
      else assert.equal(found, sentence);
    });
  }

  it("that is no object", () => {
    assert.throws(() => checkPlan(undefined), { message: "plan is not an object: pass what plan.json holds." });
    assert.throws(() => checkPlan("{}"), PlanError);
  });

  it("before anything is made on the device", async () => {
    const device = new Proxy({}, { get: (_, key) => assert.fail(`the device is asked for ${String(key)}`) });
    await assert.rejects(createHalflight(device, { ...smallPlan(), version: 3 }, shaders), /plan\.version is 3/);
    await assert.rejects(createHalflight(device, smallPlan(), { "00_first.wgsl": "" }), {
      name: "PlanError",
      message: "The text of the shader 01_second.wgsl is missing.",
    });
  });
});

it("a plan that is understood is returned as it is", () => {
  const plan = smallPlan();
  assert.equal(checkPlan(plan), plan);
});

it("the schema knows the same values as the package", () => {
  const schema = JSON.parse(readFileSync(new URL("../plan.schema.json", import.meta.url), "utf8"));
  assert.deepEqual(schema.$defs.field.oneOf[0].properties.from.enum, Object.keys(FROM));
  assert.deepEqual(schema.$defs.type.enum, Object.keys(COMPONENTS));
  assert.deepEqual(schema.properties.textures.items.properties.format.enum, FORMATS);
  // The package asks for every field that the schema requires.
  const missing = (fault) => {
    const plan = smallPlan();
    fault(plan);
    assert.throws(() => checkPlan(plan), /is missing/);
  };
  for (const key of schema.required) missing((plan) => delete plan[key]);
  for (const key of schema.properties.passes.items.required) missing((plan) => delete plan.passes[0][key]);
  for (const key of schema.properties.textures.items.required) missing((plan) => delete plan.textures[0][key]);
});
