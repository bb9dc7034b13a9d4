// The camera of a frame, and what the frame before was seen from. Matrices are column by column, as in WGSL.

import { PlanError } from "./plan.js";

/** @typedef {ArrayLike<number>} Matrix */

const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/** The matrix a * b. @param {Matrix} a @param {Matrix} b */
export function multiply(a, b) {
  const product = new Array(16).fill(0);
  for (let column = 0; column < 4; column++)
    for (let row = 0; row < 4; row++)
      for (let k = 0; k < 4; k++) product[4 * column + row] += a[4 * k + row] * b[4 * column + k];
  return product;
}

/** The inverse of a matrix whose last row is 0, 0, 0, 1. @param {Matrix} m */
export function inverse(m) {
  const [a, b, c] = [0, 4, 8].map((i) => [m[i], m[i + 1], m[i + 2]]);
  const cross = (/** @type {number[]} */ u, /** @type {number[]} */ v) => [
    u[1] * v[2] - u[2] * v[1],
    u[2] * v[0] - u[0] * v[2],
    u[0] * v[1] - u[1] * v[0],
  ];
  const rows = [cross(b, c), cross(c, a), cross(a, b)];
  const determinant = a[0] * rows[0][0] + a[1] * rows[0][1] + a[2] * rows[0][2];
  const result = [...IDENTITY];
  for (let row = 0; row < 3; row++) {
    for (let column = 0; column < 3; column++) result[4 * column + row] = rows[row][column] / determinant;
    result[12 + row] = -(rows[row][0] * m[12] + rows[row][1] * m[13] + rows[row][2] * m[14]) / determinant;
  }
  return result;
}

/** Tangents of half the field of view of a perspective projection. @param {Matrix} projection */
const tangents = (projection) => [1 / projection[0], 1 / projection[5]];

/**
 * What shaders read of a camera.
 * @param {import("../halflight.js").Camera} camera
 */
export function readCamera(camera) {
  const list = (/** @type {any} */ numbers, /** @type {number} */ count, /** @type {string} */ name) => {
    if (numbers?.length !== count || !Array.from(numbers).every(Number.isFinite))
      throw new PlanError(`camera.${name} is not ${count} numbers.`);
    return Array.from(numbers, Math.fround);
  };
  const worldToView = list(camera?.worldToView, 16, "worldToView");
  const { tanHalfFov, projection } = camera;
  const tan = tanHalfFov ? list(tanHalfFov, 2, "tanHalfFov") : tangents(list(projection, 16, "projection"));
  const { near } = camera;
  if (!(near > 0)) throw new PlanError(`camera.near is ${near}: it must be above 0.`);
  const viewToWorld = inverse(worldToView);
  if (!viewToWorld.every(Number.isFinite)) throw new PlanError("camera.worldToView has no inverse.");
  return { worldToView, viewToWorld, tanHalfFov: tan, near, cut: camera.cut === true };
}

/** @typedef {ReturnType<typeof readCamera>} ReadCamera */

/** A camera that moves farther than this in a frame, in distances of the near plane, has been moved elsewhere. */
const FARTHEST = 5e4;

/** Whether an image of this camera may reproject one of the camera before: neither a cut nor a jump. */
export function continues(/** @type {ReadCamera} */ now, /** @type {ReadCamera} */ before) {
  const [eye, was] = [now, before].map((camera) => camera.viewToWorld.slice(12, 15));
  const [axis, axisBefore] = [now, before].map((camera) => camera.viewToWorld.slice(8, 11));
  const distance = Math.hypot(...eye.map((v, i) => v - was[i]));
  const cosine = axis.reduce((sum, v, i) => sum + v * axisBefore[i], 0);
  const halfFov = Math.atan(Math.max(...now.tanHalfFov));
  return !now.cut && distance <= FARTHEST * now.near && cosine >= Math.cos(halfFov);
}

const same = (/** @type {number[]} */ a, /** @type {number[]} */ b) => a.every((v, i) => v === b[i]);

/** Whether both cameras see the same. */
export const isStill = (/** @type {ReadCamera} */ now, /** @type {ReadCamera} */ before) =>
  same(now.worldToView, before.worldToView) && same(now.tanHalfFov, before.tanHalfFov);

/** View space of this frame to that of the frame before; exactly the identity if nothing moved. */
export const viewToPrevious = (/** @type {ReadCamera} */ now, /** @type {ReadCamera} */ before) =>
  same(now.worldToView, before.worldToView) ? [...IDENTITY] : multiply(before.worldToView, now.viewToWorld);
