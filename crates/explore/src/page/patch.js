// Asking about a surface: the patch under the pointer, a card about it, and its row of F drawn into the room.
import { escaped, hexColour, numberText, percentText } from "./words.js";
import { whitest } from "./state.js";
import { showBars } from "./bars.js";

// Viridis in eight steps, dark to bright.
const STEPS = ["#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#fde725"];

function stepColours() {
  return Float32Array.from(STEPS.flatMap((hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255)));
}

export class PatchCard {
  constructor(app) {
    this.app = app;
    this.element = document.getElementById("card");
    this.hint = document.getElementById("hint");
    this.patch = -1;
    this.row = "none"; // or "light", "factors"
    app.followers.push(() => this.#follow());
    document.addEventListener("keydown", (event) => {
      if (event.key === "Escape" && this.patch >= 0 && !document.querySelector("dialog[open]")) this.close();
    });
  }

  // The patch seen at a place of the canvas in CSS pixels, or -1.
  #patchAt(x, y) {
    const { app } = this;
    if (!app.view) return -1;
    const ratio = app.canvas.width / app.canvas.clientWidth;
    const [column, row] = [Math.floor(x * ratio), app.canvas.height - 1 - Math.floor(y * ratio)];
    const cell = app.view.cellAt(column, row, app.camera());
    return cell < 0 ? -1 : app.patches.arrays.cellPatch[cell];
  }

  // Opens the card about what is seen at a place.
  ask(x, y) {
    const patch = this.#patchAt(x, y);
    if (patch < 0) return this.close();
    this.patch = patch;
    this.hint.hidden = true;
    this.shown = null;
    this.app.schedule();
  }

  close() {
    if (this.element.contains(document.activeElement)) this.app.canvas.focus();
    this.patch = -1;
    this.row = "none";
    this.element.hidden = true;
    this.element.textContent = "";
    this.app.view?.setShares(null);
    if (this.app.view) this.app.view.overlay.chosen = -1;
    this.app.schedule();
  }

  // Outlines and names the patch under the mouse; null: none.
  hover(event) {
    this.hovered = event;
    if (!event) this.hint.hidden = true;
    if (this.hoverIsPending) return;
    this.hoverIsPending = true;
    requestAnimationFrame(() => {
      this.hoverIsPending = false;
      this.#showHint(this.hovered);
    });
  }

