// Plays plans that `evaluator export` writes, on a WebGPU device of the caller.
//
//     const { plan, shaders } = await loadPlan("plans/bitmask/");
//     const gi = await createHalflight(device, plan, shaders);
//     gi.encode(encoder, { depth, normal, direct, albedo, camera });
//     use(gi.indirect);
//
// The package knows no technique. Everything that it does is in plan.json.

export { createHalflight } from "./player.js";
export { loadPlan } from "./load.js";
export { checkPlan, PlanError } from "./plan.js";
