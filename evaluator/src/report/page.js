"use strict";
const all = (selector, root = document) => [...root.querySelectorAll(selector)];
const make = (name, properties) => Object.assign(document.createElement(name), properties);

// One of several buttons is pressed.
function press(button) {
  for (const other of all("button", button.parentElement)) other.setAttribute("aria-pressed", other === button);
}

// Tables: a click on a head sorts by its column, first upwards, then downwards; empty cells stay last.
for (const head of all("th button")) {
  head.addEventListener("click", () => {
    const cell = head.closest("th"), table = head.closest("table"), column = cell.cellIndex;
    const down = cell.getAttribute("aria-sort") === "ascending";
    for (const other of all("th", table)) other.removeAttribute("aria-sort");
    cell.setAttribute("aria-sort", down ? "descending" : "ascending");
    const numeric = cell.classList.contains("number");
    if (table.sortLong) { table.sortLong(column, down); return; }
    const key = row => {
      const { dataset, textContent } = row.cells[column];
      if (!numeric) return textContent;
      const value = dataset.value ?? textContent;
      return value === "" ? NaN : Number(value.replace("inf", "Infinity"));
    };
    const compare = (a, b) => {
      if (!numeric) return a.localeCompare(b);
      if (Number.isNaN(a) || Number.isNaN(b)) return (Number.isNaN(a) - Number.isNaN(b)) * (down ? -1 : 1);
      return a < b ? -1 : a > b ? 1 : 0;
    };
    const rows = [...table.tBodies[0].rows].map(row => [key(row), row]);
    rows.sort(([a], [b]) => compare(a, b) * (down ? -1 : 1));
    table.tBodies[0].append(...rows.map(([, row]) => row));
  });
}

// Long tables: only the rows in view are elements. Filters and sorting work on the data.
const compared = { "=": (a, b) => a === b, "<": (a, b) => a < b, ">": (a, b) => a > b, "<=": (a, b) => a <= b, ">=": (a, b) => a >= b };
function longTable(root) {
  const script = root.querySelector("script"), frame = root.querySelector(".window"), table = root.querySelector("table");
  const { columns, rows } = JSON.parse(script.textContent);
  script.remove();
  const text = (column, row) => column.of ? column.texts[column.of[row]] : column.texts[row];
  const value = (column, row) => {
    const found = column.values ? column.values[row] : text(column, row);
    return found === null || found === "" ? NaN : Number(found);
  };
  const best = columns.map(column => new Set(column.best));
  const body = table.tBodies[0];
  let order = rows.map((_, index) => index), sorted = order, height = 0, drawn = "";

  const line = row => {
    const element = make("tr", {});
    if (rows[row] !== null) element.dataset.row = rows[row];
    element.classList.toggle("selected", rows[row] === root.closest(".group")?.selectedRow);
    columns.forEach((column, index) => {
      const cell = make("td", {});
      const shown = text(column, row);
      cell.append(column.code && shown ? make("code", { textContent: shown }) : shown);
      if (column.number) cell.classList.add("number");
      if (best[index].has(row)) cell.classList.add("best");
      element.append(cell);
    });
    return element;
  };
  // A row of the longest texts keeps the widths while others scroll by.
  const widest = make("tr", { className: "widest" });
  widest.append(...columns.map(column =>
    make("td", { textContent: column.texts.reduce((a, b) => b.length > a.length ? b : a, "") })));
  const space = rowsOf => {
    const element = make("tr", { className: "space" }), cell = make("td", { colSpan: columns.length });
    cell.style.height = `${rowsOf * height}px`;
    element.append(cell);
    return element;
  };
  const draw = again => {
    if (height === 0) {
      body.replaceChildren(widest, line(0));
      height = body.lastChild.getBoundingClientRect().height;
      // Not in view yet: measured when it is.
      if (height === 0) return;
    }
    const shown = Math.ceil(frame.clientHeight / height) + 20;
    const from = Math.max(0, Math.min(Math.floor(frame.scrollTop / height) - 10, order.length - shown));
    const range = `${from} ${shown}`;
    if (!again && range === drawn) return;
    drawn = range;
    const part = order.slice(from, from + shown);
    body.replaceChildren(widest, space(from), ...part.map(line), space(order.length - from - part.length));
  };
  table.sortLong = (index, down) => {
    const column = columns[index], sign = down ? -1 : 1;
    const keys = rows.map((_, row) => column.number ? value(column, row) : text(column, row));
    const compare = column.number
      ? (a, b) => Number.isNaN(keys[a]) || Number.isNaN(keys[b]) ? Number.isNaN(keys[a]) - Number.isNaN(keys[b]) : (keys[a] - keys[b]) * sign
      : (a, b) => (keys[a] < keys[b] ? -1 : keys[a] > keys[b] ? 1 : 0) * sign;
    sorted = rows.map((_, row) => row).sort((a, b) => compare(a, b) || a - b);
    filter();
  };
  const plain = name => name.toLowerCase().replaceAll(" ", "_");
  const holds = word => {
    const parts = /^(.+?)(<=|>=|=|<|>)(.*)$/.exec(word);
    const column = parts && columns.find(column => plain(column.name) === plain(parts[1]) || plain(column.name).endsWith(`.${plain(parts[1])}`));
    if (!column) return row => columns.some(column => !column.number && text(column, row).toLowerCase().includes(word));
    const compare = compared[parts[2]], wanted = Number(parts[3]);
    if (!column.number || parts[3] === "" || Number.isNaN(wanted)) return row => compare(text(column, row).toLowerCase(), parts[3]);
    // As printed, or as it is.
    return row => compare(value(column, row), wanted) || parts[2] === "=" && Number(text(column, row)) === wanted;
  };
  const input = root.querySelector("input"), count = root.querySelector(".count");
  const filter = () => {
    const tests = input.value.trim().toLowerCase().split(/\s+/).filter(Boolean).map(holds);
    order = sorted.filter(row => tests.every(test => test(row)));
    const [some, all] = [order.length, rows.length].map(number => number.toLocaleString("en"));
    count.textContent = order.length === rows.length ? `${all} rows` : `${some} of ${all} rows`;
    frame.scrollTop = 0;
    draw(true);
  };
  input.addEventListener("input", filter);
  frame.addEventListener("scroll", () => draw(false), { passive: true });
  new ResizeObserver(() => draw(false)).observe(frame);
  root.redraw = () => draw(true);
  draw(true);
}
// After the page is shown for the first time: the data of ten thousand rows takes a moment.
requestAnimationFrame(() => setTimeout(() => all(".long").forEach(longTable)));

