// Pipelines of passes.

import { PlanError } from "./plan.js";

/**
 * The pipeline of a pass.
 * @param {GPUDevice} device
 * @param {import("../halflight.js").Plan} plan
 * @param {import("../halflight.js").Pass} pass
 * @param {Record<string, string>} shaders
 */
export async function makePipeline(device, plan, pass, shaders) {
  const label = `halflight/${plan.technique}/${pass.name}`;
  const module = device.createShaderModule({ label, code: shaders[pass.shader] });
  const compute = { module, entryPoint: pass.entry, constants: pass.constants };
  try {
    return await device.createComputePipelineAsync({ label, layout: "auto", compute });
  } catch (error) {
    const { messages } = await module.getCompilationInfo();
    const first = messages.find((message) => message.type === "error");
    const where = first ? `${pass.shader}:${first.lineNum}: ${first.message}` : String(error);
    throw new PlanError(`The device refuses the pass ${pass.name} (${where}).`);
  }
}
