// The player on a device that records what it is asked for.

import assert from "node:assert/strict";
import { beforeEach, describe, it } from "node:test";

import { createHalflight } from "../src/index.js";
import { divide } from "../src/rules.js";
import { shaders, smallPlan } from "./small-plan.js";

for (const [name, flags] of Object.entries({
  GPUBufferUsage: ["MAP_READ", "COPY_SRC", "COPY_DST", "UNIFORM", "QUERY_RESOLVE"],
  GPUTextureUsage: ["COPY_SRC", "TEXTURE_BINDING", "STORAGE_BINDING"],
  GPUMapMode: ["READ"],
}))
  globalThis[name] = Object.fromEntries(flags.map((flag, i) => [flag, 1 << i]));

/** A device without a GPU. */
class FakeDevice {
  features = new Set();
  limits = { maxTextureDimension2D: 100 };
  textures = [];
  buffers = [];
  groups = [];
  written = new Map();
  queue = {
    writeBuffer: (buffer, offset, bytes) => this.written.set(`${buffer.label}@${offset}`, new DataView(bytes)),
  };

  createShaderModule({ code }) {
    return {
      code,
      getCompilationInfo: async () => ({ messages: [{ type: "error", lineNum: 7, message: "no such name" }] }),
    };
  }
  async createComputePipelineAsync(descriptor) {
    if (descriptor.compute.module.code === "bad") throw new Error("invalid");
    return { descriptor, getBindGroupLayout: (index) => index };
  }
  createTexture(descriptor) {
    const {
      size: { width, height },
    } = descriptor;
    const made = {
      ...descriptor,
      width,
      height,
      destroyed: false,
      createView: () => ({ of: made }),
      destroy: () => (made.destroyed = true),
    };
    this.textures.push(made);
    return made;
  }
  createBuffer(descriptor) {
    const made = { ...descriptor, destroyed: false, destroy: () => (made.destroyed = true) };
    this.buffers.push(made);
    return made;
  }
  createSampler = (descriptor) => ({ sampler: descriptor });
  createBindGroup(descriptor) {
    this.groups.push(descriptor);
    return descriptor;
  }
}

/** An encoder that records calls. */
function encoder() {
  const calls = [];
  const record =
    (name) =>
    (...args) =>
      void calls.push([name, ...args]);
  return {
    calls,
    pushDebugGroup: record("push"),
    popDebugGroup: record("pop"),
    beginComputePass: (descriptor) => {
      calls.push(["pass", descriptor.label]);
      return Object.fromEntries(
        ["setPipeline", "setBindGroup", "dispatchWorkgroups", "end"].map((name) => [name, record(name)]),
      );
    },
  };
}

const input = (width = 16, height = 9) => ({ width, height, createView: () => ({}) });
const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const camera = { worldToView: IDENTITY, tanHalfFov: [1, 0.5], near: 0.1 };
const at = (z) => ({ ...camera, worldToView: [...IDENTITY.slice(0, 14), z, 1] });

let device, gi, frame;

beforeEach(async () => {
  device = new FakeDevice();
  gi = await createHalflight(device, smallPlan(), shaders, { seed: 5 });
  frame = { depth: input(), direct: input(), camera };
});

const encode = (more = {}) => {
  const recorded = encoder();
  gi.encode(recorded, { ...frame, ...more });
  return recorded.calls;
};
const block = (name, offset = 0) => device.written.get(`halflight/small/${name}@${offset}`);

describe("a frame", () => {
  it("has the passes of the plan with labels and debug groups", () => {
    const calls = encode();
    assert.deepEqual(
      calls.filter(([name]) => ["push", "pop", "pass"].includes(name)),
      [["push", "halflight/small"], ["pass", "halflight/small/first"], ["pass", "halflight/small/second"], ["pop"]],
    );
    // ceil(8 / 8) and ceil((5 + 1) / 4); ceil(8 / 8) and a fixed number.
    assert.deepEqual(
      calls.filter(([name]) => name === "dispatchWorkgroups").map(([, ...count]) => count),
      [
        [1, 2],
        [1, 3],
      ],
    );
    assert.deepEqual(calls.find(([name]) => name === "setPipeline")[1].descriptor.compute.constants, { STEPS: 4 });
  });

  it("has the values of its camera, size and number", () => {
    encode({ camera: at(-3) });
    const view = block("view");
    assert.equal(view.getFloat32(56, true), -3, "world to view");
    assert.equal(view.getFloat32(64 + 56, true), 3, "view to world");
    assert.deepEqual(
      [128, 132, 136, 140].map((i) => view.getFloat32(i, true)),
      [1, 0.5, 16, 9],
    );
    assert.equal(view.getFloat32(144, true), Math.fround(0.1));
    assert.deepEqual(
      [148, 152, 156].map((i) => view.getUint32(i, true)),
      [0, 5, 0],
    );
    encode();
    assert.equal(block("view").getUint32(148, true), 1, "frames are counted");
    encode({ number: 40 });
    encode();
    assert.equal(block("view").getUint32(148, true), 41, "from the given one");
  });

  it("reads the field of view of a projection", () => {
    const projection = [0.5, 0, 0, 0, 0, 2, 0, 0, 0, 0, -1, -1, 0, 0, -0.1, 0];
    encode({ camera: { worldToView: IDENTITY, projection, near: 0.1 } });
    assert.deepEqual(
      [128, 132].map((i) => block("view").getFloat32(i, true)),
      [2, 0.5],
    );
  });

  it("refuses inputs by one sentence", () => {
    const refused = (more, message) => assert.throws(() => encode(more), { name: "PlanError", message });
    refused({ depth: undefined }, "encode: depth is no GPUTexture. Depth.");
    refused({ direct: input(16, 10) }, "encode: direct is 16x10, depth is 16x9.");
    refused({ camera: undefined }, "camera.worldToView is not 16 numbers.");
    refused({ camera: { ...camera, worldToView: [1] } }, "camera.worldToView is not 16 numbers.");
    refused({ camera: { ...camera, worldToView: new Array(16).fill(0) } }, "camera.worldToView has no inverse.");
    refused({ camera: { ...camera, tanHalfFov: undefined } }, "camera.projection is not 16 numbers.");
    refused({ camera: { ...camera, tanHalfFov: [1, NaN] } }, "camera.tanHalfFov is not 2 numbers.");
    refused({ camera: { ...camera, near: undefined } }, "camera.near is undefined: it must be above 0.");
    refused({ number: -1 }, "encode: number is -1: it must be a whole number from 0.");
    refused(
      { depth: input(101, 9), direct: input(101, 9) },
      "101x9 is too large: textures of this device have at most 100 texels a side.",
    );
  });
});

