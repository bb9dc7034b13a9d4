// The package in Chromium and the evaluator play the same plans on the same G-buffer, both on the SwiftShader that
// Chromium brings.

import assert from "node:assert/strict";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, it } from "node:test";
import { fileURLToPath } from "node:url";

import { Page } from "./browser/chromium.js";
import { difference } from "./browser/compare.js";
import { evaluatorExport, skip } from "./browser/evaluator.js";
import { serve } from "./browser/server.js";

const SIZE = "320x180";
/** Odd sides: no level divides them. */
const ODD = "161x91";

/**
 * Both sides run the same WGSL on the same SwiftShader. Only the compilers to SPIR-V differ, naga and Tint, and they may
 * round single operations in another way. Numbers that differ by no more than such rounding are equal (`difference`). Where
 * rounding decides between two surfaces, a sample hits another one: one number in a thousand may differ by more.
 */
const MOST = { differing: 1e-3, relative: 1e-3 };

const folder = skip ? "" : mkdtempSync(join(tmpdir(), "halflight-equality-"));
let server,
  page,
  count = 0;

/** Exports a plan with a sample; the name of its folder. */
function exported(technique, settings, size, { scene = "cornell", frames = 1 } = {}) {
  const name = `plan_${count++}`;
  const sets = settings.flatMap((setting) => ["--set", setting]);
  const sample = ["--sample", scene, "--frames", String(frames), "--adapter", "software"];
  evaluatorExport(["--technique", technique, ...sets, "--size", size, ...sample, "--out", join(folder, name)]);
  return name;
}

const sampleOf = (name) => JSON.parse(readFileSync(join(folder, name, "sample.json"), "utf8"));

/** Plays a plan on samples: the results of the package, and those of the evaluator. */
async function played(plan, samples, more = {}) {
  const job = {
    plan: `/data/${plan}`,
    samples: samples.map((one) => ({ ...one, folder: `/data/${one.folder}` })),
    ...more,
  };
  const answer = await page.evaluate(`play(${JSON.stringify(job)})`);
  assert.deepEqual(answer.errors, [], "errors of the device");
  const wanted = samples.flatMap(({ folder: name }) => {
    const sample = sampleOf(name);
    assert.match(sample.adapter, /SwiftShader/);
    return sample.frames.map((frame) => ({ frame, name }));
  });
  assert.equal(answer.frames.length, wanted.length);
  const differences = wanted.flatMap(({ frame, name }, i) => {
    const found = answer.frames[i];
    assert.deepEqual(Object.keys(found).sort(), Object.keys(frame.outputs).sort(), "results");
    return Object.entries(frame.outputs).map(([output, file]) => {
      const { format, base64 } = found[output];
      const bytes = readFileSync(join(folder, name, file));
      return {
        what: `${name} frame ${frame.number} ${output}`,
        ...difference(Buffer.from(base64, "base64"), bytes, format),
      };
    });
  });
  return { answer, differences };
}

function assertEqual(differences) {
  for (const { what, differing, relative, mean } of differences) {
    assert.ok(mean > 1e-3, `${what} is black: it shows nothing`);
    assert.ok(
      differing <= MOST.differing && relative <= MOST.relative,
      `${what}: ${differing} differ, relative ${relative}`,
    );
  }
}