// Measures: one choice for every place that offers it; labels of points on hover.
for (const button of all(".choices .segmented button")) {
  button.addEventListener("click", () => {
    for (const choices of all(".choices")) {
      const same = all(".segmented button", choices).find(other => other.textContent === button.textContent);
      if (!same) continue;
      press(same);
      for (const panel of all(".choice", choices)) panel.hidden = panel.dataset.choice !== button.textContent;
    }
  });
}
const tip = document.getElementById("tip");
for (const point of all(".point")) {
  const title = point.querySelector("title");
  const text = title.textContent;
  title.remove();
  point.setAttribute("aria-label", text);
  if (point.dataset.row !== undefined) point.setAttribute("tabindex", "0");
  const show = () => {
    tip.textContent = text;
    tip.hidden = false;
    const box = point.getBoundingClientRect();
    const left = Math.min(box.left + box.width / 2 + 12, innerWidth - tip.offsetWidth - 8);
    tip.style.left = `${Math.max(8, left)}px`;
    tip.style.top = `${Math.max(8, box.top - tip.offsetHeight - 10)}px`;
  };
  const hide = () => { tip.hidden = true; };
  point.addEventListener("pointerenter", show);
  point.addEventListener("pointerleave", hide);
  point.addEventListener("focus", show);
  point.addEventListener("blur", hide);
}

// Commands: copy, or at least select.
for (const button of all(".copy")) {
  button.addEventListener("click", async event => {
    event.stopPropagation();
    const code = button.previousElementSibling;
    try {
      await navigator.clipboard.writeText(code.textContent);
      button.textContent = "copied";
    } catch {
      getSelection().selectAllChildren(code);
    }
  });
}

// Pictures: two of a group's choices, divided.
const KINDS = { final: "Final", indirect: "Indirect", error: "Error map" };
const ZOOMS = { Fit: 0, "1:1": 1, "2:1": 2, "4:1": 4 };

