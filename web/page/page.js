// Opens the viewer. Errors are shown over the whole page.

// Number of lost devices after which the page no longer reopens the viewer by itself, and the time in which they count,
// milliseconds.
const MOST_LOSSES = 3;
const LOSSES_WITHIN = 60000;

const byId = (id) => document.getElementById(id);
const losses = [];
let program;
// The compiled program, for workers.
let compiled;
// A worker that starts while the viewer does.
let spare;
// Number of times that the viewer was opened.
let openings = 0;

// Shows a message: what happened, what to do (a list), the browser's own message, and what "Try again" does. Without
// anything to do, the program is on its way, and the picture of its first view is shown.
function say(title, what, fixes = [], details = "", retry = null) {
  byId("message").classList.toggle("failed", fixes.length > 0 || !!retry);
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

// Keeps the message until there is a picture to see, or something to read.
async function untilFirstPicture(opened) {
  say("Drawing the first picture…", "");
  while (opened === openings) {
    const report = JSON.parse(program.report() || "null");
    if (report && (report.first_picture_ms !== null || report.messages.length > 0 || report.benchmark)) {
      byId("message").hidden = true;
      byId("view").focus();
      return;
    }
    await new Promise((done) => setTimeout(done, 50));
  }
}

async function compile() {
  const response = await fetch("halflight_web_bg.wasm");
  if (!response.ok) throw new Error(`The program cannot be loaded: ${response.status} ${response.statusText}`);
  // Some servers send it under another type, which compileStreaming refuses.
  const typed = response.headers.get("Content-Type")?.startsWith("application/wasm");
  return typed ? WebAssembly.compileStreaming(response) : WebAssembly.compile(await response.arrayBuffer());
}

// Compiles the program once, for the page and its workers, and starts both.
async function start() {
  compiled ??= compile();
  compiled.catch(() => { compiled = null; });
  spare?.terminate();
  spare = newWorker();
  const [module, bindings] = await Promise.all([compiled, import("./halflight_web.js")]);
  await bindings.default({ module_or_path: module });
  return bindings;
}

async function open() {
  const opened = ++openings;
  say("Loading…", program ? "" : "The program has 2 MB.");
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
    program ??= await start();
    const address = location.hash.slice(1);
    await program.start(freshCanvas(), address);
    window.halflight = program;
    untilFirstPicture(opened);
  } catch (error) {
    console.error(error);
    say("The viewer could not start", "The graphics device does not provide what the viewer needs.", [
      "Close other pages that use a lot of graphics memory, then try again.",
      "Update the browser and the graphics driver.",
    ], String(error), open);
  }
}

// A worker that gets the program, and `failed`: a promise of why it cannot work.
function newWorker() {
  const worker = new Worker("worker.js", { type: "module" });
  worker.failed = new Promise((done) => {
    worker.onerror = worker.onmessageerror = (event) => {
      event.preventDefault();
      done(event.message ?? event.type);
    };
    compiled.then((module) => worker.postMessage({ module })).catch(done);
  });
  return worker;
}

// Starts a worker that loads a scene. Returns a function that stops it.
window.halflightLoad = (source, receive) => {
  const worker = spare ?? newWorker();
  spare = null;
  worker.onmessage = ({ data }) => receive(data);
  worker.failed.then((reason) => {
    console.error(reason);
    receive("Halflight hit an internal error while it read the scene: open it again, or another one");
  });
  worker.postMessage({ source }, [source.buffer]);
  return () => worker.terminate();
};

window.halflightSave = (name, contents) => {
  const url = URL.createObjectURL(new Blob([contents], { type: "application/octet-stream" }));
  Object.assign(document.createElement("a"), { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
};

// The browser writes the PNG file, so that the program needs no encoder.
window.halflightSavePicture = async (name, width, pixels) => {
  const image = new ImageData(new Uint8ClampedArray(pixels), width);
  const canvas = new OffscreenCanvas(image.width, image.height);
  canvas.getContext("2d").putImageData(image, 0, 0);
  const file = await canvas.convertToBlob({ type: "image/png" });
  window.halflightSave(name, await file.arrayBuffer());
};

// A click or key in the viewer counts as the user's permission for a few seconds.
window.halflightFullscreen = () => {
  const done = document.fullscreenElement ? document.exitFullscreen() : byId("stage").requestFullscreen();
  done.catch((error) => console.warn(`The full screen is not available: ${error}`));
};

// Asks for files and opens them as if they had been dropped.
window.halflightChoose = () => byId("files").click();
byId("files").addEventListener("change", async (event) => {
  const files = [...event.target.files];
  event.target.value = "";
  const read = await Promise.all(files.map(async (file) => [file.name, new Uint8Array(await file.arrayBuffer())]));
  for (const [name, bytes] of read) program.add_file(name, bytes);
  program.open_files();
});

byId("setups-open").addEventListener("click", () => byId("setups").showModal());
byId("setups").addEventListener("click", (event) => {
  // The dialog's own area is its backdrop and padding.
  if (event.target === byId("setups") || event.target.closest("a")) byId("setups").close();
});

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
    openings++;
    say("The viewer stopped", "Halflight hit an internal error. The link to your view is still in the address bar.", [
      "Reload the page.",
      "If it happens again, remove the part of the address after the #.",
    ], String(event.message), () => location.reload());
  }
});

window.addEventListener("hashchange", () => program?.go_to(location.hash.slice(1)));

open();
