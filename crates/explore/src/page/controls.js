// The panel and the header: every control shows the state and changes it.
import { MODES } from "./transport.js";
import { fileCamera } from "./state.js";
import { colourOfTerm, decodedSrgb, encodedSrgb, escaped, percentText, termName, verdictText } from "./words.js";
import { showBars, toggleLogarithm, touchBars } from "./bars.js";
import { squareMap } from "./square.js";

const element = (id) => document.getElementById(id);
const DOUBTFUL = 0.15;
const outputOf = (input) => input.parentElement.querySelector("output");

// Wires all controls of the panel and lets them follow the state.
export function startControls(app) {
  startModes(app);
  startSlider(app, "alpha", (x) => ({ alpha: x }), () => app.state.alpha.toFixed(2));
  startSlider(app, "tau", (x) => ({ tau: x }), () => app.state.tau.toFixed(2));
  startSlider(app, "stops", (x) => ({ stops: x }), () => stopsText(app.state.stops));
  startSlider(app, "rho", (x) => ({ rho: x }), () => rhoText(app.state));
  startBounces(app);
  startTouch(app);
  startTheme(app);
  const { rms } = app.scene.errors;
  element("doubt").hidden = !(rms > DOUBTFUL);
  element("doubt").innerHTML = `<strong>▲ ${percentText(rms ?? 0)} off</strong> <span class="spare">a rendered picture (rms)</span>`;
  startLamps(app);
  const showSquare = squareMap(element("square"), app.scene.radii, (part) => app.change(part));
  let shown = null;
  app.followers.push(() => {
    if (app.mixed === shown) return;
    shown = app.mixed;
    showSquare(app.state, app.mixed.radius, `${app.mode ?? "between the modes"}, ${app.mixed.verdict.kind}`);
    showBars(element("bars"), app.mixed.powers, app.mixed.included, "Visible power of every term, W");
    showHeader(app);
    showVerdict(app);
    showPart(app);
  });
  element("facts").innerHTML = facts(app.scene).map((fact) => `<p>${fact}</p>`).join("");
}

function rhoText({ rho, rhoOf }) {
  const own = Object.values(rhoOf).filter((factor) => factor !== 1).length;
  return `× ${rho.toFixed(2)}${own > 0 ? `, ${own} of their own` : ""}`;
}

// Terms in the equation and bars are buttons: one alone, or all of them again; bars that are dragged over are a sum.
function startTouch(app) {
  const { terms } = app.scene;
  const choose = (from, n, isClick) => {
    const { view } = app.state;
    if (!isClick) return app.change({ view: from === 0 ? { kind: "sum", n } : { kind: "part", from, n } });
    const isAgain = view.kind === "term" && view.n === n;
    app.change({ view: isAgain ? { kind: "all", n: terms } : { kind: "term", n } });
  };
  element("equation").addEventListener("click", ({ target }) => {
    const { n } = target.closest("button")?.dataset ?? {};
    if (n) choose(Number(n), Number(n), true);
    if (n) element("equation").querySelector(`[data-n="${n}"]`)?.focus();
  });
  touchBars(element("bars"), terms + 1, choose);
  element("logarithm").addEventListener("change", () => {
    toggleLogarithm();
    app.change({ view: app.state.view });
  });
  element("scaled").addEventListener("change", ({ target }) => app.change({ scaled: target.checked }));
  app.followers.push(() => (element("scaled").checked = app.state.scaled));
}

// Dark or light, as the browser asks for until the button is pressed.
function startTheme() {
  const [light, root] = [matchMedia("(prefers-color-scheme: light)"), document.documentElement.dataset];
  const set = (isLight) => (root.theme = isLight ? "light" : "dark");
  set(light.matches);
  light.addEventListener("change", () => set(light.matches));
  element("theme").addEventListener("click", () => set(root.theme === "dark"));
}