describe("the picture of the package is that of the evaluator", { skip }, () => {
  before(async () => {
    server = await serve({
      package: fileURLToPath(new URL("..", import.meta.url)),
      test: fileURLToPath(new URL("browser", import.meta.url)),
      data: folder,
    });
    page = await Page.open(`${server.address}/test/page.html`);
  });
  after(async () => {
    await page?.close();
    server?.close();
    rmSync(folder, { recursive: true, force: true });
  });

  // Each technique with its defaults and with other settings. A length that has no default without a scene is given.
  for (const [technique, ...presets] of [
    ["bitmask", [], ["resolution=half", "sectors=128", "slices=2", "denoise=2", "radius=1"]],
    ["hierarchical", [], ["start_resolution=half", "levels=5", "ring=2009", "bounces=2", "storage=float32"]],
    ["gtao", [], ["falloff=0.6", "radius=1", "resolution=half"]],
    ["horizon", [], ["resolution=half", "slices=2", "radius=1.5"]],
    ["ray-march", [], ["finds=occlusion", "rays=4", "radius=1"]],
    ["ssao", ["radius=0.2"], ["radius=0.4", "start_resolution=half"]],
    ["ssdo", ["radius=0.2"], ["radius=0.4", "weighting=published", "start_resolution=half"]],
    [
      "hybrid",
      ["sources=screen", "radius=0.2"],
      ["sources=screen", "radius=0.4", "recompute_below=0.1", "ambient_occlusion=screen", "occlusion_radius=0.3"],
    ],
  ]) {
    for (const settings of presets) {
      it(`${technique} ${settings.join(" ")}`, async () => {
        const [plan, odd] = [SIZE, ODD].map((size) => exported(technique, settings, size));
        const { answer, differences } = await played(plan, [{ folder: plan }, { folder: odd }, { folder: plan }]);
        assertEqual(differences);
        assert.deepEqual(answer.size, [320, 180], "the size is that of the last inputs");
      });
    }
  }

  it("exhaustive, which is valid for one size alone", async () => {
    const [plan, other] = ["32x18", "33x18"].map((size) => exported("exhaustive", [], size));
    assertEqual((await played(plan, [{ folder: plan }])).differences);
    await assert.rejects(played(plan, [{ folder: other }]), /valid for 32x18 alone, not for 33x18: export it again/);
  });

  it("another seed is another picture", async () => {
    const plan = exported("bitmask", [], SIZE);
    const { differences } = await played(plan, [{ folder: plan }], { options: { seed: 1 } });
    assert.ok(differences[0].differing > 100 * MOST.differing && differences[0].relative > 10 * MOST.relative);
  });

  const moving = `
    name = "moving"
    [[model]]
    generator = "cornell"
    [camera]
    eye = [0.0, 1.0, 3.9]
    target = [0.0, 1.0, 0.0]
    up = [0.0, 1.0, 0.0]
    vertical_fov_degrees = 39.3
    moves = [
        { frame = 0, eye = [0.0, 1.0, 3.9], target = [0.0, 1.0, 0.0] },
        { frame = 2, eye = [0.0, 1.0, 3.9], target = [0.0, 1.0, 0.0] },
        { frame = 5, eye = [0.06, 1.02, 3.85], target = [0.02, 1.0, 0.0] },
        { frame = 6, eye = [-0.5, 1.2, 3.7], target = [0.0, 0.9, 0.0], cut = true },
        { frame = 8, eye = [-0.5, 1.2, 3.7], target = [0.0, 0.9, 0.0] },
    ]
    [[light]]
    kind = "spot"
    position = [0.0, 1.95, 0.0]
    direction = [0.15, -1.0, 0.1]
    intensity = [4.0, 3.7, 3.2]
    half_angle_degrees = 40.0`;

  for (const [technique, ...settings] of [
    ["bitmask", "temporal_a=0.9", "feedback=0.5"],
    ["hierarchical", "bounces=2", "bounce_interleaving=on", "temporal_a=0.9", "samples=16"],
  ]) {
    it(`${technique} ${settings.join(" ")} over 8 frames of a camera that rests, moves and cuts`, async () => {
      const scene = join(folder, "moving.toml");
      writeFileSync(scene, moving);
      const plan = exported(technique, settings, SIZE, { scene, frames: 8 });
      const frames = sampleOf(plan).frames;
      assert.deepEqual(
        [0, 3, 6].map((i) => frames[i].camera.cut),
        [false, false, true],
      );
      const { differences } = await played(plan, [{ folder: plan }]);
      assert.equal(differences.length, 8);
      assertEqual(differences);
    });
  }

  it("a static image averages without limit", async () => {
    const plan = exported("bitmask", ["temporal_a=0.5"], "64x36", { frames: 14 });
    assertEqual((await played(plan, [{ folder: plan }])).differences);
  });

  it("live settings are those of an export with them", async () => {
    for (const [technique, from, settings] of [
      ["bitmask", [], { radius: 0.7, thickness: 0.1, thickness_slope: 0.01 }],
      ["bitmask", ["radius=0.7"], { radius: 0 }],
      ["hierarchical", [], { radius: 4 }],
      ["hierarchical", ["radius=4"], { radius: 0 }],
      ["ssdo", ["radius=0.2", "weighting=published"], { radius: 0.5, intensity: 3 }],
    ]) {
      const plan = exported(technique, from, SIZE);
      const to = exported(
        technique,
        [...from, ...Object.entries(settings).map((pair) => pair.join("="))].filter((one, i, all) => {
          const name = one.split("=")[0];
          return !all.slice(i + 1).some((later) => later.startsWith(`${name}=`));
        }),
        SIZE,
      );
      const before = await played(plan, [{ folder: to }]);
      assert.ok(
        before.differences[0].differing > 100 * MOST.differing,
        `${technique}: the settings change the picture`,
      );
      assertEqual((await played(plan, [{ folder: to, settings }])).differences);
    }
  });

  it("a divided dispatch leaves the same picture", async () => {
    const plan = exported("bitmask", [], SIZE);
    assertEqual((await played(plan, [{ folder: plan }], { options: { workAtOnce: 2 ** 15 } })).differences);
  });

  it("passes are timed where the device has timestamps", async () => {
    const plan = exported("gtao", [], SIZE);
    const { answer } = await played(plan, [{ folder: plan }]);
    assert.deepEqual(
      answer.times.map(({ name }) => name),
      ["pyramid_1", "gather", "denoise_0"],
    );
    assert.ok(
      answer.times.every(({ milliseconds }) => milliseconds > 0 && milliseconds < 60_000),
      JSON.stringify(answer.times),
    );
    const without = await played(plan, [{ folder: plan }], { features: [] });
    assert.equal(without.answer.times, null);
    assertEqual(without.differences);
  });
});
