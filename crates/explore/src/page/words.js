// Numbers and symbols in words and in HTML.

export function escaped(text) {
  return text.replace(/[&<>"]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[c]);
}

export const superscript = (n) => String(n).replace(/[-0-9]/g, (c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(c)]));

// The name of term n: E, KE, K²E, …
export const termName = (n) => n === 0 ? "E" : n === 1 ? "KE" : `K${superscript(n)}E`;
const COLOURS = ["#ffc861", "#ff8a5c", "#f0609e", "#b77bff", "#6f95ff", "#3fb8e6", "#2fc79b", "#8fcb4b", "#d3c53f"];

// The colour that a term has in the equation, the bars and around its picture.
export const colourOfTerm = (n) => COLOURS[n % COLOURS.length];

// Three digits of a number, with a power of ten where it is very large or small.
export function numberText(x) {
  if (x === 0 || !Number.isFinite(x)) return String(x);
  const [digits, exponent] = x.toExponential(2).split("e");
  if (Math.abs(exponent) <= 3) return String(Number(x.toPrecision(3)));
  return `${digits} × 10${superscript(Number(exponent))}`;
}

export function percentText(share) {
  if (share > 0 && share < 1e-4) return "< 0.01\u00a0%";
  return `${Number((100 * share).toPrecision(2))}\u00a0%`;
}

// Linear light as an sRGB code in 0..1, and back.
export const encodedSrgb = (v) => v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055;
export const decodedSrgb = (code) => code <= 0.04045 ? code / 12.92 : ((code + 0.055) / 1.055) ** 2.4;

// The colour of light, as bright as can be, as #rrggbb.
export function hexColour(light) {
  const most = Math.max(...light);
  const codes = light.map((x) => (most > 0 ? Math.round(255 * encodedSrgb(Math.max(0, x) / most)) : 128));
  return `#${codes.map((code) => code.toString(16).padStart(2, "0")).join("")}`;
}

// Proved bounds in digits: the lower rounded down and the upper up, to as many as keep them apart from 1.
function boundsText(lower, upper) {
  let digits = 3;
  const down = () => Math.floor(lower * 10 ** digits) / 10 ** digits;
  const up = () => Math.ceil(upper * 10 ** digits) / 10 ** digits;
  while (digits < 9 && ((upper < 1 && up() >= 1) || (lower > 1 && down() <= 1))) digits++;
  return `radius ${down().toFixed(digits)} to ${up().toFixed(digits)}`;
}

// What the bounds on the spectral radius say about the series.
export function verdictText({ kind, lower, upper, isExact }) {
  const proved = isExact ? ", proved" : ", estimated on few patches";
  if (kind === "ends") return "<strong>The series ends:</strong> K²E = 0, the sum is E + KE.";
  const bounds = boundsText(lower, upper);
  if (kind === "converges") return `<strong>Converges:</strong> ${bounds}, below 1${proved}.`;
  if (kind === "diverges") return `<strong>Diverges:</strong> ${bounds}, not below 1${proved}.`;
  return `<strong>Undecided:</strong> ${bounds}, 1 lies between${proved}.`;
}
