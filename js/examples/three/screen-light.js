// A Halflight plan on the G-buffer of three.js.

import { createHalflight, loadPlan } from "halflight";
import { ExternalTexture, FloatType, HalfFloatType, NearestFilter } from "three/webgpu";

/** Indirect light of a render target with the textures `output`, `normal`, `albedo` and `viewDepth`. */
export class ScreenLight {
  #renderer;
  #player;
  #target;
  /** Indirect light, as a texture of three.js. */
  texture = new ExternalTexture();

  /** Loads a plan for a renderer, after its `init`. */
  static async load(renderer, folder, target) {
    const { plan, shaders } = await loadPlan(folder);
    return new ScreenLight(renderer, await createHalflight(renderer.backend.device, plan, shaders), target);
  }

  constructor(renderer, player, target) {
    this.#renderer = renderer;
    this.#player = player;
    this.#target = target;
    const { texture } = player.plan.outputs.find(({ name }) => name === "indirect");
    const { format } = player.plan.textures.find(({ name }) => name === texture);
    // Without filtering, as shaders load single texels.
    this.texture.type = format === "rgba16float" ? HalfFloatType : FloatType;
    this.texture.minFilter = this.texture.magFilter = NearestFilter;
    this.texture.generateMipmaps = false;
  }

  /** Computes the light of the frame that the target holds. */
  update(camera) {
    const { backend } = this.#renderer;
    const named = (name) => backend.get(this.#target.textures.find((one) => one.name === name)).texture;
    const encoder = backend.device.createCommandEncoder({ label: "halflight" });
    this.#player.encode(encoder, {
      depth: named("viewDepth"),
      normal: named("normal"),
      direct: named("output"),
      albedo: named("albedo"),
      camera: {
        worldToView: camera.matrixWorldInverse.elements,
        projection: camera.projectionMatrix.elements,
        near: camera.near,
      },
    });
    backend.device.queue.submit([encoder.finish()]);
    if (this.texture.sourceTexture !== this.#player.indirect) {
      this.texture.sourceTexture = this.#player.indirect;
      this.texture.image = { width: this.#player.indirect.width, height: this.#player.indirect.height };
      this.texture.needsUpdate = true;
    }
  }
}
