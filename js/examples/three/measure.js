// Errors and times of SSGINode and of Halflight on the same G-buffer of three.js, against the path-traced reference of the same
// scene, as tables for docs/three.md. Run with Node.js; it needs Chromium and a built evaluator.

import { spawnSync } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

import { Page } from "../../tests/browser/chromium.js";
import { evaluatorExport, evaluatorPath } from "../../tests/browser/evaluator.js";
import { serve } from "../../tests/browser/server.js";

const [WIDTH, HEIGHT] = [320, 180];
/** Of the times: enough work that the commands themselves do not count. */
const TIMED = { width: 640, height: 360, rounds: 9 };

const PLANS = [
  ["`bitmask`", "bitmask"],
  ["`bitmask`, 2 slices, denoise 2", "bitmask", "slices=2", "denoise=2"],
  ["`bitmask`, 4 slices of 12, denoise 2", "bitmask", "slices=4", "denoise=2"],
  ["`horizon`, 2 slices, denoise 2", "horizon", "slices=2", "denoise=2"],
  ["`hierarchical`", "hierarchical"],
];

/** What needs the scene, so that the evaluator runs it on the same file: technique, frame and settings. */
const IMAGES = [
  ["`radiance-cache`, frame 8", "radiance-cache", 7, "bounces=1"],
  ["`radiance-cache`, frame 32", "radiance-cache", 31, "bounces=1"],
];

/** Slices and steps of the presets without temporal filtering that SSGINode documents, and its default. */
const PRESETS = [
  { name: "SSGINode, 1 slice of 12 (default)", settings: {}, spatial: false },
  ...[
    ["low", 2, 6],
    ["medium", 3, 8],
    ["high", 4, 12],
  ].map(([name, sliceCount, stepCount]) => ({
    name: `SSGINode, ${name}: ${sliceCount} slices of ${stepCount}, DenoiseNode`,
    settings: { sliceCount, stepCount },
    spatial: true,
  })),
];

const folder = mkdtempSync(join(tmpdir(), "halflight-three-"));
const server = await serve({ package: fileURLToPath(new URL("../..", import.meta.url)), data: folder });
const page = await Page.open(`${server.address}/package/examples/three/measure.html`);
try {
  const glb = await page.evaluate(`exportScene(${WIDTH}, ${HEIGHT})`);
  writeFileSync(join(folder, "room.glb"), Buffer.from(glb, "base64"));
  for (const bounces of [0, 1]) {
    const out = join(folder, `truth_${bounces}.exr`);
    const request = ["--size", `${WIDTH}x${HEIGHT}`, "--bounces", bounces, "--samples-per-pixel", 256, "--out", out];
    const run = spawnSync(evaluatorPath(), ["truth", "--scene", join(folder, "room.glb"), ...request].map(String));
    if (run.status !== 0) throw new Error(String(run.stderr));
    console.log(String(run.stdout).trim());
  }
  const plans = PLANS.map(([name, technique, ...settings], i) => {
    const sets = settings.flatMap((setting) => ["--set", setting]);
    evaluatorExport(["--technique", technique, ...sets, "--size", `${WIDTH}x${HEIGHT}`, "--out", join(folder, `${i}`)]);
    return { name, folder: `${server.address}/data/${i}/` };
  });
  const images = IMAGES.map(([name, technique, frame, ...settings], i) => {
    const files = [
      ["none", 0],
      [technique, frame, ...settings],
    ].map(([technique, frame, ...settings], j) => {
      const file = `image_${i}_${j}.exr`;
      const sets = settings.flatMap((setting) => ["--set", setting]);
      const request = ["--technique", technique, ...sets, "--frame", frame, "--size", `${WIDTH}x${HEIGHT}`];
      const out = join(folder, file);
      const run = spawnSync(
        evaluatorPath(),
        ["render", "--scene", join(folder, "room.glb"), ...request, "--out", out].map(String),
      );
      if (run.status !== 0) throw new Error(String(run.stderr));
      return `/data/${file}`;
    });
    return { name, files };
  });
  const truth = [0, 1].map((bounces) => `/data/truth_${bounces}.exr`);
  const job = { width: WIDTH, height: HEIGHT, truth, images, plans, presets: PRESETS };
  const { rows, mean, direct } = await page.evaluate(`measure(${JSON.stringify(job)})`);
  const number = (value) => value.toPrecision(3);
  console.log(
    `mean of albedo * indirect: ${number(mean)}; direct light: RMSE ${number(direct.rmse)}, bias ${number(direct.bias)}\n`,
  );
  console.log("| method | block relMSE | RMSE | bias | best factor | RMSE with it |\n|---|---:|---:|---:|---:|---:|");
  for (const { method, block, rmse, bias, factor, scaled } of rows)
    console.log(`| ${method} | ${number(block)} | ${number(rmse)} | ${number(bias)} | ${number(factor)} | ${number(scaled)} |`);
  const timed = await page.evaluate(`times(${JSON.stringify({ ...TIMED, plans, presets: PRESETS })})`);
  const unit = timed[0].times[1];
  console.log(`\nmilliseconds at ${TIMED.width}x${TIMED.height}, ${TIMED.rounds} rounds\n`);
  console.log("| method | median | least to most | median / first row |\n|---|---:|---:|---:|");
  for (const { method, times } of timed) {
    const [least, median, most] = times.map(number);
    console.log(`| ${method} | ${median} | ${least} to ${most} | ${number(times[1] / unit)} |`);
  }
} finally {
  const told = page.console.filter((line) => !line.includes("MeshStandardMaterial"));
  if (told.length > 0) console.error(told.slice(0, 8).join("\n"));
  await page.close();
  server.close();
  rmSync(folder, { recursive: true, force: true });
}
