// The plan: the scene from above in a dialog, cut above the eye, with the eye in it; a place that is chosen is gone to.
import { add, basisOf, dot, planAxes, planCamera } from "./camera.js";

const MARGIN = 1.06;

export class Plan {
  constructor(app, bounds) {
    this.app = app;
    this.bounds = bounds;
    this.axes = planAxes(app.scene);
    this.dialog = document.getElementById("plan");
    this.canvas = document.getElementById("plan-view");
    this.cursor = [0, 0];
    document.getElementById("plan-close").addEventListener("click", () => this.dialog.close());
    this.canvas.addEventListener("click", (event) => this.#go(this.#placeOf(event)));
    this.canvas.addEventListener("keydown", (event) => this.#moveCursor(event));
  }

  open() {
    this.cursor = this.#eye();
    this.dialog.showModal();
    this.#draw();
    this.#mark();
    this.canvas.focus();
  }

  // A place in the scene as coordinates along the plan's right and up.
  #flat(position) { return [dot(position, this.axes.right), dot(position, this.axes.up)]; }

  // The middle of the plan and half its side, so that all of the scene is in it.
  #frame() {
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => this.#flat([0, 1, 2].map((i) => this.bounds[(k >> i) & 1][i])));
    const range = (i) => [Math.min(...corners.map((c) => c[i])), Math.max(...corners.map((c) => c[i]))];
    const [x, y] = [range(0), range(1)];
    return {
      centre: [(x[0] + x[1]) / 2, (y[0] + y[1]) / 2], half: (Math.max(x[1] - x[0], y[1] - y[0], 0.01) / 2) * MARGIN, };
  }

  // The eye on the plan, or the place at the edge that is nearest to it.
  #eye() {
    const { centre, half } = this.#frame();
    const within = (x) => Math.max(-0.97 * half, Math.min(0.97 * half, x));
    return this.#flat(this.app.state.position).map((x, i) => within(x - centre[i]));
  }

  // Up to where the scene is drawn: some way above the eye, below most ceilings.
  #cut() {
    const { up } = this.app.scene;
    const eye = dot(this.app.state.position, up);
    const top = Math.max(...this.bounds.map((corner) => dot(corner, up)));
    return eye < top ? eye + 0.3 * (top - eye) : eye;
  }

  #draw() {
    const { app, canvas } = this;
    const { centre, half } = this.#frame();
    const side = Math.max(16, Math.round(canvas.clientWidth * Math.min(2, window.devicePixelRatio || 1)));
    const camera = planCamera(app.scene, this.#cut(), centre, half, 1);
    const pixels = app.view.readPicture(side, side, camera, app.state.stops, 4);
    [canvas.width, canvas.height] = [side, side];
    const image = new ImageData(side, side);
    for (let row = 0; row < side; row++) {
      image.data.set(pixels.subarray(4 * side * row, 4 * side * (row + 1)), 4 * side * (side - 1 - row));
    }
    canvas.getContext("2d").putImageData(image, 0, 0);
  }

  // The eye with its direction, and the cross that the keys move.
  #mark() {
    const { half } = this.#frame();
    const onMap = ([x, y]) => [100 * (x / half + 1), 100 * (1 - y / half)];
    const eye = onMap(this.#eye());
    const ahead = this.#flat(basisOf(this.app.scene, this.app.state).forward);
    const angle = (Math.atan2(ahead[0], ahead[1]) * 180) / Math.PI;
    const [x, y] = onMap(this.cursor);
    const marks = document.getElementById("plan-marks");
    marks.setAttribute("viewBox", "0 0 200 200");
    marks.innerHTML = `<g transform="translate(${eye}) rotate(${angle})" stroke="#000" stroke-width="1.5">
      <path d="M0 0L-13 -26L13 -26Z" fill="#ffc861" fill-opacity="0.45"></path>
      <circle r="5" fill="#ffc861"></circle></g>
      <path d="M${x - 7} ${y}h14M${x} ${y - 7}v14" stroke="#000" stroke-width="4"></path>
      <path d="M${x - 7} ${y}h14M${x} ${y - 7}v14" stroke="#fff" stroke-width="2"></path>`;
    const place = this.#position(this.cursor).map((u, i) =>
      Number((this.app.scene.unit.center[i] + this.app.scene.unit.scale * u).toPrecision(3)));
    document.getElementById("plan-place").textContent = `${this.axes.names[0]} →,
      ${this.axes.names[1]} ↑; cross at ${place.join(", ")}`;
  }

  #placeOf(event) {
    const box = this.canvas.getBoundingClientRect();
    const { half } = this.#frame();
    return [((event.clientX - box.left) / box.width) * 2 - 1, 1 - ((event.clientY - box.top) / box.height) * 2]
      .map((x) => x * half);
  }

  // The place at eye height above a point of the plan.
  #position([x, y]) {
    const { centre } = this.#frame();
    const height = dot(this.app.state.position, this.app.scene.up);
    const level = add(this.axes.right.map((r) => r * (x + centre[0])), this.axes.up, y + centre[1]);
    return add(level, this.app.scene.up, height);
  }

  #go(place) {
    this.app.change({ position: this.#position(place) });
    this.dialog.close();
    this.app.canvas.focus();
  }

  #moveCursor(event) {
    if (event.key === "Enter") return this.#go(this.cursor);
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!step) return;
    event.preventDefault();
    const { half } = this.#frame();
    const length = half * (event.shiftKey ? 0.2 : 0.04);
    this.cursor = this.cursor.map((x, i) => Math.max(-half, Math.min(half, x + length * step[i])));
    this.#mark();
  }
}
