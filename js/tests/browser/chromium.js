// A headless Chromium, controlled through the DevTools protocol over a pipe: no package is needed for it.

import { spawn } from "node:child_process";
import { existsSync, mkdtempSync, realpathSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { delimiter, dirname, join } from "node:path";

/** Switches with which Debian's Chromium runs WebGPU on SwiftShader: those of web/tests/browser/chromium.rs. */
const SWITCHES = [
  "--headless=new",
  "--no-sandbox",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--disable-gpu-watchdog",
  "--enable-unsafe-webgpu",
  "--use-webgpu-adapter=swiftshader",
  "--enable-features=Vulkan",
  "--use-vulkan=swiftshader",
  "--use-angle=swiftshader",
  "--disable-backgrounding-occluded-windows",
  "--disable-renderer-backgrounding",
  "--disable-background-timer-throttling",
  "--hide-scrollbars",
  // Pages that move by themselves stand still.
  "--force-prefers-reduced-motion",
  "--window-size=480,360",
  "--mute-audio",
  "--remote-debugging-pipe",
];

const NAMES = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/** Path of Chromium; undefined if there is none. */
export function chromiumPath() {
  if (process.env.HALFLIGHT_CHROMIUM) return process.env.HALFLIGHT_CHROMIUM;
  const folders = (process.env.PATH ?? "").split(delimiter);
  return NAMES.flatMap((name) => folders.map((folder) => join(folder, name))).find((path) => existsSync(path));
}

/** The manifest of the SwiftShader that Chromium brings, for native programs; undefined if there is none. */
export function swiftshaderManifest() {
  const program = chromiumPath();
  const own = program ? [dirname(realpathSync(program))] : [];
  const folders = [...own, "/usr/lib/chromium", "/usr/lib/chromium-browser", "/opt/google/chrome"];
  return folders.map((folder) => join(folder, "vk_swiftshader_icd.json")).find((path) => existsSync(path));
}

/** A browser with one page. */
export class Page {
  #process;
  #profile;
  #next = 0;
  #waiting = new Map();
  #rest = "";
  #session;
  /** Messages of the console and exceptions. */
  console = [];

  /** Opens a page at this address. */
  static async open(address) {
    const page = new Page();
    const { targetId } = await page.#call("Target.createTarget", { url: "about:blank" });
    const { sessionId } = await page.#call("Target.attachToTarget", { targetId, flatten: true });
    page.#session = sessionId;
    for (const domain of ["Page", "Runtime", "Log"]) await page.#call(`${domain}.enable`, {});
    const loaded = page.#event("Page.loadEventFired");
    const answer = await page.#call("Page.navigate", { url: address });
    if (answer.errorText) throw new Error(`${address}: ${answer.errorText}`);
    await loaded;
    return page;
  }

  constructor() {
    this.#profile = mkdtempSync(join(tmpdir(), "halflight-js-"));
    const stdio = ["ignore", "ignore", "ignore", "pipe", "pipe"];
    this.#process = spawn(chromiumPath(), [...SWITCHES, `--user-data-dir=${this.#profile}`, "about:blank"], { stdio });
    this.#process.stdio[4].setEncoding("utf8").on("data", (text) => this.#hear(text));
    this.#process.on("exit", (code) => {
      for (const { reject } of this.#waiting.values()) reject(new Error(`Chromium ended (${code})`));
    });
  }

  #events = new Map();

  #event(name) {
    return new Promise((resolve) => this.#events.set(name, resolve));
  }

  #hear(text) {
    const messages = (this.#rest + text).split("\0");
    this.#rest = messages.pop();
    for (const message of messages.map((one) => JSON.parse(one))) {
      const waiting = this.#waiting.get(message.id);
      this.#waiting.delete(message.id);
      if (message.error) waiting?.reject(new Error(JSON.stringify(message.error)));
      else waiting?.resolve(message.result);
      this.#events.get(message.method)?.();
      if (message.method === "Runtime.consoleAPICalled") this.console.push(JSON.stringify(message.params.args));
      if (message.method === "Runtime.exceptionThrown") this.console.push(JSON.stringify(message.params));
      if (message.method === "Log.entryAdded") this.console.push(message.params.entry.text);
    }
  }

  #call(method, params) {
    const id = ++this.#next;
    const session = this.#session ? { sessionId: this.#session } : {};
    this.#process.stdio[3].write(`${JSON.stringify({ id, method, params, ...session })}\0`);
    return new Promise((resolve, reject) => this.#waiting.set(id, { resolve, reject }));
  }

  /** The value of an expression, or of its promise. */
  async evaluate(expression) {
    const params = { expression, awaitPromise: true, returnByValue: true };
    const { result, exceptionDetails } = await this.#call("Runtime.evaluate", params);
    if (exceptionDetails) {
      throw new Error(exceptionDetails.exception?.description ?? JSON.stringify(exceptionDetails));
    }
    return result.value;
  }

  /** A picture of the page, PNG. */
  async screenshot() {
    const { data } = await this.#call("Page.captureScreenshot", { format: "png" });
    return Buffer.from(data, "base64");
  }

  /** Ends the browser. */
  async close() {
    const ended = new Promise((resolve) => this.#process.once("exit", resolve));
    this.#session = undefined;
    // It ends before or after it answers.
    this.#call("Browser.close", {}).catch(() => {});
    await ended;
    rmSync(this.#profile, { recursive: true, force: true, maxRetries: 10, retryDelay: 200 });
  }
}
