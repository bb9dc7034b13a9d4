// Indirect light in a WebGPU program that has a G-buffer. host.js stands for the program: nothing in it is Halflight's.
// The address `?indirect=off` leaves the light out.

import { createHalflight, loadPlan } from "../../src/index.js";
import { openHost } from "./host.js";

async function start() {
  const host = await openHost(document.querySelector("canvas"));
  // Once: a plan that `evaluator export` wrote, and its player.
  const { plan, shaders } = await loadPlan(new URL("plan/", location.href));
  const gi = await createHalflight(host.device, plan, shaders);
  const isOn = !location.search.includes("indirect=off");

  const frame = (time) => {
    const encoder = host.device.createCommandEncoder();
    const { depth, normal, direct, albedo, camera } = host.drawGBuffer(encoder, time);
    // Every frame, between the G-buffer and the final image.
    gi.encode(encoder, { depth, normal, direct, albedo, camera });
    host.compose(encoder, isOn ? gi.indirect : host.black);
    host.device.queue.submit([encoder.finish()]);
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}

start().catch((error) => {
  document.getElementById("message").textContent = error.message;
});
