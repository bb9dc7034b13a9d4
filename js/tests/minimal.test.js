// The example `minimal` in Chromium.

import assert from "node:assert/strict";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, it } from "node:test";
import { fileURLToPath } from "node:url";

import { Page } from "./browser/chromium.js";
import { evaluatorExport, skip } from "./browser/evaluator.js";
import { serve } from "./browser/server.js";

const folder = skip ? "" : mkdtempSync(join(tmpdir(), "halflight-minimal-"));
let server;

/** Mean of red, green and blue over a rectangle of a screenshot, shares of its size; 0..255. */
async function colour(page, [left, top, width, height]) {
  const png = (await page.screenshot()).toString("base64");
  return page.evaluate(`(async () => {
    const bytes = Uint8Array.from(atob("${png}"), (c) => c.charCodeAt(0));
    const picture = await createImageBitmap(new Blob([bytes]));
    const canvas = new OffscreenCanvas(picture.width, picture.height);
    const context = canvas.getContext("2d");
    context.drawImage(picture, 0, 0);
    const [w, h] = [picture.width, picture.height];
    const { data } = context.getImageData(${left} * w, ${top} * h, ${width} * w, ${height} * h);
    const sums = [0, 0, 0];
    data.forEach((value, i) => { if (i % 4 < 3) sums[i % 4] += value; });
    return sums.map((sum) => sum / (data.length / 4));
  })()`);
}

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
