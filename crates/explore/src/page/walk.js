// Walking and looking around: mouse, touch and keys on the picture.
import { looked, walked } from "./camera.js";
import { FOV } from "./state.js";

const SPEED = 0.6; // unit lengths a second; a scene is two of them long
const TURN = 70;   // degrees a second
const STEP = 0.12; // seconds that one press counts where nothing shall move by itself

// What a key does: steps to the right, up, ahead; turns by yaw, pitch; changes of the angle of view.
function motionOf(event) {
  const arrows = event.shiftKey
    ? { ArrowUp: { pitch: 1 }, ArrowDown: { pitch: -1 }, ArrowLeft: { yaw: -1 }, ArrowRight: { yaw: 1 } }
    : { ArrowUp: { ahead: 1 }, ArrowDown: { ahead: -1 }, ArrowLeft: { yaw: -1 }, ArrowRight: { yaw: 1 } };
  const keys = {
    KeyW: { ahead: 1 }, KeyS: { ahead: -1 }, KeyA: { right: -1 }, KeyD: { right: 1 }, KeyE: { up: 1 }, KeyQ: { up: -1 },
    PageUp: { up: 1 }, PageDown: { up: -1 }, };
  const zoom = { "+": { fov: -1 }, "=": { fov: -1 }, "-": { fov: 1 } };
  return arrows[event.key] ?? keys[event.code] ?? zoom[event.key] ?? null;
}

// The part of the state that motions lasting some seconds change.
function moved(app, motions, seconds) {
  const sum = (name) => motions.reduce((total, motion) => total + (motion[name] ?? 0), 0);
  const step = SPEED * seconds;
  const { scene, state } = app;
  const fov = Math.min(FOV.most, Math.max(FOV.least, state.fov + 30 * seconds * sum("fov")));
  return {
    ...walked(scene, state, [step * sum("right"), step * sum("up"), step * sum("ahead")]),
    ...looked(scene, state, TURN * seconds * sum("yaw"), TURN * seconds * sum("pitch")), fov, };
}

// Keys move as long as they are held; where motion is not wanted, every press is one step.
function startKeys(app, ask) {
  const held = new Map();
  const isStill = matchMedia("(prefers-reduced-motion: reduce)");
  let before = 0;
  const tick = (now) => {
    if (held.size === 0) return;
    app.change(moved(app, [...held.values()], Math.min(0.1, (now - before) / 1000)));
    before = now;
    requestAnimationFrame(tick);
  };
  app.canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Enter") return ask(app.canvas.clientWidth / 2, app.canvas.clientHeight / 2);
    const motion = motionOf(event);
    if (!motion) return;
    event.preventDefault();
    if (isStill.matches) return app.change(moved(app, [motion], STEP));
    if (held.size === 0) {
      before = performance.now();
      requestAnimationFrame(tick);
    }
    held.set(event.code, motion);
  });
  app.canvas.addEventListener("keyup", (event) => held.delete(event.code));
  app.canvas.addEventListener("blur", () => held.clear());
  window.addEventListener("blur", () => held.clear());
}

// The middle of pointers and their distance from each other.
function gesture(pointers) {
  const [a, b] = [...pointers.values()];
  return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, distance: Math.hypot(a.x - b.x, a.y - b.y) };
}

// Dragging looks around as if the scene were turned by hand; two fingers walk.
function drag(app, pointers, event) {
  const before = pointers.size === 2 ? gesture(pointers) : pointers.get(event.pointerId);
  pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  const perPixel = app.state.fov / app.canvas.clientHeight;
  if (pointers.size !== 2) {
    const [dx, dy] = [event.clientX - before.x, event.clientY - before.y];
    return app.change(looked(app.scene, app.state, -dx * perPixel, dy * perPixel));
  }
  const now = gesture(pointers);
  const steps = [before.x - now.x, now.y - before.y, 2 * (now.distance - before.distance)];
  app.change(walked(app.scene, app.state, steps.map((step) => (1.5 * step) / app.canvas.clientHeight)));
}

function startPointers(app, ask, hover) {
  const { canvas } = app;
  const pointers = new Map();
  let travelled = 0;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    if (pointers.size === 0) travelled = 0;
    else travelled = Infinity;
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    hover(null);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!pointers.has(event.pointerId)) return event.pointerType === "mouse" && hover(event);
    const from = pointers.get(event.pointerId);
    travelled = Math.max(travelled, Math.hypot(event.clientX - from.x, event.clientY - from.y));
    if (travelled > 5) drag(app, pointers, event);
  });
  const release = (event) => {
    if (!pointers.delete(event.pointerId) || event.type !== "pointerup" || travelled > 5) return;
    const box = canvas.getBoundingClientRect();
    ask(event.clientX - box.left, event.clientY - box.top);
  };
  for (const type of ["pointerup", "pointercancel"]) canvas.addEventListener(type, release);
  canvas.addEventListener("pointerleave", () => hover(null));
}

function startWheel(app) {
  app.canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const turns = Math.max(-1, Math.min(1, -event.deltaY / 100));
    if (!event.ctrlKey) return app.change(walked(app.scene, app.state, [0, 0, 0.1 * turns]));
    app.change({ fov: Math.min(FOV.most, Math.max(FOV.least, app.state.fov * 0.9 ** (3 * turns))) });
  }, { passive: false });
}

// Starts all of it. `ask(x, y)` is called for a surface that is clicked, `hover(event)` for what the mouse is over.
export function startWalking(app, ask, hover) {
  startKeys(app, ask);
  startPointers(app, ask, hover);
  startWheel(app);
  const aim = document.getElementById("aim");
  const show = () => (aim.hidden = !app.canvas.matches(":focus-visible"));
  for (const type of ["focus", "blur", "keydown", "pointerdown"]) {
    app.canvas.addEventListener(type, () => requestAnimationFrame(show));
  }
}
