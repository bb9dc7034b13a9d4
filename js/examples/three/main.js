// three.js draws a G-buffer once. SSGINode lights it left of the middle, Halflight right of it.

import { screenUV, texture, screenCoordinate, vec4 } from "three/tsl";
import { denoise } from "three/addons/tsl/display/DenoiseNode.js";
import { ssgi } from "three/addons/tsl/display/SSGINode.js";
import { NodeMaterial, QuadMesh } from "three/webgpu";

import { openRenderer } from "./gbuffer.js";
import { makeScene } from "./scene.js";
import { ScreenLight } from "./screen-light.js";

async function start() {
  const { scene, camera } = makeScene();
  const { renderer, target, nodes, drawGBuffer, resize } = await openRenderer();
  document.body.append(renderer.domElement);

  const light = await ScreenLight.load(renderer, new URL("plan/", location.href), target);
  const { direct, normal, albedo, depth } = nodes;
  const three = ssgi(direct, depth, normal, camera);
  // One frame at a time, as the plan of the example.
  three.useTemporalFiltering = false;
  const theirs = denoise(three.getGINode(), depth, normal, camera);
  const ours = texture(light.texture).load(screenCoordinate);

  const quad = new QuadMesh(new NodeMaterial());
  const indirect = screenUV.x.lessThan(0.5).select(theirs.rgb, ours.rgb);
  quad.material.colorNode = vec4(direct.rgb.add(albedo.rgb.mul(indirect)), 1);

  const fit = () => resize(camera, innerWidth, innerHeight);
  addEventListener("resize", fit);
  fit();

  window.example = { frames: 0 };
  renderer.setAnimationLoop((time) => {
    camera.position.x = 0.2 * Math.sin(time / 3000);
    camera.lookAt(0, 1, 0);
    drawGBuffer(scene, camera);
    // three.js has submitted its commands: those of the player run after them.
    light.update(camera);
    quad.render(renderer);
    window.example.frames++;
  });
}

start().catch((error) => {
  document.getElementById("message").textContent = error.message;
});
