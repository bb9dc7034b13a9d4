// A renderer of three.js that draws a G-buffer in one pass: the light of its own materials, normals, albedo and depth.

import {
  DepthTexture,
  FloatType,
  HalfFloatType,
  NearestFilter,
  RedFormat,
  RenderTarget,
  UnsignedByteType,
  WebGPURenderer,
} from "three/webgpu";
import { diffuseColor, mrt, normalView, output, positionView, texture, vec4 } from "three/tsl";

export async function openRenderer() {
  const renderer = new WebGPURenderer({ antialias: false });
  await renderer.init();
  if (!renderer.backend.isWebGPUBackend) throw new Error("This browser has no WebGPU.");
  renderer.shadowMap.enabled = true;

  const target = new RenderTarget(1, 1, { count: 4, minFilter: NearestFilter, magFilter: NearestFilter });
  const kinds = { output: HalfFloatType, normal: HalfFloatType, albedo: UnsignedByteType, viewDepth: FloatType };
  Object.entries(kinds).forEach(([name, type], i) => Object.assign(target.textures[i], { name, type }));
  // Planar view depth, 0 where there is no surface: targets are cleared to 0.
  target.textures[3].format = RedFormat;
  target.depthTexture = new DepthTexture(1, 1);
  const gbuffer = mrt({ output, normal: normalView, albedo: diffuseColor, viewDepth: vec4(positionView.z.negate()) });

  const [direct, normal, albedo] = target.textures.map((one) => texture(one));
  return {
    renderer,
    target,
    nodes: { direct, normal, albedo, depth: texture(target.depthTexture) },
    drawGBuffer(scene, camera) {
      renderer.setMRT(gbuffer);
      renderer.setRenderTarget(target);
      renderer.render(scene, camera);
      renderer.setMRT(null);
      renderer.setRenderTarget(null);
    },
    resize(camera, width, height) {
      renderer.setSize(width, height);
      target.setSize(width, height);
      camera.aspect = width / height;
      camera.updateProjectionMatrix();
    },
  };
}
