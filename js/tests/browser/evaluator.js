// The evaluator, on the SwiftShader of the browser.

import { spawnSync } from "node:child_process";
import { existsSync } from "node:fs";
import { fileURLToPath } from "node:url";

import { chromiumPath, swiftshaderManifest } from "./chromium.js";

const root = fileURLToPath(new URL("../../../", import.meta.url));

/** Path of the evaluator: HALFLIGHT_EVALUATOR, or what cargo has built; undefined if there is none. */
export function evaluatorPath() {
  if (process.env.HALFLIGHT_EVALUATOR) return process.env.HALFLIGHT_EVALUATOR;
  const built = ["debug", "release"].map((profile) => `${root}target/${profile}/evaluator`);
  return built.find((path) => existsSync(path));
}

/** Runs `evaluator export` and returns what it prints. */
export function evaluatorExport(args) {
  const env = {
    ...process.env,
    VK_DRIVER_FILES: swiftshaderManifest(),
    XDG_RUNTIME_DIR: process.env.XDG_RUNTIME_DIR ?? "/tmp",
  };
  const { status, stdout, stderr, error } = spawnSync(evaluatorPath(), ["export", ...args], { env, encoding: "utf8" });
  if (error || status !== 0) throw new Error(`evaluator export ${args.join(" ")}: ${error ?? stderr}`);
  return stdout;
}

const missing = [
  [evaluatorPath(), "an evaluator (cargo build -p halflight-evaluator)"],
  [chromiumPath(), "Chromium"],
  [swiftshaderManifest(), "the SwiftShader of Chromium (vk_swiftshader_icd.json)"],
].filter(([path]) => !path);

const reason = missing.length > 0 && `needs ${missing.map(([, what]) => what).join(", ")}`;

// `cargo xtask test` gives the path of the evaluator: then nothing is skipped.
if (reason && process.env.HALFLIGHT_EVALUATOR) throw new Error(`The test ${reason}: install what is missing.`);

/** Why tests in the browser cannot run; false if they can. */
export const skip = reason;
