// Opens the viewer, and says over the whole page what stands in its way.

// Lost devices after which the page stops trying by itself, and the time in which they count, milliseconds.
const MOST_LOSSES = 3;
const LOSSES_WITHIN = 60000;

const byId = (id) => document.getElementById(id);
const losses = [];
let program;

function say(title, what, mends = [], said = "", again = null) {
  byId("title").textContent = title;
  byId("what").textContent = what;
  byId("mend").replaceChildren(...mends.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  byId("said").textContent = said;
  byId("details").hidden = !said;
  byId("again").hidden = !again;
  byId("again").onclick = again;
  byId("message").hidden = false;
  if (again) byId("again").focus();
}

// A canvas that has belonged to a lost device is not used again.
function freshCanvas() {
  const old = byId("view");
  const canvas = old.cloneNode(false);
  old.replaceWith(canvas);
  return canvas;
}

async function open() {
  say("Loading…", "");
  if (!window.isSecureContext) {
    return say("This address is not secure", "Browsers offer WebGPU only over https and on this computer itself.", [
      "Open the page over https.",
      "On your own computer, use http://127.0.0.1 or http://localhost.",
    ]);
  }
  if (!navigator.gpu) {
    return say("This browser does not offer WebGPU", "Halflight computes its light on your graphics device through WebGPU.", [
      "Use a current Chrome or Edge, Safari 26, or Firefox 141 or later.",
      "On Linux, Chrome may need chrome://flags/#enable-unsafe-webgpu.",
      "Or run the desktop viewer: cargo run --release -p halflight-native",
    ]);
  }
  const adapter = await navigator.gpu.requestAdapter().catch(() => null);
  if (!adapter) {
    return say("No graphics device was found", "The browser knows WebGPU but has nothing to run it on.", [
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
    say("The viewer could not start", "The graphics device did not give what the viewer asks for.", [
      "Close other pages that use much graphics memory, then try again.",
      "Update the browser and the graphics driver.",
    ], String(error), open);
  }
}

window.halflightSave = (name, contents) => {
  const url = URL.createObjectURL(new Blob([contents], { type: "text/plain" }));
  Object.assign(document.createElement("a"), { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
};

window.halflightLost = (reason) => {
  const now = performance.now();
  losses.push(now);
  const recent = losses.filter((time) => now - time < LOSSES_WITHIN).length;
  if (recent <= MOST_LOSSES) {
    say("The graphics device was lost", "The page opens it again, in the same state.", [], reason);
    // Not from inside the callback: the viewer that is to be closed is still on the stack.
    setTimeout(open, 500);
  } else {
    say("The graphics device is lost again and again", "Its driver may have been stopped because a frame took too long.", [
      "Choose a smaller size or fewer samples: shorten the address to its part before the #.",
      "Close other pages that use the graphics device.",
    ], reason, open);
  }
};

window.addEventListener("error", (event) => {
  if (String(event.message).includes("unreachable") || String(event.message).includes("panicked")) {
    say("The viewer stopped", "It came upon a state that it does not know. Your link is still in the address bar.", [
      "Reload the page.",
      "If it happens again, shorten the address to its part before the #.",
    ], String(event.message), () => location.reload());
  }
});

window.addEventListener("hashchange", () => program?.go_to(location.hash.slice(1)));

open();
