// The state of the page (alpha, tau, which terms, lamps, exposure, camera) and its form as a link.
import { MODES, modeOf } from "./transport.js";

const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;
export const STOPS = { least: -10, most: 10 };
export const MOST_RHO = 3;
export const FOV = { least: 10, most: 120 };

// The state a page opens with: global illumination from the file's camera.
export function initialState(scene) {
  return {
    alpha: 1, tau: 0, view: { kind: "all", n: scene.terms }, stops: 0, scaled: true, rho: 1, rhoOf: {},
    lamps: scene.lamps.map(() => ({ brightness: 1, colour: [1, 1, 1] })), ...fileCamera(scene), };
}

// The file's camera as part of a state. Yaw and pitch count from it, in degrees: right and up are positive.
export function fileCamera(scene) {
  return { position: [...scene.camera.position], yaw: 0, pitch: 0, fov: scene.camera.fov };
}

// The names of materials in links, each once.
export function materialKeys(scene) {
  const keys = scene.materials.map(({ name }) => name.toLowerCase().replace(/[^\p{L}\p{N}]+/gu, "-"));
  return keys.map((key, m) => `rho-${keys.indexOf(key) === m ? key : `${key}-${m}`}`);
}

// The factor at which the largest reflectance of a material is 1.
export function whitest({ rho }) {
  const most = Math.max(...rho);
  return most > 0 ? 1 / most : 1;
}

// The factors of the lamps per channel.
export function gainsOf(state) {
  return state.lamps.map(({ brightness, colour }) => colour.map((share) => brightness * share));
}

// Numbers separated by commas, or null where one is malformed or outside [least, most].
function numbersIn(text, least, most) {
  const parts = text.split(",").map((part) => part.trim());
  const numbers = parts.map((part) => (NUMBER.test(part) ? Number(part) : NaN));
  return numbers.every((x) => x >= least && x <= most) ? numbers : null;
}

// As numbersIn, of a given count.
function numbersOf(text, count, least, most) {
  const numbers = numbersIn(text, least, most);
  return numbers?.length === count ? numbers : null;
}

function lampOfGain(gain) {
  const brightness = Math.max(...gain);
  return { brightness, colour: brightness > 0 ? gain.map((g) => g / brightness) : [1, 1, 1] };
}

// The terms that `bounce=` or `term=` name, or null.
function viewOf(kind, text, terms) {
  if (kind === "sum" && text === "all") return { kind: "all", n: terms };
  const n = /^\d+$/.test(text) ? Number(text) : -1;
  return n >= 0 && n <= terms ? { kind, n } : null;
}

// What each name of a link sets; a function returns false where the value makes no sense.
function setters(scene, state) {
  const assign = (value, set) => (value ? (set(value), true) : false);
  const byKey = {
    mode: (v) => assign(Object.hasOwn(MODES, v) && MODES[v], ({ alpha, tau }) => Object.assign(state, { alpha, tau })),
    alpha: (v) => assign(numbersOf(v, 1, 0, 1), ([x]) => (state.alpha = x + 0)),
    tau: (v) => assign(numbersOf(v, 1, 0, 1), ([x]) => (state.tau = x + 0)),
    bounce: (v) => assign(viewOf("sum", v, scene.terms), (view) => (state.view = view)),
    term: (v) => assign(viewOf("term", v, scene.terms), (view) => (state.view = view)),
    terms: (v) => assign(partOf(v, scene.terms), (view) => (state.view = view)),
    scaled: (v) => assign(/^(yes|no)$/.test(v), () => (state.scaled = v === "yes")),
    rho: (v) => assign(numbersOf(v, 1, 0, MOST_RHO), ([x]) => (state.rho = x)),
    stops: (v) => assign(numbersOf(v, 1, STOPS.least, STOPS.most), ([x]) => (state.stops = x)),
    fov: (v) => assign(numbersOf(v, 1, FOV.least, FOV.most), ([x]) => (state.fov = x)),
    look: (v) => assign(numbersOf(v, 2, -360, 360), ([yaw, pitch]) =>
      Object.assign(state, { yaw, pitch: Math.max(-89, Math.min(89, pitch)) })),
    at: (v) => assign(placeOf(scene, v), (position) => (state.position = position)), };
  scene.lamps.forEach((lamp, l) => {
    byKey[lamp.key] = (v) => {
      const gain = numbersIn(v, 0, 100);
      const complete = gain && (gain.length === 3 ? gain : gain.length === 1 ? [gain[0], gain[0], gain[0]] : null);
      return assign(complete, (g) => (state.lamps[l] = lampOfGain(g)));
    };
  });
  materialKeys(scene).forEach((key, m) => {
    byKey[key] = (v) => assign(numbersOf(v, 1, 0, whitest(scene.materials[m]) + 1e-4), ([x]) => (state.rhoOf[m] = x));
  });
  return byKey;
}

