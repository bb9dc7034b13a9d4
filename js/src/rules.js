// Numbers of a plan as functions of the display's size and of settings.

/**
 * A number of texels or workgroups.
 * @param {import("../halflight.js").Side} side
 * @param {readonly number[]} size Width and height of the display, pixels.
 */
export function sideAt(side, [width, height]) {
  if ("fixed" in side) return side.fixed;
  const pixels = side.of === "width" ? width : height;
  return side.times * Math.ceil((Math.ceil(pixels / side.divide) + side.plus) / side.per);
}

/** @param {import("../halflight.js").Squares} rule @param {readonly number[]} size */
function squaresAt(rule, size) {
  const [width, height] = size.map((side) => Math.ceil(side / rule.divide));
  return Math.max(rule.times_squares * (width * width + height * height), rule.least);
}

/**
 * The numbers of a field that the plan gives.
 * @param {import("../halflight.js").PlanField} field
 * @param {import("../halflight.js").Plan} plan
 * @param {readonly number[]} size Width and height of the display, pixels.
 * @param {ReadonlyMap<string, number>} changed Settings that are not as exported.
 * @returns {number[]}
 */
export function fieldAt(field, plan, size, changed) {
  const rule = field.by_setting;
  const setting = rule && changed.get(rule.setting);
  if (rule && setting !== undefined) {
    if (setting === 0 && rule.at_zero !== undefined)
      return [typeof rule.at_zero === "number" ? rule.at_zero : squaresAt(rule.at_zero, size)];
    // Shaders read float32.
    const v = Math.fround(setting);
    if ("power" in rule) return [rule.power.times * v ** rule.power.power];
    return [v > 0 ? Math.ceil(Math.log(rule.frames_until) / Math.log(v)) : 0];
  }
  const [width, height] = plan.display.exported;
  if (field.by_size && (size[0] !== width || size[1] !== height)) return [squaresAt(field.by_size, size)];
  return [field.value].flat();
}

/**
 * Divides a grid of workgroups into rectangles that do at most `most` work each, but have one workgroup at least. Some
 * watchdogs end programs whose dispatch takes seconds.
 * @param {readonly number[]} workgroups Workgroups along x and y.
 * @param {number} work Work of one workgroup.
 * @param {number} most
 * @returns {{ first: [number, number], count: [number, number] }[]}
 */
export function divide([width, height], work, most) {
  const pieces = (/** @type {number} */ count, /** @type {number} */ longest) => {
    const each = Math.max(1, Math.ceil(count / Math.max(1, Math.ceil(count / Math.max(1, longest)))));
    const found = [];
    for (let first = 0; first < count; first += each) found.push([first, Math.min(each, count - first)]);
    return found;
  };
  const atOnce = Math.floor(most / Math.max(1, work));
  const rows = Math.floor(atOnce / width);
  const down = pieces(height, rows);
  const across = pieces(width, rows === 0 ? atOnce : width);
  return down.flatMap(([y, h]) =>
    across.map(([x, w]) => ({
      first: /** @type {[number, number]} */ ([x, y]),
      count: /** @type {[number, number]} */ ([w, h]),
    })),
  );
}
