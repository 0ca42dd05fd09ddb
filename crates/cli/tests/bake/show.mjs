// Shows a baked .glb file in three.js, in Chromium without a window, and prints what its pixels are: linear radiance of
// a square picture, row by row from the top, the mean over 8 x 8 points of each pixel.
//
// node show.mjs PLAYWRIGHT THREE CHROMIUM VIEWER FILE.glb SIDE SHOT.png

import { createServer } from "node:http";
import { readFile } from "node:fs/promises";
import { basename, extname, join } from "node:path";
import { createRequire } from "node:module";

const [playwright, three, chromium, viewer, file, side, shot] = process.argv.slice(2);
const browsers = createRequire(import.meta.url)(playwright);
const kinds = { ".html": "text/html", ".js": "text/javascript", ".glb": "model/gltf-binary" };

/** The file that an address stands for. */
const place = (path) => {
  if (path.startsWith("/three/")) return join(three, path.slice("/three/".length));
  return path === `/${basename(file)}` ? file : join(viewer, path);
};

const server = createServer(async (request, response) => {
  const path = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
  try {
    const bytes = await readFile(place(path));
    response.writeHead(200, { "content-type": kinds[extname(path)] ?? "application/octet-stream" }).end(bytes);
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((ready) => server.listen(0, "127.0.0.1", ready));
const address = `http://127.0.0.1:${server.address().port}/room.html?${encodeURIComponent(basename(file))}`;
const flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"];
const browser = await browsers.chromium.launch({ executablePath: chromium, args: flags });
const page = await browser.newPage({ viewport: { width: Number(side) * 4, height: Number(side) * 4 } });
const errors = [];
page.on("pageerror", (error) => errors.push(String(error)));
page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
await page.goto(address);
await page.waitForFunction(() => window.ready === true, undefined, { timeout: 60000 }).catch(() => {
  throw new Error(`the page is not ready: ${errors.join("; ")}`);
});
await page.screenshot({ path: shot });
const pixels = await page.evaluate((across) => {
  const POINTS = 8;
  const { THREE, scene, camera, renderer } = window;
  const points = POINTS * across;
  const target = new THREE.WebGLRenderTarget(points, points, { type: THREE.FloatType });
  renderer.setRenderTarget(target);
  renderer.render(scene, camera);
  const values = new Float32Array(4 * points * points);
  renderer.readRenderTargetPixels(target, 0, 0, points, points, values);
  const sums = new Array(3 * across * across).fill(0);
  for (let k = 0; k < points * points; k++) {
    const [x, y] = [Math.floor((k % points) / POINTS), across - 1 - Math.floor(k / points / POINTS)];
    for (let c = 0; c < 3; c++) sums[3 * (y * across + x) + c] += values[4 * k + c] / (POINTS * POINTS);
  }
  return sums;
}, Number(side));
process.stdout.write(JSON.stringify({ pixels, webgl2: await page.evaluate(() => window.renderer.capabilities.isWebGL2 ?? true), errors }));
await browser.close();
server.close();
