// Bars of the power of every term of the series, with a table for those who do not see them.
import { escaped, hexColour, numberText, superscript, termName } from "./words.js";

const total = (power) => power[0] + power[1] + power[2];

// The share of the full height that a power has: on a logarithmic axis where the powers differ by more than 30.
function axisOf(powers) {
  const positive = powers.map(total).filter((power) => power > 0);
  const [least, most] = [Math.min(...positive), Math.max(...positive)];
  if (positive.length === 0) return { isLog: false, most: 0, share: () => 0 };
  if (most < 30 * least) return { isLog: false, most, share: (p) => (p > 0 ? p / most : 0) };
  const top = Math.log10(most) + 0.08;
  const bottom = Math.max(Math.floor(Math.log10(least) - 0.02), top - 7);
  const share = (p) => (p > 0 ? Math.max(0.01, (Math.log10(p) - bottom) / (top - bottom)) : 0);
  return { isLog: true, bottom, top, share };
}

// Lines at powers of ten, or at the largest power.
function gridLines({ isLog, bottom, top }, height, width) {
  const line = (y, label) => `<line x1="46" x2="${width}" y1="${y}" y2="${y}" stroke="#373c48"></line>
    <text x="42" y="${y + 5}" text-anchor="end">${label}</text>`;
  if (!isLog) return line(12, "max") + line(12 + height, "0");
  const exponents = [];
  const step = Math.ceil((top - bottom) / 4);
  for (let e = Math.ceil(bottom); e <= top; e += step) exponents.push(e);
  return exponents.map((e) => line(12 + height * (1 - (e - bottom) / (top - bottom)), `10${superscript(e)}`)).join("");
}

function bar(power, n, included, x, width, height, share, isLabelled) {
  const size = height * share(total(power));
  const shape = `x="${x + width * 0.14}" y="${12 + height - size}" width="${width * 0.72}" height="${size}"`;
  const fill = included ? hexColour(power) : "url(#faint)";
  const label = isLabelled ? `<text class="label" x="${x + width / 2}" y="${height + 31}">${termName(n)}</text>` : "";
  return `<g class="${included ? "in" : "out"}"><title>${termName(n)}: ${power.map(numberText).join(", ")} W</title>
    <rect ${shape} fill="${fill}" stroke="${included ? "#fff" : "#8d93a1"}" stroke-width="1.5"></rect>${label}</g>`;
}

function tableOf(powers, included, caption) {
  const rows = powers.map((power, n) => `<tr><th scope="row">${termName(n)}</th>
    ${power.map((p) => `<td>${numberText(p)}</td>`).join("")}<td>${included[n] ? "yes" : "no"}</td></tr>`);
  const heads = ["term", "red", "green", "blue", "in the picture"].map((head) => `<th scope="col">${head}</th>`);
  return `<table class="unseen"><caption>${escaped(caption)}</caption><tr>${heads.join("")}</tr>
    ${rows.join("")}</table>`;
}

// Fills an element with the bars of powers [n][c] in W; terms that are not included are outlined and hatched.
export function showBars(element, powers, included, caption, height = 118) {
  const width = 400;
  const axis = axisOf(powers);
  const each = (width - 48) / powers.length;
  const every = Math.ceil(powers.length / 9);
  const shapes = powers.map((power, n) =>
    bar(power, n, included[n], 48 + n * each, each, height, axis.share, n % every === 0)).join("");
  const scale = axis.isLog ? "logarithmic" : `max ${numberText(axis.most)}`;
  element.innerHTML = `<svg class="bars" aria-hidden="true" viewBox="0 0 ${width} ${height + 38}">
    ${gridLines(axis, height, width)}${shapes}</svg>
    <p class="note" aria-hidden="true">${escaped(caption)}, ${scale}</p>
    ${tableOf(powers, included, caption)}`;
}
