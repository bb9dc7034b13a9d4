// The part of measure.js that runs in the browser: both methods on the G-buffer of one frame, compared with the reference.

import { screenCoordinate, texture, vec4 } from "three/tsl";
import { EXRLoader } from "three/addons/loaders/EXRLoader.js";
import { GLTFExporter } from "three/addons/exporters/GLTFExporter.js";
import { denoise } from "three/addons/tsl/display/DenoiseNode.js";
import { ssgi } from "three/addons/tsl/display/SSGINode.js";
import { FloatType, HalfFloatType, NodeMaterial, QuadMesh, RenderTarget } from "three/webgpu";

import { openRenderer } from "./gbuffer.js";
import { makeScene } from "./scene.js";
import { ScreenLight } from "./screen-light.js";

/** The scene with its camera as glTF, in base64. */
async function exportScene(width, height) {
  const { scene, camera } = makeScene();
  camera.aspect = width / height;
  camera.lookAt(0, 1, 0);
  scene.add(camera);
  scene.updateMatrixWorld();
  const bytes = new Uint8Array(await new GLTFExporter().parseAsync(scene, { binary: true }));
  return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
}

/** Three numbers a pixel, rows from the top. */
function rgb(pixels, width, height, channels, flip) {
  const result = new Float32Array(3 * width * height);
  for (let y = 0; y < height; y++)
    for (let x = 0; x < width; x++)
      for (let c = 0; c < 3; c++)
        result[3 * (y * width + x) + c] = pixels[channels * ((flip ? height - 1 - y : y) * width + x) + c];
  return result;
}

async function reference(url) {
  const { image } = await new EXRLoader().setDataType(FloatType).loadAsync(url);
  const { data, width, height } = image;
  // The loader begins at the bottom.
  return rgb(data, width, height, data.length / (width * height), true);
}

/**
 * relMSE over means of blocks of 4 x 4 pixels, as in the tables of this project: (x - t)^2 / (t^2 + 0.01 m^2), where x and t are
 * means over the pixels of a block that count, and m is the mean of the reference.
 */
function blockRelMse(found, wanted, mask, width) {
  const columns = Math.ceil(width / 4);
  const blocks = new Map();
  let [sum, all] = [0, 0];
  found.forEach((value, i) => {
    if (!mask[i]) return;
    const pixel = Math.floor(i / 3);
    const key = 3 * (Math.floor(pixel / width / 4) * columns + Math.floor((pixel % width) / 4)) + (i % 3);
    const block = blocks.get(key) ?? { found: 0, wanted: 0, count: 0 };
    blocks.set(key, { found: block.found + value, wanted: block.wanted + wanted[i], count: block.count + 1 });
    sum += wanted[i];
    all += 1;
  });
  const floor = 0.01 * (sum / all) ** 2;
  let error = 0;
  for (const { found, wanted, count } of blocks.values()) {
    const [x, t] = [found / count, wanted / count];
    error += (count * (x - t) ** 2) / (t ** 2 + floor);
  }
  return error / all;
}

/**
 * relMSE over blocks, root of the mean square of the difference, mean of it, and the factor of the light that makes it least:
 * over the pixels that show a surface.
 */
function errors(all, reference, mask, width) {
  const [found, wanted] = [all, reference].map((one) => one.filter((_, i) => mask[i]));
  let [squares, sum, product, own] = [0, 0, 0, 0];
  found.forEach((value, i) => {
    squares += (value - wanted[i]) ** 2;
    sum += value - wanted[i];
    product += value * wanted[i];
    own += value * value;
  });
  const factor = own > 0 ? product / own : 1;
  const scaled = found.reduce((all, value, i) => all + (factor * value - wanted[i]) ** 2, 0);
  return {
    block: blockRelMse(all, reference, mask, width),
    rmse: Math.sqrt(squares / found.length),
    bias: sum / found.length,
    factor,
    scaled: Math.sqrt(scaled / found.length),
  };
}