describe("a history", () => {
  const valid = () => block("view").getUint32(156, true);

  it("is valid in the next frame of the same image", () => {
    encode();
    encode();
    assert.equal(valid(), 1);
    encode({ camera: at(0.5) });
    assert.equal(valid(), 1);
    // To the frame before, which was half a unit behind.
    assert.equal(block("previous").getFloat32(56, true), -0.5);
    encode({ camera: at(0.5) });
    assert.deepEqual(
      [0, 20, 40, 56].map((i) => block("previous").getFloat32(i, true)),
      [1, 1, 1, 0],
      "exactly the identity",
    );
  });

  for (const [what, change] of [
    ["a cut", () => ({ camera: { ...camera, cut: true } })],
    ["a jump", () => ({ camera: at(-5001) })],
    [
      "a turn by more than half the field of view",
      () => {
        const [c, s] = [Math.cos(0.8), Math.sin(0.8)];
        return { camera: { ...camera, worldToView: [c, 0, -s, 0, 0, 1, 0, 0, s, 0, c, 0, 0, 0, 0, 1] } };
      },
    ],
    ["a missing frame", () => ({ number: 2 })],
    ["another size", () => ({ depth: input(20, 9), direct: input(20, 9) })],
    ["reset", () => void gi.reset()],
  ]) {
    it(`is not valid after ${what}`, () => {
      encode();
      encode(change() ?? {});
      assert.equal(valid(), 0);
    });
  }

  it("swaps its two textures after every frame", () => {
    const bound = (name) =>
      device.groups
        .filter(({ label }) => label.endsWith("/second"))
        .at(-1)
        .entries.find(({ binding }) => binding === { before: 2, light: 4 }[name]).resource.of;
    encode();
    const [before, light] = [bound("before"), bound("light")];
    assert.equal(gi.indirect, light);
    encode();
    assert.deepEqual(
      [bound("before"), bound("light")].map(({ label }) => label),
      [light.label, before.label],
    );
    assert.equal(gi.indirect, before);
    const made = device.groups.length;
    encode();
    assert.equal(gi.indirect, light);
    assert.equal(device.groups.length, made, "bind groups of both parities are kept");
  });

  it("counts frames in which nothing changes", () => {
    const still = () => block("view").getUint32(160, true);
    for (const wanted of [0, 1, 2]) {
      encode({ unchanged: true });
      assert.equal(still(), wanted);
    }
    encode({ unchanged: true, camera: at(0.1) });
    assert.equal(still(), 0, "the camera moved");
    encode({ unchanged: true, camera: at(0.1) });
    encode({ camera: at(0.1) });
    assert.equal(still(), 0, "the scene may have changed");
  });
});

describe("sizes", () => {
  it("follow the inputs", () => {
    assert.deepEqual([gi.size, gi.indirect], [[0, 0], undefined]);
    encode();
    assert.deepEqual(
      device.textures.map(({ width, height }) => [width, height]),
      [
        [8, 5],
        [8, 5],
        [8, 5],
      ],
    );
    const old = [...device.textures];
    frame = { ...frame, depth: input(33, 20), direct: input(33, 20) };
    const calls = encode();
    assert.deepEqual(
      device.textures.slice(3).map(({ width, height }) => [width, height]),
      [
        [17, 10],
        [17, 10],
        [17, 10],
      ],
    );
    assert.ok(old.every(({ destroyed }) => destroyed) && !gi.indirect.destroyed);
    assert.deepEqual(
      calls.filter(([name]) => name === "dispatchWorkgroups").map(([, ...count]) => count),
      [
        [3, 3],
        [3, 3],
      ],
    );
    assert.deepEqual(gi.size, [33, 20]);
    assert.equal(block("first.params").getFloat32(4, true), 33 * 33 + 20 * 20, "a number that follows the size");
  });

  it("other than the exported one are refused if the plan says so", async () => {
    const plan = smallPlan();
    plan.display = { exported: [16, 9], valid: "exported", reason: "It has other passes." };
    gi = await createHalflight(device, plan, shaders);
    encode();
    assert.throws(() => gi.resize(17, 9), {
      message: "The plan is valid for 16x9 alone, not for 17x9: export it again. It has other passes.",
    });
  });
});

