// Loads a scene beside the page, which thereby stays free. Gets the compiled program and a source; sends the parts of the scene.
import init, { load } from "./halflight_web.js";

onmessage = async ({ data: { module, source } }) => {
  await init({ module_or_path: module });
  load(source, (bytes) => postMessage(bytes, [bytes.buffer]));
  close();
};
