// Plays a plan on a device.

import { continues, isStill, readCamera, viewToPrevious } from "./camera.js";
import { makePipeline } from "./pipeline.js";
import { checkPlan, PlanError } from "./plan.js";
import { divide, sideAt } from "./rules.js";
import { Timer } from "./timer.js";
import { pack, takes } from "./uniforms.js";

/** @typedef {import("../halflight.js").Plan} Plan */
/** @typedef {import("../halflight.js").Pass} Pass */
/** @typedef {import("../halflight.js").Frame} Frame */
/** @typedef {{ first: [number, number], count: [number, number] }} Part */
/** @typedef {{ index: number, ofParts: GPUBindGroup[] }[]} Groups */

/** Work of one dispatch, in fetches of a texel: an eighth of what watchdogs allow on a slow GPU. */
const WORK_AT_ONCE = 2 ** 29;
/** Bytes between uniform blocks of one buffer: an alignment that every device allows. */
const STRIDE = 256;
/** Sets of input textures whose bind groups are kept, for engines that alternate between targets. */
const KEPT_GROUPS = 4;

const USAGES = /** @type {const} */ ({
  "texture-binding": "TEXTURE_BINDING",
  "storage-binding": "STORAGE_BINDING",
  "copy-src": "COPY_SRC",
});

/**
 * Creates a player of a plan.
 * @param {GPUDevice} device
 * @param {any} plan What plan.json holds.
 * @param {Record<string, string>} shaders Text of each shader file.
 * @param {import("../halflight.js").Options} [options]
 */
export async function createHalflight(device, plan, shaders, options = {}) {
  const checked = checkPlan(plan);
  for (const { shader } of checked.passes) {
    if (typeof shaders?.[shader] !== "string") throw new PlanError(`The text of the shader ${shader} is missing.`);
  }
  const pipelines = await Promise.all(checked.passes.map((pass) => makePipeline(device, checked, pass, shaders)));
  return new Halflight(device, checked, pipelines, options);
}

class Halflight {
  #device;
  #plan;
  #pipelines;
  #label;
  #workAtOnce;
  #seed;
  #timer;
  /** @type {number[]} Width and height of the display; zeros before the first frame. */
  #size = [0, 0];
  /** @type {Map<string, GPUTexture>} */
  #textures = new Map();
  /** @type {Map<string, GPUBuffer>} */
  #blocks = new Map();
  /** @type {Part[][]} Dispatches of each pass. */
  #parts = [];
  /** @type {Map<string, Groups[]>} Bind groups of all passes, by the input textures and the parity. */
  #groups = new Map();
  /** @type {WeakMap<GPUTexture, number>} */
  #numbers = new WeakMap();
  #nextNumber = 0;
  /** @type {Map<string, GPUSampler>} */
  #samplers = new Map();
  /** @type {Map<string, number>} Settings that are not as exported. */
  #changed = new Map();
  #stale = true;
  #parity = 0;
  #frame = 0;
  #still = 0;
  /** @type {import("./camera.js").ReadCamera | undefined} The camera of the last frame, if its histories may be used. */
  #before;

  /** @param {GPUDevice} device @param {Plan} plan @param {GPUComputePipeline[]} pipelines @param {import("../halflight.js").Options} options */
  constructor(device, plan, pipelines, options) {
    this.#device = device;
    this.#plan = plan;
    this.#pipelines = pipelines;
    this.#label = options.label ?? `halflight/${plan.technique}`;
    this.#workAtOnce = options.workAtOnce ?? WORK_AT_ONCE;
    this.#seed = options.seed ?? 0;
    this.#timer = options.timestamps === false ? undefined : Timer.of(device, plan.passes.length);
    for (const block of plan.uniforms) {
      if (!takes(block, ["dispatch"])) this.#blocks.set(block.name, this.#uniformBuffer(block.name, block.size));
    }
    if (options.settings) this.set(options.settings);
  }

  /** The plan. */
  get plan() {
    return this.#plan;
  }

