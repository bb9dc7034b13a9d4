// Uniform blocks as bytes.

import { fieldAt } from "./rules.js";

/**
 * The bytes of a block.
 * @param {import("../halflight.js").Block} block
 * @param {import("../halflight.js").Plan} plan
 * @param {readonly number[]} size Width and height of the display, pixels.
 * @param {ReadonlyMap<string, number>} changed Settings that are not as exported.
 * @param {Record<string, readonly number[]>} frame Values by the name that `from` gives them.
 */
export function pack(block, plan, size, changed, frame) {
  const bytes = new DataView(new ArrayBuffer(16 * Math.ceil(block.size / 16)));
  for (const field of block.fields) {
    const numbers = "from" in field ? frame[field.from] : fieldAt(field, plan, size, changed);
    numbers.forEach((number, i) => {
      const at = field.offset + 4 * i;
      if (field.type.endsWith("f") || field.type === "f32") bytes.setFloat32(at, number, true);
      else if (field.type === "i32") bytes.setInt32(at, number, true);
      else bytes.setUint32(at, number, true);
    });
  }
  return bytes.buffer;
}

/** Whether a block has a value that begins with one of these words. @param {import("../halflight.js").Block} block */
export const takes = (block, /** @type {string[]} */ words) =>
  block.fields.some((field) => "from" in field && words.includes(field.from.split(".")[0]));
