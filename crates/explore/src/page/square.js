// The map of the (alpha, tau) square: where the series converges, the four modes at its corners, and a dot to drag.
import { MODES, radiusBounds } from "./transport.js";

const SIDE = 150;
const TAUS = Array.from({ length: 101 }, (_, i) => i / 100);
const xOf = (alpha) => SIDE * alpha;
const yOf = (tau) => SIDE * (1 - tau);

// The curve alpha = 1 / radius(tau), at most 1, as points of the drawing; radii are `factor` times those known.
function curve(radii, bound, factor) {
  const alpha = (tau) => Math.min(1, 1 / (factor * radiusBounds(radii, tau)[bound]));
  return TAUS.map((tau) => `${xOf(alpha(tau)).toFixed(2)},${yOf(tau).toFixed(2)}`);
}

// What lies beyond the frontier: hatched where divergence is proved, filled where the bounds leave it
// open.
function frontier(radii, factor) {
  const [proved, open] = [curve(radii, "lower", factor), curve(radii, "upper", factor)];
  const right = `${SIDE},0 ${SIDE},${SIDE}`;
  const diverges = TAUS.filter((tau) => factor * radiusBounds(radii, tau).lower > 1);
  if (diverges.length === 0) return "";
  const line = proved.slice(Math.max(0, TAUS.indexOf(diverges[0]) - 1));
  const middle = yOf((diverges[0] + 3 * diverges.at(-1)) / 4);
  return `<polygon points="${open.join(" ")} ${right}" class="open"></polygon>
    <polygon points="${proved.join(" ")} ${right}" fill="url(#hatch)"></polygon>
    <polyline points="${line.join(" ")}" fill="none" class="edge"></polyline>
    <text class="word" x="${SIDE - 5}" y="${Math.max(34, middle)}" text-anchor="end">diverges</text>`;
}

function corners() {
  return Object.entries(MODES).map(([name, { alpha, tau }]) => {
    const anchor = alpha === 1 ? "end" : "start";
    return `<text class="corner" data-mode="${name}" x="${xOf(alpha)}" y="${tau === 1 ? -11 : SIDE + 23}"
      text-anchor="${anchor}">${name}</text>`;
  }).join("");
}

// Puts the map into an element; `change` is called with the {alpha, tau} that was chosen.
export function squareMap(element, radii, change) {
  element.innerHTML = `<svg viewBox="-20 -25 ${SIDE + 30} ${SIDE + 75}"><rect width="${SIDE}" height="${SIDE}"
    class="ground"></rect><g class="frontier"></g>${corners()}
    <text x="${SIDE / 2}" y="${SIDE + 44}" text-anchor="middle">alpha →</text>
    <text transform="translate(-8 ${SIDE / 2}) rotate(-90)" text-anchor="middle">tau →</text>
    <g role="slider" tabindex="0" aria-label="alpha and tau" aria-valuemin="0" aria-valuemax="1"><circle r="8"
    fill="#ffc861" stroke="#000" stroke-width="2.5"></circle></g></svg>`;
  const [svg, dot] = [element.querySelector("svg"), element.querySelector("[role=slider]")];
  let drawn = null;
  listenToPointer(svg, change);
  dot.addEventListener("keydown", (event) => moveByKey(event, dot, change));
  return ({ alpha, tau }, factor, words) => {
    if (drawn !== factor) element.querySelector(".frontier").innerHTML = frontier(radii, drawn = factor);
    dot.setAttribute("transform", `translate(${xOf(alpha)} ${yOf(tau)})`);
    Object.assign(dot.dataset, { alpha, tau });
    dot.setAttribute("aria-valuenow", alpha);
    dot.setAttribute("aria-valuetext", `alpha ${alpha.toFixed(2)}, tau ${tau.toFixed(2)}: ${words}`);
  };
}

const clamped = (x) => Math.min(1, Math.max(0, Math.round(100 * x) / 100));

function listenToPointer(svg, change) {
  const at = (event) => {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    const snapped = (x) => (x < 0.04 ? 0 : x > 0.96 ? 1 : clamped(x));
    change({ alpha: snapped(point.x / SIDE), tau: snapped(1 - point.y / SIDE) });
  };
  svg.addEventListener("pointerdown", (event) => {
    const mode = event.target.dataset.mode;
    if (mode) return change({ alpha: MODES[mode].alpha, tau: MODES[mode].tau });
    svg.setPointerCapture(event.pointerId);
    at(event);
  });
  svg.addEventListener("pointermove", (event) => svg.hasPointerCapture(event.pointerId) && at(event));
}

function moveByKey(event, dot, change) {
  const step = event.shiftKey ? 0.1 : 0.01;
  const steps = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] }[event.key];
  if (!steps) return;
  event.preventDefault();
  const [alpha, tau] = [clamped(Number(dot.dataset.alpha) + steps[0]), clamped(Number(dot.dataset.tau) + steps[1])];
  Object.assign(dot.dataset, { alpha, tau });
  change({ alpha, tau });
}
