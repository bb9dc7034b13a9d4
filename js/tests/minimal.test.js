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

/** Opens the example and waits for frames. */
async function opened(search) {
  const page = await Page.open(`${server.address}/package/examples/minimal/index.html${search}`);
  // Pipelines are made before the first frame.
  for (let i = 0; i < 4; i++)
    await page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))");
  await page.evaluate("new Promise((done) => setTimeout(done, 1000))");
  assert.equal(await page.evaluate("document.getElementById('message').textContent"), "");
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
    // The ceiling above the lamp, and the part of it near the red wall.
    const ceiling = [0.4, 0.02, 0.2, 0.06];
    const page = await opened("?indirect=off");
    const without = await colour(page, ceiling);
    await page.close();
    const lit = await opened("");
    const [found, nearRed] = [await colour(lit, ceiling), await colour(lit, [0.02, 0.02, 0.04, 0.04])];
    await lit.close();
    assert.ok(Math.max(...without) < 2, `without indirect light: ${without}`);
    assert.ok(Math.min(...found) > 20, `with it: ${found}`);
    assert.ok(nearRed[0] > 1.2 * nearRed[1], `the wall's red: ${nearRed}`);
  });
});
