// Plays exported samples in the page of a test: `play` is called by the test.

import { createHalflight, loadPlan } from "/package/src/index.js";

/** Opens a device; its errors end the test. */
async function openDevice(features) {
  const adapter = await navigator.gpu.requestAdapter();
  const offered = features.filter((feature) => adapter.features.has(feature));
  const device = await adapter.requestDevice({ requiredFeatures: offered });
  const errors = [];
  device.addEventListener("uncapturederror", ({ error }) => errors.push(error.message));
  return { device, errors, info: adapter.info };
}

const TEXEL = { r32float: 4, rgba8unorm: 4, "rgba8unorm-srgb": 4, rgba16float: 8, rgba32float: 16 };

async function upload(device, url, format, [width, height]) {
  const bytes = await (await fetch(url)).arrayBuffer();
  const usage = GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST;
  const texture = device.createTexture({ size: [width, height], format, usage });
  device.queue.writeTexture({ texture }, bytes, { bytesPerRow: width * TEXEL[format] }, [width, height]);
  return texture;
}

async function download(device, texture) {
  const row = texture.width * TEXEL[texture.format];
  const bytesPerRow = 256 * Math.ceil(row / 256);
  const usage = GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST;
  const buffer = device.createBuffer({ size: bytesPerRow * texture.height, usage });
  const encoder = device.createCommandEncoder();
  encoder.copyTextureToBuffer({ texture }, { buffer, bytesPerRow }, [texture.width, texture.height]);
  device.queue.submit([encoder.finish()]);
  await buffer.mapAsync(GPUMapMode.READ);
  const padded = new Uint8Array(buffer.getMappedRange());
  const packed = new Uint8Array(row * texture.height);
  for (let y = 0; y < texture.height; y++) packed.set(padded.subarray(y * bytesPerRow, y * bytesPerRow + row), y * row);
  buffer.destroy();
  let text = "";
  for (let i = 0; i < packed.length; i += 32768) text += String.fromCharCode(...packed.subarray(i, i + 32768));
  return { format: texture.format, base64: btoa(text) };
}

/**
 * Plays the plan of a folder on samples, one after another with one player, and returns the results of every frame. Each
 * sample may change settings before.
 */
window.play = async ({ plan: folder, samples, options = {}, features = ["timestamp-query"] }) => {
  const { device, errors, info } = await openDevice(features);
  const { plan, shaders } = await loadPlan(folder);
  const gi = await createHalflight(device, plan, shaders, options);
  const frames = [];
  let times = null;
  for (const { folder: data, settings } of samples) {
    const sample = await (await fetch(`${data}/sample.json`)).json();
    if (settings) gi.set(settings);
    for (const { number, camera, inputs } of sample.frames) {
      const input = ([name, file]) => upload(device, `${data}/${file}`, sample.formats[name], sample.size);
      const textures = await Promise.all(plan.inputs.map(({ name }) => input([name, inputs[name]])));
      const named = Object.fromEntries(plan.inputs.map(({ name }, i) => [name, textures[i]]));
      const encoder = device.createCommandEncoder();
      gi.encode(encoder, {
        ...named,
        camera: {
          worldToView: camera.world_to_view,
          tanHalfFov: camera.tan_half_fov,
          near: camera.near,
          cut: camera.cut,
        },
        unchanged: camera.unchanged,
        number,
      });
      device.queue.submit([encoder.finish()]);
      times = (await gi.times()) ?? times;
      const outputs = {};
      for (const [name, texture] of Object.entries(gi.outputs)) outputs[name] = await download(device, texture);
      frames.push(outputs);
      textures.forEach((texture) => texture.destroy());
    }
  }
  const { size, settings } = gi;
  gi.destroy();
  device.destroy();
  return { frames, errors, times, size, settings, adapter: `${info.vendor} ${info.architecture} ${info.description}` };
};