  #showHint(event) {
    const box = this.app.canvas.getBoundingClientRect();
    const [x, y] = event ? [event.clientX - box.left, event.clientY - box.top] : [0, 0];
    const patch = event ? this.#patchAt(x, y) : -1;
    this.hint.hidden = patch < 0;
    if (patch >= 0) {
      this.hint.textContent = this.#nameOf(patch);
      this.hint.style.left = `${Math.min(x + 14, box.width - this.hint.offsetWidth - 8)}px`;
      this.hint.style.top = `${Math.min(y + 14, box.height - this.hint.offsetHeight - 8)}px`;
    }
    const outlined = this.patch >= 0 ? this.patch : patch;
    if (!this.app.view || this.app.view.overlay.chosen === outlined) return;
    this.app.view.overlay.chosen = outlined;
    this.app.schedule();
  }

  #nameOf(patch) {
    const { arrays, scene } = this.app.patches;
    return scene.objects[arrays.patchObject[patch]] ?? "surface";
  }

  // Writes the card anew when the light or the patch has changed.
  #follow() {
    const { app } = this;
    if (this.patch < 0 || (this.shown === app.sums && this.shownRow === this.row)) return;
    if (this.element.hidden || this.writtenPatch !== this.patch) this.#write();
    this.#fill();
    this.shown = app.sums;
    this.shownRow = this.row;
    if (!app.view) return;
    app.view.overlay.chosen = this.patch;
  }

  // The parts of the card that do not depend on light.
  #write() {
    const { arrays, scene } = this.app.patches;
    const { patch } = this;
    const material = scene.materials[arrays.patchMaterial[patch]].name;
    this.writtenPatch = patch;
    const own = arrays.patchMaterial[patch];
    const lines = (title, name) => ["red", "green", "blue"].map((colour) =>
      `<dt>${title}, ${colour}</dt><dd class="${name}"></dd>`).join("");
    this.element.innerHTML = `<header><h2>${escaped(this.#nameOf(patch))}</h2>
      <button type="button" class="close">Close</button></header>
      <dl><dt>material</dt><dd>${escaped(material)}${arrays.patchSide[patch] ? ", back" : ""}</dd>
      <dt>area, file’s units²</dt><dd>${numberText(arrays.patchArea[patch])}</dd>
      ${lines("rho", "rho")}${lines("L, W/(m² sr)", "radiance")}</dl>
      <div class="slider"><label for="rho-own">reflectance of ${escaped(material)}</label><input id="rho-own"
      type="range" min="0" max="${whitest(scene.materials[own])}" step="0.01"><output for="rho-own"></output></div>
      ${this.#choices()}<div class="row"></div><div class="power"></div>`;
    this.element.hidden = false;
    document.getElementById("panel").scrollTop = 0;
    this.element.querySelector(".close").addEventListener("click", () => this.close());
    this.element.querySelector("#rho-own").addEventListener("input", ({ target }) =>
      this.app.change({ rhoOf: { ...this.app.state.rhoOf, [own]: target.valueAsNumber } }));
    for (const input of this.element.querySelectorAll("[name=row]")) {
      input.addEventListener("change", () => {
        this.row = input.value;
        this.app.schedule();
      });
    }
    document.getElementById("status").textContent = `Chosen: ${this.#nameOf(patch)}, ${material}`;
  }

  #choices() {
    if (!this.app.scene.coarse?.count) return "";
    const choice = (value, text) => `<label><input type="radio" name="row" value="${value}"
      ${this.row === value ? "checked" : ""}> ${text}</label>`;
    return `<fieldset><legend>Where its light comes from</legend>${choice("none", "show the light")}
      ${choice("light", "F<sub>ij</sub> L<sub>j</sub>, light sent here")}
      ${choice("factors", "F<sub>ij</sub>, how much is seen from here")}</fieldset>`;
  }

  // Radiance, powers and the row of F in the present light.
  #fill() {
    const { app, patch } = this;
    const { patches, gains, mixed } = app;
    const radiance = patches.radiance(patch, app.sums, mixed, gains);
    const write = (name, numbers) => this.element.querySelectorAll(`.${name}`).forEach((line, c) =>
      (line.textContent = numberText(numbers[c])));
    write("rho", patches.rho(patch));
    write("radiance", radiance);
    this.element.querySelector("h2").style.setProperty("--term", hexColour(radiance));
    const factor = app.state.rhoOf[patches.arrays.patchMaterial[patch]] ?? 1;
    this.element.querySelector("#rho-own").value = factor;
    this.element.querySelector("output").textContent = `× ${factor.toFixed(2)}`;
    const powers = patches.powers(patch, app.light, gains, mixed.alphas);
    showBars(this.element.querySelector(".power"), powers, mixed.included, "Its power per bounce, W", 78);
    const row = this.element.querySelector(".row");
    if (this.row === "none") app.view?.setShares(null);
    row.innerHTML = this.row === "none" ? "" : this.#rowText();
  }

  // The shares of the row that is asked for; draws them into the room and says them in words.
  #rowText() {
    const { app, patch } = this;
    const { patches, state, gains } = app;
    const factors = this.row === "factors";
    const travelling = factors ? null : app.travelling();
    const shares = factors ? patches.rowOfF(patch, state.tau)
      : patches.sharesOfLight(patch, state.tau, travelling.sums, gains, travelling.coefficient);
    const largest = shares.reduce((most, share) => Math.max(most, share), 0);
    if (largest === 0) {
      app.view?.setShares(null);
      return `<p>${factors ? "Nothing is seen from here." : "No light of surfaces arrives here in this picture."}</p>`;
    }
    app.view?.setShares(patches.toCells(shares), largest, stepColours());
    const list = patches.byObject(shares).filter(({ share }) => share >= 0.005).slice(0, 8)
      .map(({ name, share }) => `<li>${percentText(share)} ${escaped(name)}</li>`);
    return `${legend(largest)}<ol>${list.join("")}</ol><p class="note">Each of ${app.scene.coarse.count} coarse patches
      has one colour; this row of F belongs to the coarse patch around the chosen one.${this.#isTransparent()}</p>`;
  }

  #isTransparent() {
    if (this.app.state.tau === 0) return "";
    return " With tau above 0 light comes through surfaces too, so F adds up to more than 1.";
  }
}

// Colours of the steps with the shares that they stand for: each half of the one to its right.
function legend(largest) {
  const spans = STEPS.map((colour, k) => `<span style="background:${colour}"
    title="${k > 0 ? "above" : "up to"} ${percentText(largest / 2 ** (k > 0 ? 8 - k : 7))}"></span>`);
  return `<div class="legend" role="img" aria-label="From dark to bright: up to ${percentText(largest / 128)} to
    ${percentText(largest)}, every step twice the one before">${spans.join("")}</div>
    <p class="note">≤ ${percentText(largest / 128)} … ${percentText(largest)} per coarse patch, each step twice the
    last</p>`;
}
