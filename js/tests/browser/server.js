// Serves folders on this computer: browsers load modules from servers only.

import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";

const TYPES = { ".js": "text/javascript", ".json": "application/json", ".html": "text/html", ".wgsl": "text/plain" };

/** Serves each folder under its name, and some paths instead of others; the address and a function that ends it. */
export async function serve(folders, instead = {}) {
  const server = createServer(async (request, response) => {
    let wanted = normalize(decodeURIComponent(new URL(request.url, "http://x").pathname));
    for (const [from, to] of Object.entries(instead))
      if (wanted.startsWith(from)) wanted = to + wanted.slice(from.length);
    const [, name, ...rest] = wanted.split("/");
    try {
      const path = join(folders[name], ...rest);
      const body = await readFile(path);
      response.writeHead(200, { "content-type": TYPES[extname(path)] ?? "application/octet-stream" }).end(body);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  return { address: `http://127.0.0.1:${server.address().port}`, close: () => server.close() };
}