  /** Width and height of the display, pixels; zeros before the first frame. */
  get size() {
    return [...this.#size];
  }

  /** Results of the last frame by name. A history is another texture after every frame. */
  get outputs() {
    /** @type {Record<string, GPUTexture>} */
    const found = {};
    for (const { name, texture } of this.#plan.outputs) {
      const made = this.#textures.get(this.#resolved(texture));
      if (made) found[name] = made;
    }
    return found;
  }

  /** Indirect light of the last frame; undefined before it, or if the plan finds none. */
  get indirect() {
    return this.outputs.indirect;
  }

  /** Values of all settings. */
  get settings() {
    const entries = this.#plan.settings.map(({ name, value }) => [name, this.#changed.get(name) ?? value]);
    return Object.fromEntries(entries);
  }

  /** Changes live settings. The next frame uses them. @param {Record<string, number>} settings */
  set(settings) {
    const next = new Map(this.#changed);
    for (const [name, value] of Object.entries(settings)) {
      const setting = this.#plan.settings.find((one) => one.name === name);
      if (!setting) {
        const live = this.#plan.settings.filter((one) => one.change === "live").map((one) => one.name);
        throw new PlanError(`${name} is no setting of ${this.#plan.technique}: live are ${live.join(", ") || "none"}.`);
      }
      if (value === setting.value) {
        next.delete(name);
        continue;
      }
      if (setting.change === "none") throw new PlanError(`${name} changes nothing in this plan.`);
      const { range } = setting;
      if (setting.change !== "live" || !range) {
        throw new PlanError(`${name} changes passes or shaders: export the plan again with --set ${name}=${value}.`);
      }
      const inside = range.above ? value > range.at_least : value >= range.at_least;
      if (!Number.isFinite(value) || !inside || value > range.at_most || (range.whole && !Number.isInteger(value))) {
        const from = `${range.above ? "more than" : "from"} ${range.at_least} to ${range.at_most}`;
        throw new PlanError(`${name} = ${value} is out of range: give ${range.whole ? "a whole number " : ""}${from}.`);
      }
      next.set(name, value);
    }
    this.#changed = next;
    this.#stale = true;
  }

  /** Forgets the frames before: the next one starts as after a cut. */
  reset() {
    this.#before = undefined;
  }

  /** Makes the textures for a display of this size, pixels. `encode` does it where the size of the inputs has changed. */
  resize(/** @type {number} */ width, /** @type {number} */ height) {
    if (width === this.#size[0] && height === this.#size[1]) return;
    const { exported, valid, reason } = this.#plan.display;
    if (valid === "exported" && (width !== exported[0] || height !== exported[1])) {
      throw new PlanError(
        `The plan is valid for ${exported.join("x")} alone, not for ${width}x${height}: export it again. ${reason ?? ""}`,
      );
    }
    const most = this.#device.limits.maxTextureDimension2D;
    if (width > most || height > most) {
      throw new PlanError(
        `${width}x${height} is too large: textures of this device have at most ${most} texels a side.`,
      );
    }
    this.#free();
    this.#size = [width, height];
    for (const texture of this.#plan.textures) {
      const usage = texture.usage.reduce((all, name) => all | GPUTextureUsage[USAGES[name]], 0);
      const [w, h] = texture.size.map((side) => sideAt(side, this.#size));
      const label = `${this.#label}/${texture.name}`;
      const size = { width: w, height: h, depthOrArrayLayers: texture.layers };
      this.#textures.set(texture.name, this.#device.createTexture({ label, size, format: texture.format, usage }));
    }
    this.#parts = this.#plan.passes.map((pass) => this.#divided(pass));
    this.#stale = true;
    this.#before = undefined;
  }

  /**
   * Records the passes of a frame. Submit it before you encode the next one: uniform blocks are written at once.
   * @param {GPUCommandEncoder} encoder
   * @param {Frame} frame
   */
  encode(encoder, frame) {
    const inputs = this.#inputs(frame);
    const camera = readCamera(frame.camera);
    this.#begin(camera, frame);
    const groups = this.#groupsOf(inputs);
    encoder.pushDebugGroup(this.#label);
    this.#plan.passes.forEach((pass, i) => {
      const timestampWrites = this.#timer?.writes(i);
      const recording = encoder.beginComputePass({
        label: `${this.#label}/${pass.name}`,
        ...(timestampWrites ? { timestampWrites } : {}),
      });
      recording.setPipeline(this.#pipelines[i]);
      this.#parts[i].forEach(({ count }, part) => {
        for (const { index, ofParts } of groups[i]) {
          // Groups that all dispatches share are set once.
          if (part === 0 || ofParts.length > 1) recording.setBindGroup(index, ofParts[part] ?? ofParts[0]);
        }
        recording.dispatchWorkgroups(...count);
      });
      recording.end();
    });
    this.#timer?.resolve(encoder);
    encoder.popDebugGroup();
  }

  /**
   * Times of the passes of the last submitted frame, milliseconds; null if the device has no timestamps or no frame was
   * submitted since the last call.
   */
  async times() {
    const times = await this.#timer?.read();
    return times ? times.map((milliseconds, i) => ({ name: this.#plan.passes[i].name, milliseconds })) : null;
  }

  /** Frees everything. */
  destroy() {
    this.#free();
    this.#size = [0, 0];
    for (const buffer of this.#blocks.values()) buffer.destroy();
    this.#timer?.destroy();
  }

  #free() {
    for (const texture of this.#textures.values()) texture.destroy();
    this.#textures.clear();
    this.#groups.clear();
    this.#dropped.forEach((buffer) => buffer.destroy());
    this.#dropped = [];
  }

  /** @type {GPUBuffer[]} Buffers of divided dispatches. */
  #dropped = [];

  /** @returns {GPUBuffer} */
  #uniformBuffer(/** @type {string} */ name, /** @type {number} */ size) {
    const label = `${this.#label}/${name}`;
    const usage = GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST;
    return this.#device.createBuffer({ label, size: 16 * Math.ceil(size / 16), usage });
  }

  /** The input textures of a frame, checked. @param {Frame} frame @returns {Map<string, GPUTexture>} */
  #inputs(frame) {
    /** @type {Map<string, GPUTexture>} */
    const found = new Map();
    for (const { name, doc } of this.#plan.inputs) {
      const texture = /** @type {any} */ (frame)?.[name];
      if (typeof texture?.createView !== "function") throw new PlanError(`encode: ${name} is no GPUTexture. ${doc}`);
      found.set(name, texture);
    }
    const [first, ...others] = found.entries();
    if (!first) return found;
    const [width, height] = [first[1].width, first[1].height];
    for (const [name, texture] of others) {
      if (texture.width !== width || texture.height !== height)
        throw new PlanError(
          `encode: ${name} is ${texture.width}x${texture.height}, ${first[0]} is ${width}x${height}.`,
        );
    }
    this.resize(width, height);
    return found;
  }

  /** Writes the uniform blocks of a frame. */
  #begin(/** @type {import("./camera.js").ReadCamera} */ camera, /** @type {Frame} */ { number, unchanged }) {
    if (number !== undefined && !(Number.isInteger(number) && number >= 0))
      throw new PlanError(`encode: number is ${number}: it must be a whole number from 0.`);
    const isNext = number === undefined || number >>> 0 === this.#frame;
    const before = this.#before && isNext && continues(camera, this.#before) ? this.#before : undefined;
    this.#frame = (number ?? this.#frame) >>> 0;
    this.#still = before && unchanged === true && isStill(camera, before) ? this.#still + 1 : 0;
    const from = before ?? camera;
    const values = {
      "camera.world_to_view": camera.worldToView,
      "camera.view_to_world": camera.viewToWorld,
      "camera.tan_half_fov": camera.tanHalfFov,
      "camera.near": [camera.near],
      "display.size": this.#size,
      "frame.number": [this.#frame],
      "frame.seed": [this.#seed],
      "frame.unchanged": [this.#still],
      "previous.view_to_previous": viewToPrevious(camera, from),
      "previous.tan_half_fov": from.tanHalfFov,
      "previous.valid": [before ? 1 : 0],
    };
    for (const block of this.#plan.uniforms) {
      const buffer = this.#blocks.get(block.name);
      if (buffer && (this.#stale || takes(block, ["camera", "frame", "previous"])))
        this.#device.queue.writeBuffer(buffer, 0, pack(block, this.#plan, this.#size, this.#changed, values));
    }
    this.#stale = false;
    this.#before = camera;
    this.#frame = (this.#frame + 1) >>> 0;
    this.#parity = 1 - this.#parity;
  }

  /** The dispatches of a pass. One that does not say where it begins cannot be divided. @param {Pass} pass */
  #divided(pass) {
    const workgroups = pass.workgroups.map((side) => sideAt(side, this.#size));
    const work = pass.work * pass.workgroup_size.reduce((all, side) => all * side, 1);
    const blocks = pass.bindings.map((one) => (one.kind === "uniform" ? this.#block(one.block) : undefined));
    const divides = blocks.some((block) => block && takes(block, ["dispatch"]));
    return divide(workgroups, work, divides ? this.#workAtOnce : Infinity);
  }

  #block(/** @type {string} */ name) {
    return this.#plan.uniforms.find((block) => block.name === name);
  }

  /** The texture that a name stands for in this frame: the two of a history swap roles. */
  #resolved(/** @type {string} */ name) {
    if (this.#parity === 0) return name;
    const pair = this.#plan.histories.find(({ now, before }) => name === now || name === before);
    return pair ? (pair.now === name ? pair.before : pair.now) : name;
  }

  /** Bind groups of all passes. @param {Map<string, GPUTexture>} inputs @returns {Groups[]} */
  #groupsOf(inputs) {
    const number = (/** @type {GPUTexture} */ texture) => {
      const known = this.#numbers.get(texture) ?? ++this.#nextNumber;
      this.#numbers.set(texture, known);
      return known;
    };
    const parity = this.#plan.histories.length > 0 ? this.#parity : 0;
    const key = [parity, ...[...inputs.values()].map(number)].join();
    const known = this.#groups.get(key);
    if (known) return known;
    const made = this.#plan.passes.map((pass, i) => this.#makeGroups(pass, i, inputs));
    if (this.#groups.size >= 2 * KEPT_GROUPS) this.#groups.delete([...this.#groups.keys()][0]);
    this.#groups.set(key, made);
    return made;
  }

  /** @param {Pass} pass @param {number} i @param {Map<string, GPUTexture>} inputs @returns {Groups} */
  #makeGroups(pass, i, inputs) {
    const indices = [...new Set(pass.bindings.map((one) => one.group))].sort();
    return indices.map((index) => {
      const bindings = pass.bindings.filter((one) => one.group === index);
      const layout = this.#pipelines[i].getBindGroupLayout(index);
      const label = `${this.#label}/${pass.name}`;
      const divided = bindings.some((one) => one.kind === "uniform" && !this.#blocks.has(one.block));
      const parts = divided ? this.#parts[i] : [undefined];
      const places = divided ? this.#dispatchBuffer(pass, bindings, this.#parts[i]) : undefined;
      const ofParts = parts.map((_, part) => {
        const entries = bindings.map((one) => ({
          binding: one.index,
          resource: this.#resource(one, inputs, places, part),
        }));
        return this.#device.createBindGroup({ label, layout, entries });
      });
      return { index, ofParts };
    });
  }

  /** A buffer with the block of each dispatch. @param {Pass} pass @param {import("../halflight.js").Binding[]} bindings @param {Part[]} parts */
  #dispatchBuffer(pass, bindings, parts) {
    const buffer = this.#uniformBuffer(`${pass.name} dispatches`, STRIDE * parts.length);
    this.#dropped.push(buffer);
    const own = bindings.find((one) => one.kind === "uniform" && !this.#blocks.has(one.block));
    const block = own?.kind === "uniform" ? this.#block(own.block) : undefined;
    parts.forEach(({ first }, part) => {
      const invocation = first.map((v, axis) => v * pass.workgroup_size[axis]);
      const values = { "dispatch.workgroup": first, "dispatch.invocation": invocation };
      if (block)
        this.#device.queue.writeBuffer(
          buffer,
          part * STRIDE,
          pack(block, this.#plan, this.#size, this.#changed, values),
        );
    });
    return buffer;
  }

  /**
   * @param {import("../halflight.js").Binding} one
   * @param {Map<string, GPUTexture>} inputs
   * @param {GPUBuffer | undefined} places
   * @param {number} part
   * @returns {GPUBindingResource}
   */
  #resource(one, inputs, places, part) {
    const missing = (/** @type {string} */ name) => new PlanError(`${name} is missing.`);
    switch (one.kind) {
      case "uniform": {
        const buffer = this.#blocks.get(one.block);
        if (buffer) return { buffer };
        if (!places) throw missing(one.block);
        return { buffer: places, offset: part * STRIDE, size: this.#block(one.block)?.size ?? 16 };
      }
      case "sampler": {
        const known = this.#samplers.get(one.filter);
        if (known) return known;
        const sampler = this.#device.createSampler({ magFilter: one.filter, minFilter: one.filter });
        this.#samplers.set(one.filter, sampler);
        return sampler;
      }
      default: {
        const texture = inputs.get(one.texture) ?? this.#textures.get(this.#resolved(one.texture));
        if (!texture) throw missing(one.texture);
        return texture.createView({ dimension: one.kind === "texture" ? one.dimension : "2d" });
      }
    }
  }
}