const stopsText = (stops) => stops === 0 ? "0" : `${stops > 0 ? "+" : "−"}${Math.abs(stops).toFixed(1)}`;

function startSlider(app, id, partOf, textOf) {
  const input = element(id);
  input.addEventListener("input", () => app.change(partOf(input.valueAsNumber)));
  app.followers.push(() => {
    input.value = app.state[id];
    outputOf(input).textContent = textOf();
  });
}

function startModes(app) {
  const labels = Object.keys(MODES).map((name) =>
    `<label><input type="radio" name="mode" value="${name}"> ${name}</label>`);
  element("modes").insertAdjacentHTML("beforeend", `${labels.join("")}
    <label class="off"><input type="radio" name="mode" value="between" disabled> between</label>`);
  element("modes").addEventListener("change", (event) => {
    const { alpha, tau } = MODES[event.target.value];
    app.change({ alpha, tau });
  });
  app.followers.push(() => {
    element("modes").querySelector(`[value="${app.mode ?? "between"}"]`).checked = true;
  });
}

// The view that the slider at `n` and the switch mean; one step after the last term stands for all of the series.
function viewAt(scene, kind, n) {
  if (kind === "term") return { kind, n: Math.min(n, scene.terms) };
  return n > scene.terms ? { kind: "all", n: scene.terms } : { kind: "sum", n };
}

function bounceText({ kind, n, from }) {
  if (kind === "all") return "all of them";
  if (kind === "part") return `${termName(from)} to ${termName(n)}`;
  return kind === "term" ? `${termName(n)} alone` : n === 0 ? "E" : `up to ${termName(n)}`;
}

function startBounces(app) {
  const slider = element("bounce");
  const kinds = [...document.querySelectorAll("[name=kind]")];
  slider.max = app.scene.terms + 1;
  const change = () => {
    const kind = kinds.find((input) => input.checked).value;
    app.change({ view: viewAt(app.scene, kind, slider.valueAsNumber) });
  };
  for (const input of [slider, ...kinds]) input.addEventListener("input", change);
  app.followers.push(() => {
    const { kind, n } = app.state.view;
    slider.value = kind === "all" ? n + 1 : n;
    outputOf(slider).textContent = bounceText(app.state.view);
    slider.setAttribute("aria-valuetext", bounceText(app.state.view));
    for (const input of kinds) input.checked = (input.value === "term") === (kind === "term");
  });
}

function lampControls({ name }, l) {
  return `<div class="slider lamp"><label for="lamp-${l}">${escaped(name)}</label><output for="lamp-${l}"></output>
    <input type="color" id="colour-${l}" aria-label="${escaped(name)}: colour">
    <input type="range" id="lamp-${l}" min="0" max="2" step="0.01"></div>`;
}

function startLamps(app) {
  element("lamps").innerHTML = app.scene.lamps.map(lampControls).join("");
  app.scene.lamps.forEach((_, l) => startLamp(app, l));
  const setAll = (part) => app.change({ lamps: app.state.lamps.map((lamp) => ({ ...lamp, ...part })) });
  // Lamps that were coloured black are white again.
  const lit = ({ colour }) => ({ brightness: 1, colour: colour.some((x) => x > 0) ? colour : [1, 1, 1] });
  element("lamps-on").addEventListener("click", () => app.change({ lamps: app.state.lamps.map(lit) }));
  element("lamps-off").addEventListener("click", () => setAll({ brightness: 0 }));
  element("lamps-reset").addEventListener("click", () => setAll({ brightness: 1, colour: [1, 1, 1] }));
}

