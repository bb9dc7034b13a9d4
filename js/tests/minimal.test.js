// The example `minimal` in Chromium.

import assert from "node:assert/strict";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, it } from "node:test";
import { fileURLToPath } from "node:url";

import { Page } from "./browser/chromium.js";
import { evaluatorExport, skip } from "./browser/evaluator.js";
import { colour } from "./browser/picture.js";
import { serve } from "./browser/server.js";

const folder = skip ? "" : mkdtempSync(join(tmpdir(), "halflight-minimal-"));
let server;

// The floor below the lamp: direct light alone shows it.
const FLOOR = [0.45, 0.85, 0.1, 0.05];

/** Opens the example and waits for its first picture, which has the indirect light: pipelines are made before it. */
async function opened(search) {
  const page = await Page.open(`${server.address}/package/examples/minimal/index.html${search}`);
  // Frames pass while the page works. A thousand of them without a picture are a fault.
  for (let frames = 0; Math.max(...(await colour(page, FLOOR))) < 20; frames++) {
    assert.ok(frames < 1000, "the example shows nothing");
    assert.equal(await page.evaluate("document.getElementById('message').textContent"), "");
    await page.evaluate("new Promise((done) => requestAnimationFrame(done))");
  }
  assert.deepEqual(
    page.console.filter((line) => !line.includes("404")),
    [],
  );
  return page;
}

describe("the minimal example", { skip }, () => {
  before(async () => {
    server = await serve(
      { package: fileURLToPath(new URL("..", import.meta.url)), plan: folder },
      {
        "/package/examples/minimal/plan/": "/plan/",
      },
    );
    evaluatorExport(["--technique", "bitmask", "--set", "denoise=2", "--out", folder]);
  });
  after(() => {
    server?.close();
    rmSync(folder, { recursive: true, force: true });
  });

  it("shows light where the lamp does not reach", async () => {
    // The ceiling above the lamp, and its parts near the red wall and near the green one.
    const ceiling = [0.4, 0.02, 0.2, 0.06];
    const page = await opened("?indirect=off");
    const without = await colour(page, ceiling);
    await page.close();
    const lit = await opened("");
    const found = await colour(lit, ceiling);
    const [nearRed, nearGreen] = [await colour(lit, [0.16, 0.02, 0.06, 0.05]), await colour(lit, [0.78, 0.02, 0.06, 0.05])];
    await lit.close();
    assert.ok(Math.max(...without) < 2, `without indirect light: ${without}`);
    assert.ok(Math.min(...found) > 20, `with it: ${found}`);
    // Without light of the walls both would have the same colour, that of the ceiling. It is 1.15 times as red.
    const redness = ([red, green]) => red / green;
    assert.ok(redness(nearRed) > 1.05 * redness(nearGreen), `near red: ${nearRed}, near green: ${nearGreen}`);
  });
});
