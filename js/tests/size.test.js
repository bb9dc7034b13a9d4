// What the package weighs: everything that a page fetches, without the shaders of a plan.

import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { it } from "node:test";
import { gzipSync } from "node:zlib";

it("the package is under 20 kB compressed", () => {
  const folder = new URL("../src/", import.meta.url);
  const sizes = readdirSync(folder).map((name) => gzipSync(readFileSync(new URL(name, folder))).length);
  const total = sizes.reduce((sum, size) => sum + size, 0);
  assert.ok(sizes.length > 0 && total < 20_000, `${total} bytes`);
});

it("the package needs no other", () => {
  const own = JSON.parse(readFileSync(new URL("../package.json", import.meta.url), "utf8"));
  assert.deepEqual(
    [own.dependencies, own.peerDependencies, own.optionalDependencies],
    [undefined, undefined, undefined],
  );
  const folder = new URL("../src/", import.meta.url);
  for (const name of readdirSync(folder)) {
    for (const [, from] of readFileSync(new URL(name, folder), "utf8").matchAll(/from "(.*)";/g))
      assert.ok(from.startsWith("./"), `${name} imports ${from}`);
  }
});