function startLamp(app, l) {
  const [slider, colour] = [element(`lamp-${l}`), element(`colour-${l}`)];
  const change = (part) => app.change({ lamps: app.state.lamps.with(l, { ...app.state.lamps[l], ...part }) });
  slider.addEventListener("input", () => change({ brightness: slider.valueAsNumber }));
  colour.addEventListener("input", () => {
    const codes = [1, 3, 5].map((at) => parseInt(colour.value.slice(at, at + 2), 16) / 255);
    change({ colour: codes.map(decodedSrgb) });
  });
  app.followers.push(() => {
    const lamp = app.state.lamps[l];
    slider.value = lamp.brightness;
    outputOf(slider).textContent = lamp.brightness === 0 ? "off" : `× ${Number(lamp.brightness.toFixed(2))}`;
    const codes = lamp.colour.map((x) => Math.round(255 * encodedSrgb(Math.min(1, x))));
    colour.value = `#${codes.map((code) => code.toString(16).padStart(2, "0")).join("")}`;
  });
}

// L = E + K L, unrolled, of buttons: the terms that are in the picture stand out, those that are 0 are grey.
function equation(app) {
  const { included, isWhole, powers } = app.mixed;
  const { terms } = app.scene;
  const shown = [...new Set([0, 1, 2, 3, terms - 1, terms])].filter((n) => n <= terms).sort((a, b) => a - b);
  const { n: chosen } = app.state.view;
  if (!shown.includes(chosen)) shown.splice(shown.findIndex((n) => n > chosen), 0, chosen);
  const parts = shown.map((n, i) => {
    const gap = i > 0 && shown[i - 1] !== n - 1 ? " + …" : "";
    const isSpare = n > 2 && n < terms && n !== chosen;
    const isZero = powers[n].every((power) => power === 0);
    const term = `<button type="button" class="term ${included[n] ? "on" : ""} ${isZero ? "zero" : ""}" data-n="${n}"
      style="--term:${colourOfTerm(n)}" aria-pressed="${app.state.view.kind === "term" && n === chosen}">
      <b>${termName(n)}</b>${isZero ? " = 0" : ""}</button>`;
    return `${gap}<span class="${isSpare ? "spare" : ""}">${i > 0 ? " + " : ""}${term}</span>`;
  });
  return `<b>L</b> = <span class="spare"><b>E</b> + <b>K L</b> = </span>${parts.join("")} + <span class="term ${isWhole ? "on" : ""}">…</span>`;
}

function showHeader(app) {
  element("equation").innerHTML = equation(app);
  const { alpha, tau } = app.state;
  element("meaning").textContent = app.mode ? MODES[app.mode].meaning
    : `Between the modes: interreflection ${alpha.toFixed(2)}, ${percentText(tau)} of light passes through surfaces.`;
}

// What of the series is shown, over the picture, in the colour of its term.
function showPart(app) {
  const { view } = app.state;
  const { stops, hasPicture } = app.mixed;
  const part = element("part");
  part.hidden = view.kind === "all" || !hasPicture;
  const factor = stops === 0 ? "" : `, × ${stops > 0 ? 2 ** stops : `1/${2 ** -stops}`}`;
  part.textContent = `${bounceText(view)}${factor}`;
  const colour = view.kind === "term" && hasPicture ? colourOfTerm(view.n) : "transparent";
  element("picture").style.setProperty("--term", colour);
}

function showVerdict(app) {
  const { verdict, hasPicture } = app.mixed;
  const { terms } = app.scene;
  const words = verdictText(verdict);
  const fault = verdict.kind === "diverges" ? "has no sum" : "may have no sum";
  const instead = `<strong>▲ No picture:</strong> the series ${fault}.
    ${words} <span class="spare">Shown instead: ${termName(terms)} alone, scaled to the power of KE.</span>`;
  const shown = hasPicture ? words : instead;
  const verdictElement = element("verdict");
  verdictElement.classList.toggle("none", !hasPicture);
  verdictElement.classList.toggle("warns", verdict.kind === "diverges" || verdict.kind === "undecided");
  if (verdictElement.dataset.shown !== shown) verdictElement.innerHTML = shown;
  verdictElement.dataset.shown = shown;
}

