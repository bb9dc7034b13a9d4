// Opens the viewer. Errors are shown over the whole page.

// Number of lost devices after which the page no longer reopens the viewer by itself, and the time in which they count,
// milliseconds.
const MOST_LOSSES = 3;
const LOSSES_WITHIN = 60000;

const byId = (id) => document.getElementById(id);
const losses = [];
let program;

// Shows a message: what happened, what to do (a list), the browser's own message, and what "Try again" does.
function say(title, what, fixes = [], details = "", retry = null) {
  byId("title").textContent = title;
  byId("what").textContent = what;
  byId("fixes").replaceChildren(...fixes.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  byId("details-text").textContent = details;
  byId("details").hidden = !details;
  byId("retry").hidden = !retry;
  byId("retry").onclick = retry;
  byId("message").hidden = false;
  if (retry) byId("retry").focus();
}

// A canvas of a lost device cannot be used again.
function freshCanvas() {
  const old = byId("view");
  const canvas = old.cloneNode(false);
  old.replaceWith(canvas);
  return canvas;
}

async function open() {
  say("Loading…", "");
  if (!window.isSecureContext) {
    return say("This address is not secure", "Browsers offer WebGPU only over https and on the local computer.", [
      "Open the page over https.",
      "On your own computer, use http://127.0.0.1 or http://localhost.",
    ]);
  }
  if (!navigator.gpu) {
    return say("This browser does not offer WebGPU", "Halflight needs WebGPU to compute light on the graphics device.", [
      "Use a current Chrome or Edge, Safari 26, or Firefox 141 or later.",
      "On Linux, Chrome may need chrome://flags/#enable-unsafe-webgpu.",
      "Or run the desktop viewer: cargo run --release -p halflight-native",
    ]);
  }
  const adapter = await navigator.gpu.requestAdapter().catch(() => null);
  if (!adapter) {
    return say("No graphics device was found", "The browser supports WebGPU but has no device for it.", [
      "Switch on graphics acceleration in the browser's settings, then restart it.",
      "Update the graphics driver.",
    ], "", open);
  }
  const { vendor, architecture, description } = adapter.info ?? {};
  window.halflightAdapter = [vendor, architecture, description].filter(Boolean).join(" ");
  try {
    program ??= await import("./halflight_web.js").then(async (module) => (await module.default({ module_or_path: "halflight_web_bg.wasm" }), module));
    const address = location.hash.slice(1);
    await program.start(freshCanvas(), address);
    byId("message").hidden = true;
    window.halflight = program;
    byId("view").focus();
  } catch (error) {
    console.error(error);
    say("The viewer could not start", "The graphics device does not provide what the viewer needs.", [
      "Close other pages that use a lot of graphics memory, then try again.",
      "Update the browser and the graphics driver.",
    ], String(error), open);
  }
}

window.halflightSave = (name, contents) => {
  const url = URL.createObjectURL(new Blob([contents], { type: "application/octet-stream" }));
  Object.assign(document.createElement("a"), { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
};

window.halflightLost = (reason) => {
  const now = performance.now();
  losses.push(now);
  const recent = losses.filter((time) => now - time < LOSSES_WITHIN).length;
  if (recent <= MOST_LOSSES) {
    say("The graphics device was lost", "The page is opening the viewer again in the same state.", [], reason);
    // Not inside the callback, because the old viewer is still on the stack.
    setTimeout(open, 500);
  } else {
    say("The graphics device was lost several times", "The driver may have been reset because a frame took too long.", [
      "Use a smaller size or fewer samples: remove the part of the address after the #.",
      "Close other pages that use the graphics device.",
    ], reason, open);
  }
};

window.addEventListener("error", (event) => {
  if (String(event.message).includes("unreachable") || String(event.message).includes("panicked")) {
    say("The viewer stopped", "An internal error occurred. The link to your view is still in the address bar.", [
      "Reload the page.",
      "If it happens again, remove the part of the address after the #.",
    ], String(event.message), () => location.reload());
  }
});

window.addEventListener("hashchange", () => program?.go_to(location.hash.slice(1)));

open();