function comparer(root, { choices, start }) {
  const find = selector => root.querySelector(selector);
  const [left, right, stage, viewport] = [".left", ".right", ".stage", ".viewport"].map(find);
  let kind = "final", at = 50;

  // Of very many choices, a list offers references, the first ones, and those that were chosen elsewhere.
  const MOST = 500;
  for (const select of [left, right]) {
    select.append(...choices.slice(0, MOST).map((choice, index) => new Option(choice.label, index)));
    select.addEventListener("change", show);
  }
  const choose = (select, index) => {
    if (![...select.options].some(option => option.value === String(index))) select.add(new Option(choices[index].label, index));
    select.value = index;
  };
  choose(left, 0);
  choose(right, Math.max(0, choices.findIndex(choice => choice.row === start)));

  // Truth has no error map: beside one it shows the light that the map is about.
  const picture = choice => {
    const order = { error: ["error", "indirect", "final"], indirect: ["indirect", "final"], final: ["final", "indirect"] }[kind];
    const found = order.find(name => choice.images[name]);
    return { source: found ? choice.images[found] : "", note: found && found !== kind ? ` (${KINDS[found].toLowerCase()})` : "" };
  };
  function show() {
    const sides = [[left, ".over", ".tag-left", ".exr-left"], [right, ".under", ".tag-right", ".exr-right"]];
    for (const [select, image, tag, file] of sides) {
      const choice = choices[select.value];
      const { source, note } = picture(choice);
      find(image).src = source;
      find(image).alt = choice.label + note;
      find(tag).textContent = choice.label + note;
      find(file).hidden = !choice.images.exr;
      find(file).href = choice.images.exr ?? "";
      find(file).textContent = choice.label;
    }
    find(".files").hidden = all(".files a:not([hidden])", root).length === 0;
    find(".of-kind").hidden = kind !== "error";
    mark(root.closest(".group"), choices[right.value].row);
  }
  function divide(percent) {
    at = Math.min(100, Math.max(0, percent));
    stage.style.setProperty("--at", `${at}%`);
    stage.setAttribute("aria-valuenow", Math.round(at));
  }

  const segmented = (place, names, act) => {
    for (const [index, name] of names.entries()) {
      const button = make("button", { type: "button", textContent: name });
      button.setAttribute("aria-pressed", index === 0);
      button.addEventListener("click", () => { press(button); act(index); });
      find(place).append(button);
    }
  };
  const kinds = Object.keys(KINDS).filter(name => choices.some(choice => choice.images[name]));
  kind = kinds[0];
  segmented(".kinds", kinds.map(name => KINDS[name]), index => { kind = kinds[index]; show(); });
  const zoom = factor => {
    viewport.classList.toggle("fit", factor === 0);
    viewport.classList.toggle("zoomed", factor > 1);
    stage.style.setProperty("--zoom", factor / devicePixelRatio);
  };
  segmented(".zooms", Object.keys(ZOOMS), index => zoom(Object.values(ZOOMS)[index]));
  zoom(0);

  const follow = event => {
    const box = stage.getBoundingClientRect();
    divide((event.clientX - box.left) / box.width * 100);
  };
  stage.addEventListener("pointerdown", event => { stage.setPointerCapture(event.pointerId); follow(event); });
  stage.addEventListener("pointermove", event => { if (stage.hasPointerCapture(event.pointerId)) follow(event); });
  const swap = () => {
    const [a, b] = [left.value, right.value];
    choose(left, b);
    choose(right, a);
    show();
  };
  const turn = step => {
    choose(right, (Number(right.value) + step + choices.length) % choices.length);
    show();
  };
  find(".swap").addEventListener("click", swap);
  stage.addEventListener("keydown", event => {
    const step = event.shiftKey ? 1 : 5;
    const act = {
      ArrowLeft: () => divide(at - step), ArrowRight: () => divide(at + step),
      Home: () => divide(0), End: () => divide(100),
      ArrowUp: () => turn(-1), ArrowDown: () => turn(1), x: swap, X: swap,
    }[event.key];
    if (act && !event.ctrlKey && !event.metaKey && !event.altKey) { event.preventDefault(); act(); }
  });
  show();
  return {
    choose(row) {
      const index = choices.findIndex(choice => choice.row === row);
      if (index < 0) return;
      choose(right, index);
      show();
    },
    showKind(name) { all(".kinds button", root)[kinds.indexOf(name)]?.click(); },
  };
}

// The row on the right is marked wherever it appears.
function mark(group, row) {
  group.selectedRow = row;
  for (const other of all("[data-row]", group)) other.classList.toggle("selected", other.dataset.row === String(row));
}

const data = JSON.parse(document.getElementById("data").textContent);
for (const group of all(".group")) {
  const root = group.querySelector(".compare");
  if (!root) continue;
  const pictures = comparer(root, data[group.dataset.group]);
  const choose = element => {
    pictures.choose(Number(element.dataset.row));
    if (element.classList.contains("thumbnail")) {
      pictures.showKind("error");
      root.scrollIntoView({ block: "center" });
    }
  };
  // Rows of long tables come and go: the group listens for all.
  group.addEventListener("click", event => {
    const element = event.target.closest("[data-row]");
    if (element) choose(element);
  });
  group.addEventListener("keydown", event => {
    if (event.key === "Enter" && event.target.matches(".point[data-row]")) choose(event.target);
  });
}