// The terms from one to another that `terms=` names, or null.
function partOf(text, terms) {
  const [from, n] = (/^(\d+)-(\d+)$/.exec(text) ?? []).slice(1).map(Number);
  return from <= n && n <= terms ? { kind: "part", from, n } : null;
}

// A place in the file's units as unit coordinates, or null where it is absurdly far away.
function placeOf(scene, text) {
  const place = numbersOf(text, 3, -Infinity, Infinity);
  const position = place?.map((x, i) => (x - scene.unit.center[i]) / scene.unit.scale);
  return position?.every((x) => Math.abs(x) <= 100) ? position : null;
}

// The state that a link means and what was wrong with it, in words. `mode` is heeded before all else.
export function stateOfLink(scene, link) {
  const state = initialState(scene);
  const set = setters(scene, state);
  const problems = [];
  const entries = [...new URLSearchParams(link.replace(/^#/, ""))].filter(([key]) => !/^(test|size|story)$/.test(key));
  entries.sort(([a], [b]) => (b === "mode") - (a === "mode"));
  for (const [key, value] of entries) {
    if (!Object.hasOwn(set, key)) problems.push(`“${key}” is not known`);
    else if (!set[key](value)) problems.push(`${key}=${value} is not possible`);
  }
  return { state, problems };
}

const short = (x, digits = 4) => String(Number(x.toFixed(digits)));

function linkOfCamera(scene, state) {
  const file = fileCamera(scene);
  const parts = [];
  if (state.position.some((x, i) => x !== file.position[i])) {
    const place = state.position.map((x, i) => Number((scene.unit.center[i] + scene.unit.scale * x).toPrecision(6)));
    parts.push(`at=${place.join(",")}`);
  }
  if (state.yaw !== 0 || state.pitch !== 0) parts.push(`look=${short(state.yaw, 2)},${short(state.pitch, 2)}`);
  if (state.fov !== file.fov) parts.push(`fov=${short(state.fov, 2)}`);
  return parts;
}

// The link of a state: the mode, and what differs from the state a page opens with.
export function linkOfState(scene, state) {
  const mode = modeOf(state.alpha, state.tau);
  const parts = mode ? [`mode=${mode}`] : [`alpha=${short(state.alpha)}`, `tau=${short(state.tau)}`];
  const { kind, from, n } = state.view;
  if (kind !== "all") parts.push(kind === "part" ? `terms=${from}-${n}` : `${kind === "sum" ? "bounce" : "term"}=${n}`);
  if (!state.scaled) parts.push("scaled=no");
  if (state.rho !== 1) parts.push(`rho=${short(state.rho)}`);
  const keys = materialKeys(scene);
  for (const [m, x] of Object.entries(state.rhoOf)) if (x !== 1) parts.push(`${keys[m]}=${short(x)}`);
  if (state.stops !== 0) parts.push(`stops=${short(state.stops)}`);
  gainsOf(state).forEach((gain, l) => {
    if (gain.every((g) => g === 1)) return;
    const grey = gain[0] === gain[1] && gain[1] === gain[2];
    parts.push(`${scene.lamps[l].key}=${(grey ? [gain[0]] : gain).map((g) => short(g)).join(",")}`);
  });
  return [...parts, ...linkOfCamera(scene, state)].join("&");
}
