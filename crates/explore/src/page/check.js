// The page's test of itself, asked for by #test: means of its pictures next to those of the program that made it, how
// fast it opens and draws; or a picture in linear radiance.
import { stateOfLink } from "./state.js";
import { perspective } from "./camera.js";

// Whether the address asks for a test, and for which.
export function testOf(link) {
  const asked = new URLSearchParams(link.replace(/^#/, ""));
  if (!asked.has("test")) return null;
  const size = /^(\d+)x(\d+)$/.exec(asked.get("size") ?? "");
  return { isLinear: asked.get("test") === "linear", size: size ? [Number(size[1]), Number(size[2])] : null };
}

// The light of a link, from the file's camera unless the link has another.
function setState(app, link) {
  app.state = stateOfLink(app.scene, link).state;
  app.mixLight();
}

// The mean of the sRGB codes of a picture, per channel.
function meanOf(pixels) {
  const sums = [0, 0, 0];
  for (let i = 0; i < pixels.length; i++) if (i % 4 < 3) sums[i % 4] += pixels[i];
  return sums.map((sum) => sum / 255 / (pixels.length / 4));
}

function drawnState(app, { state, mean }) {
  const [width, height] = app.scene.test.size;
  setState(app, state);
  const camera = perspective(app.scene, app.state, width / height);
  return { state, mean: meanOf(app.view.readPicture(width, height, camera, app.state.stops)), expected: mean };
}

// Pictures a second on the canvas while the camera turns, drawn as they are then; null where no time passes.
function picturesPerSecond(app) {
  const drawOne = () => {
    app.state.yaw += 1;
    app.draw(true);
    app.view.gl.readPixels(0, 0, 1, 1, app.view.gl.RGBA, app.view.gl.UNSIGNED_BYTE, new Uint8Array(4));
  };
  for (let warm = 0; warm < 4; warm++) drawOne();
  const started = performance.now();
  let pictures = 0;
  for (; pictures < 60 && performance.now() - started < 1000; pictures++) drawOne();
  const seconds = (performance.now() - started) / 1000;
  return seconds > 0 ? pictures / seconds : null;
}

function linearPicture(app, link, [width, height]) {
  setState(app, link);
  const pixels = app.view.readLinear(width, height, perspective(app.scene, app.state, width / height));
  const rgb = new Float32Array(3 * width * height);
  for (let i = 0; i < rgb.length; i++) {
    const pixel = Math.floor(i / 3);
    const row = height - 1 - Math.floor(pixel / width);
    rgb[i] = pixels[4 * (row * width + (pixel % width)) + (i % 3)];
  }
  const bytes = new Uint8Array(rgb.buffer);
  let text = "";
  for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
  return { webgl2: true, width, height, pixels: btoa(text) };
}

function rendererName(gl) {
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  return String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
}

function results(app, test, link, open) {
  if (!app.view) return { webgl2: false, states: [] };
  if (test.isLinear) return linearPicture(app, link, test.size ?? app.scene.test.size);
  // The program's pictures are of points, one a pixel.
  app.view.readImagesAt(true);
  const states = app.scene.test.states.map((expected) => drawnState(app, expected));
  app.view.readImagesAt(false);
  setState(app, "");
  const speed = picturesPerSecond(app);
  return { webgl2: true, renderer: rendererName(app.view.gl), open, picturesPerSecond: speed, states };
}

// Puts what a test found into the document.
export function tellTest(found) {
  const pre = Object.assign(document.createElement("pre"), { id: "test", textContent: JSON.stringify(found) });
  document.body.append(pre);
}

// Runs the test.
export function runTest(app, test, link, open) {
  tellTest(results(app, test, link, open));
  setState(app, link);
  app.schedule();
}