describe("settings", () => {
  const params = () => {
    encode();
    const view = block("first.params");
    return [
      view.getFloat32(0, true),
      view.getFloat32(4, true),
      view.getUint32(8, true),
      view.getInt32(12, true),
      view.getFloat32(16, true),
      view.getFloat32(20, true),
    ];
  };

  it("are as exported, then as set", () => {
    assert.deepEqual(params(), [2, 337, 8, 4, 0.25, -1]);
    gi.set({ radius: 3, share: 0.75, count: 6 });
    assert.deepEqual(params(), [4.5, 337, 20, 6, 0.25, -1]);
    assert.deepEqual(gi.settings, { radius: 3, share: 0.75, count: 6, slices: 1, rays: 8 });
    gi.set({ radius: 0 });
    assert.equal(params()[0], Math.fround(1e15));
    gi.set({ radius: 2, share: 0.5, count: 4 });
    assert.deepEqual(params(), [2, 337, 8, 4, 0.25, -1]);
  });

  it("may be given at the beginning", async () => {
    gi = await createHalflight(device, smallPlan(), shaders, { settings: { radius: 4 } });
    assert.equal(params()[0], 8);
  });

  it("that cannot be set are refused, all of them", () => {
    for (const [settings, message] of [
      [{ radios: 1 }, "radios is no setting of small: live are radius, share, count."],
      [{ slices: 2 }, "slices changes passes or shaders: export the plan again with --set slices=2."],
      [{ rays: 4 }, "rays changes nothing in this plan."],
      [{ radius: 11 }, "radius = 11 is out of range: give from 0 to 10."],
      [{ radius: NaN }, "radius = NaN is out of range: give from 0 to 10."],
      [{ radius: 1, share: 0 }, "share = 0 is out of range: give more than 0 to 0.9."],
      [{ count: 1.5 }, "count = 1.5 is out of range: give a whole number from 1 to 8."],
    ]) {
      assert.throws(() => gi.set(settings), { name: "PlanError", message });
    }
    assert.equal(gi.settings.radius, 2, "a refused call changes nothing");
    gi.set({ slices: 1 });
  });
});

describe("a long dispatch", () => {
  it("is divided, and each part knows where it begins", async () => {
    // Workgroups of 32 invocations with 10 fetches each: two at once.
    gi = await createHalflight(device, smallPlan(), shaders, { workAtOnce: 640 });
    frame = { ...frame, depth: input(64, 16), direct: input(64, 16) };
    const first = encode().slice(0, 18);
    assert.deepEqual(
      first.filter(([name]) => name === "dispatchWorkgroups").map(([, ...count]) => count),
      [
        [2, 1],
        [2, 1],
        [2, 1],
        [2, 1],
        [2, 1],
        [2, 1],
      ],
    );
    const begins = [0, 1, 5].map((i) =>
      [0, 4, 8, 12].map((at) => block("first dispatches", 256 * i).getUint32(at, true)),
    );
    assert.deepEqual(begins, [
      [0, 0, 0, 0],
      [2, 0, 16, 0],
      [2, 2, 16, 8],
    ]);
  });

  it("is covered by its parts once", () => {
    for (const workgroups of [
      [1, 1],
      [160, 90],
      [7, 13],
      [1, 100],
    ]) {
      for (const [work, most] of [
        [64, 1],
        [64, 1000],
        [1, 4096],
        [1000, 2 ** 20],
        [64, Infinity],
      ]) {
        const times = new Array(workgroups[0] * workgroups[1]).fill(0);
        for (const { first, count } of divide(workgroups, work, most)) {
          assert.ok(count[0] * count[1] * work <= Math.max(most, work));
          for (let y = 0; y < count[1]; y++)
            for (let x = 0; x < count[0]; x++) times[(first[1] + y) * workgroups[0] + first[0] + x]++;
        }
        assert.ok(
          times.every((count) => count === 1),
          `${workgroups} ${work} ${most}`,
        );
      }
    }
  });
});

it("a shader that the device refuses is named with its line", async () => {
  await assert.rejects(createHalflight(device, smallPlan(), { ...shaders, "01_second.wgsl": "bad" }), {
    name: "PlanError",
    message: "The device refuses the pass second (01_second.wgsl:7: no such name).",
  });
});

it("everything is freed", () => {
  encode();
  gi.destroy();
  assert.ok([...device.textures, ...device.buffers].every(({ destroyed }) => destroyed));
});
