// Bars of the power of every term of the series, with a table for those who do not see them.
import { colourOfTerm, escaped, numberText, superscript, termName } from "./words.js";
import { total } from "./transport.js";

const [LEFT, WIDTH] = [48, 400];
const scales = { isLog: false };

export function toggleLogarithm() {
  scales.isLog = !scales.isLog;
}

// The share of the full height that a power has, on a linear axis or a logarithmic one.
function axisOf(powers) {
  const positive = powers.map(total).filter((power) => power > 0);
  const [least, most] = [Math.min(...positive), Math.max(...positive)];
  if (positive.length === 0) return { isLog: false, most: 0, share: () => 0 };
  if (!scales.isLog) return { isLog: false, most, share: (p) => (p > 0 ? p / most : 0) };
  const top = Math.log10(most) + 0.08;
  const bottom = Math.max(Math.floor(Math.log10(least) - 0.02), top - 7);
  const share = (p) => (p > 0 ? Math.max(0.01, (Math.log10(p) - bottom) / (top - bottom)) : 0);
  return { isLog: true, bottom, top, share };
}

// Lines at powers of ten, or at the largest power.
function gridLines({ isLog, bottom, top }, height) {
  const line = (y, label) => `<line class="grid" x1="46" x2="${WIDTH}" y1="${y}" y2="${y}"></line>
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
  const label = isLabelled ? `<text class="label" x="${x + width / 2}" y="${height + 31}">${termName(n)}</text>` : "";
  return `<g class="${included ? "in" : "out"}" style="--term:${colourOfTerm(n)}"><title>${termName(n)}:
    ${power.map(numberText).join(", ")} W</title><rect ${shape}></rect>${label}</g>`;
}

function tableOf(powers, included, caption) {
  const rows = powers.map((power, n) => `<tr><th scope="row">${termName(n)}</th>
    ${power.map((p) => `<td>${numberText(p)}</td>`).join("")}<td>${included[n] ? "yes" : "no"}</td></tr>`);
  const heads = ["term", "red", "green", "blue", "in the picture"].map((head) => `<th scope="col">${head}</th>`);
  return `<div class="unseen"><table><caption>${escaped(caption)}</caption><tr>${heads.join("")}</tr>
    ${rows.join("")}</table></div>`;
}

// Fills an element with the bars of powers [n][c] in W; terms that are not included are outlined.
export function showBars(element, powers, included, caption, height = 118) {
  const axis = axisOf(powers);
  const each = (WIDTH - LEFT) / powers.length;
  const every = Math.ceil(powers.length / 9);
  const shapes = powers.map((power, n) =>
    bar(power, n, included[n], LEFT + n * each, each, height, axis.share, n % every === 0)).join("");
  const scale = axis.isLog ? "logarithmic" : `max ${numberText(axis.most)}`;
  element.innerHTML = `<svg class="bars" aria-hidden="true" viewBox="0 0 ${WIDTH} ${height + 38}">
    ${gridLines(axis, height)}${shapes}</svg>
    <p class="note" aria-hidden="true">${escaped(caption)}, ${scale}</p>
    ${tableOf(powers, included, caption)}`;
}

// Lets bars be clicked, for one term, or dragged over, for the sum of some: `choose(from, to, isClick)`.
export function touchBars(element, count, choose) {
  let from = null;
  const termAt = (event) => {
    const box = element.querySelector("svg").getBoundingClientRect();
    const at = (((event.clientX - box.left) / box.width) * WIDTH - LEFT) / ((WIDTH - LEFT) / count);
    return Math.max(0, Math.min(count - 1, Math.floor(at)));
  };
  element.addEventListener("pointerdown", (event) => {
    if (!event.target.closest("svg")) return;
    element.setPointerCapture(event.pointerId);
    from = termAt(event);
  });
  element.addEventListener("pointermove", (event) => {
    const n = from === null ? from : termAt(event);
    if (n !== from) choose(Math.min(from, n), Math.max(from, n), false);
    element.dataset.dragged = n !== from || element.dataset.dragged || "";
  });
  element.addEventListener("pointerup", (event) => {
    if (from !== null && !element.dataset.dragged) choose(from, termAt(event), true);
    [from, element.dataset.dragged] = [null, ""];
  });
}
