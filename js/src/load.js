// Fetches an exported folder.

import { checkPlan, PlanError } from "./plan.js";

/**
 * Fetches plan.json and its shaders from a folder.
 * @param {string | URL} folder Address of the folder; a missing slash at its end is added.
 * @returns {Promise<import("../halflight.js").LoadedPlan>}
 */
export async function loadPlan(folder) {
  const base = new URL(String(folder).replace(/\/?$/, "/"), globalThis.location?.href);
  const get = async (/** @type {string} */ name) => {
    const address = new URL(name, base);
    const answer = await fetch(address);
    if (!answer.ok) throw new PlanError(`${address} cannot be fetched (${answer.status}): check the folder.`);
    return answer;
  };
  const plan = checkPlan(await (await get("plan.json")).json());
  const text = async (/** @type {string} */ name) => [name, await (await get(name)).text()];
  const names = [...new Set(plan.passes.map((pass) => pass.shader))];
  return { plan, shaders: Object.fromEntries(await Promise.all(names.map(text))) };
}