// What the page knows about its own errors.
function facts(scene) {
  const { effort, errors } = scene;
  const count = (n) => n.toLocaleString("en");
  // An error that is no number is not known.
  const worst = errors.tau.reduce((most, { error }) => Math.max(most, error ?? Infinity), 0);
  const places = [...new Set(errors.tau.map(({ tau }) => tau))].join(", ");
  return [
    "Lamps, bounces and alpha are exact: light is linear in E, and every term of the series is kept by itself.",
    errors.tau.length > 0 ? `tau is solved at ${scene.taus.length} nodes
      (${scene.taus.map((t) => Number(t.toFixed(3))).join(", ")}); between them it is off by
      ${Number.isFinite(worst) ? `${percentText(worst)} at most` : "what is not known"}, measured at ${places}.` : "",
    `The terms after ${termName(scene.terms)} are added as two geometric series: the part along the dominant eigenvector
      of K is exact, what is left shrinks by one ratio.`,
    `Reflectance is exact where all walls change as one; of one material it is estimated by light between
      ${scene.coarse.count} coarse patches.`,
    errors.rms === null ? "" : `Next to halflight’s own picture from the file’s camera this one is off by
      ${percentText(errors.rms)} (rms).`,
    `${count(effort.patches)} patches, ${count(effort.rays)} rays, ${count(effort.triangles)} triangles.`,
    scene.ownTransport ? `Some material has a tau of its own, which the slider leaves as it is, or an alpha, which
      multiplies the slider’s.` : "",
    scene.punctual ? "Where a patch gets its light from does not count lights without area." : "",
    "Diffuse surfaces only: no gloss, no refraction.", escaped(scene.attribution),
    `Made by halflight ${escaped(scene.version)}.`, ].filter((fact) => fact !== "");
}

// A message that stays until it is closed.
export function showMessage(text, canClose = true) {
  const message = document.createElement("div");
  message.className = "message";
  message.setAttribute("role", "alert");
  message.append(Object.assign(document.createElement("span"), { textContent: text }));
  const close = Object.assign(document.createElement("button"), { type: "button", textContent: "Close" });
  close.addEventListener("click", () => message.remove());
  if (canClose) message.append(close);
  element("messages").append(message);
}

// Tells those who listen that something was done, and those who look by the button that did it.
function tell(button, text) {
  const words = button.dataset.words ?? button.textContent;
  button.dataset.words = words;
  button.textContent = text;
  element("status").textContent = text;
  setTimeout(() => (button.textContent = words), 1800);
}

async function copyLink(app, button) {
  app.writeLink();
  try {
    await navigator.clipboard.writeText(location.href);
    tell(button, "Link copied");
  } catch {
    const field = Object.assign(document.createElement("textarea"), { value: location.href });
    document.body.append(field);
    field.select();
    tell(button, document.execCommand("copy") ? "Link copied" : "Copy it from the address bar");
    field.remove();
    button.focus();
  }
}

function savePicture(app) {
  app.draw(false);
  app.canvas.toBlob((blob) => {
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob) });
    link.download = `${app.scene.scene.replace(/[^\w-]+/g, "-")}-${app.mode ?? "between"}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    tell(element("save"), "Picture saved");
  });
}

// The buttons below the sliders, and the one that folds the panel away on small windows.
export function startButtons(app, openPlan) {
  element("home").addEventListener("click", () => app.change(fileCamera(app.scene)));
  element("open-plan").addEventListener("click", openPlan);
  element("save").addEventListener("click", () => savePicture(app));
  element("copy").addEventListener("click", (event) => copyLink(app, event.currentTarget));
  for (const id of app.view ? [] : ["home", "open-plan", "save"]) element(id).disabled = true;
  const fold = element("fold");
  const set = (isOpen) => fold.setAttribute("aria-expanded", String(isOpen));
  fold.addEventListener("click", () => set(fold.getAttribute("aria-expanded") !== "true"));
  set(window.innerHeight > 480);
}