/** A renderer, and each method as a node of its light and a function that computes it again. */
async function open({ width, height, plans, presets }) {
  const { scene, camera } = makeScene();
  const { renderer, target, nodes, drawGBuffer, resize } = await openRenderer();
  resize(camera, width, height);
  camera.lookAt(0, 1, 0);
  const { direct, normal, depth } = nodes;
  drawGBuffer(scene, camera);
  const methods = presets.map(({ name, settings, spatial }) => {
    const three = ssgi(direct, depth, normal, camera);
    three.useTemporalFiltering = false;
    for (const [key, value] of Object.entries(settings)) three[key].value = value;
    const light = spatial ? denoise(three.getGINode(), depth, normal, camera) : three.getGINode();
    return { name, light, compute: () => three.updateBefore({ renderer }), filters: spatial };
  });
  for (const { name, folder } of plans) {
    const plan = await ScreenLight.load(renderer, folder, target);
    plan.update(camera);
    const light = texture(plan.texture).load(screenCoordinate);
    methods.push({ name, light, compute: () => plan.update(camera), filters: false });
  }
  return { renderer, nodes, methods };
}

/** Draws a node to each pixel of a target. */
function drawer(renderer, results, node) {
  const quad = new QuadMesh(new NodeMaterial());
  quad.material.fragmentNode = vec4(node, 1);
  return () => {
    renderer.setRenderTarget(results);
    quad.render(renderer);
    renderer.setRenderTarget(null);
  };
}

/**
 * Errors of `albedo * indirect` of each method. `truth` are files of the final image with no bounce and with one; `images` are
 * methods that the evaluator ran, with files of the final image without indirect light and with it.
 */
async function measure({ truth, images, ...job }) {
  const { width, height } = job;
  const [unlit, lit] = await Promise.all(truth.map(reference));
  const wanted = lit.map((value, i) => value - unlit[i]);
  const { renderer, nodes, methods } = await open(job);
  const results = new RenderTarget(width, height, { type: FloatType, depthBuffer: false });
  const read = async (node) => {
    const draw = drawer(renderer, results, node);
    draw();
    // Materials are made in the first frame, and SSGINode renders before it.
    draw();
    return rgb(await renderer.readRenderTargetPixelsAsync(results, 0, 0, width, height), width, height, 4, false);
  };
  const { direct, albedo } = nodes;
  const reflecting = await read(albedo.rgb);
  const mask = reflecting.map((_, i) => Math.max(...reflecting.subarray(i - (i % 3), i - (i % 3) + 3)) > 0);
  const rows = [{ method: "direct light alone", ...errors(await read(direct.rgb.mul(0)), wanted, mask, width) }];
  for (const { name, light } of methods)
    rows.push({ method: name, ...errors(await read(albedo.rgb.mul(light.rgb)), wanted, mask, width) });
  for (const { name, files } of images) {
    const [without, all] = await Promise.all(files.map(reference));
    const light = all.map((value, i) => value - without[i]);
    rows.push({ method: name, ...errors(light, wanted, mask, width) });
  }
  const shown = wanted.filter((_, i) => mask[i]);
  const mean = shown.reduce((sum, value) => sum + value, 0) / shown.length;
  return { rows, mean, direct: errors(await read(direct.rgb), unlit, mask, width) };
}

/**
 * Milliseconds of each method from its commands to the end of their work on the device: `[least, median, most]` of `rounds`.
 * The methods take turns, so that a computer that slows down slows all of them.
 */
async function times({ rounds, ...job }) {
  const { renderer, methods } = await open(job);
  const results = new RenderTarget(job.width, job.height, { type: HalfFloatType, depthBuffer: false });
  const done = () => renderer.backend.device.queue.onSubmittedWorkDone();
  const all = methods.map(({ name, light, compute, filters }) => {
    const draw = drawer(renderer, results, light.rgb);
    draw();
    // DenoiseNode has no pass of its own: the material that reads it filters.
    return { method: name, runs: [], run: () => (compute(), filters && draw()) };
  });
  for (let round = 0; round <= rounds; round++)
    for (const { runs, run } of all) {
      await done();
      const start = performance.now();
      run();
      await done();
      // The first round makes what the others keep.
      if (round > 0) runs.push(performance.now() - start);
    }
  return all.map(({ method, runs }) => {
    runs.sort((a, b) => a - b);
    return { method, times: [runs[0], runs[runs.length >> 1], runs[runs.length - 1]] };
  });
}

window.exportScene = exportScene;
window.measure = measure;
window.times = times;
