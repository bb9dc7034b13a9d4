// The example `three` in Chromium, where three.js is installed.

import assert from "node:assert/strict";
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, it } from "node:test";
import { fileURLToPath } from "node:url";

import { Page } from "./browser/chromium.js";
import { evaluatorExport, skip as skipBrowser } from "./browser/evaluator.js";
import { colour } from "./browser/picture.js";
import { serve } from "./browser/server.js";

const example = fileURLToPath(new URL("../examples/three", import.meta.url));
const lacksThree = !existsSync(join(example, "node_modules/three")) && "needs three.js: npm ci in js/examples/three";
const skip = skipBrowser || lacksThree;

const folder = skip ? "" : mkdtempSync(join(tmpdir(), "halflight-three-"));
let server, page;

describe("the example with three.js", { skip }, () => {
  before(async () => {
    server = await serve(
      { package: fileURLToPath(new URL("..", import.meta.url)), plan: folder },
      { "/package/examples/three/plan/": "/plan/" },
    );
    evaluatorExport(["--technique", "bitmask", "--set", "denoise=2", "--out", folder]);
    page = await Page.open(`${server.address}/package/examples/three/index.html`);
  });
  after(async () => {
    await page?.close();
    server?.close();
    rmSync(folder, { recursive: true, force: true });
  });

  it("shows light on both sides", async () => {
    for (let frames = 0; frames < 3;) {
      await page.evaluate("new Promise((done) => requestAnimationFrame(done))");
      assert.equal(await page.evaluate("document.getElementById('message').textContent"), "");
      frames = await page.evaluate("window.example?.frames ?? 0");
    }
    assert.deepEqual(
      page.console.filter((line) => !line.includes("404")),
      [],
    );
    // The ceiling, which the lamp does not reach: SSGINode left of the middle, Halflight right of it.
    for (const left of [0.4, 0.52]) {
      const [red, green, blue] = await colour(page, [left, 0.08, 0.08, 0.06]);
      assert.ok(Math.min(red, green, blue) > 5, `${left}: ${[red, green, blue]}`);
    }
  });
});
