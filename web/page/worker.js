// Loads a scene beside the page, which thereby stays free. Gets the compiled program and a source, in any order; sends the parts
// of the scene.
import init, { load } from "./halflight_web.js";

let begin;
const ready = new Promise((done) => { begin = done; });

onmessage = async ({ data: { module, source } }) => {
  if (module) begin(init({ module_or_path: module }));
  if (!source) return;
  await ready;
  load(source, (bytes) => postMessage(bytes, [bytes.buffer]));
  close();
};
