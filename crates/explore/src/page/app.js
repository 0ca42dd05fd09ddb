// What the parts of the page share: the scene, the state and what follows from it, and when the picture is drawn anew.
import { interpolation, mixture, modeOf, travellingCoefficients } from "./transport.js";
import { gainsOf, initialState, linkOfState, stateOfLink } from "./state.js";
import { perspective } from "./camera.js";
import { Reflectance, factorsOf } from "./reflectance.js";

const LIGHT = ["alpha", "tau", "view", "lamps", "rho", "rhoOf", "scaled"]; // what of a state changes the light
const PIXEL_RATIO = 2;
const HASTY_RATIO = 0.6;
const SLOW = 50; // milliseconds for a picture, beyond which fewer pixels are drawn while something moves

export class App {
  constructor(scene, light, patches, canvas) {
    Object.assign(this, { scene, light, patches, canvas });
    this.view = null;
    this.reflectance = new Reflectance(scene, patches);
    this.state = initialState(scene);
    this.followers = [];
    this.isScheduled = false;
    this.isLightStale = true;
    this.slowPictures = 0;
    this.lastChange = 0;
    this.follow(this.state);
  }

  get gains() { return gainsOf(this.state); }

  get mode() { return modeOf(this.state.alpha, this.state.tau); }

  // What follows from the state without WebGL.
  follow(state) {
    if (this.blend?.tau !== state.tau) this.blend = interpolation(this.scene, state.tau);
    const gains = gainsOf(state);
    this.light.interpolate(this.blend);
    const change = this.reflectance.change(state, this.light, gains);
    this.light.setRatios(change, this.reflectance.coarseOfCell);
    this.patches.reflectances = factorsOf(this.scene, state);
    this.mixed = mixture(this.scene, this.blend, state, gains, change);
  }

  // Mixes the light of the present state and hands it to the view.
  mixLight() {
    this.follow(this.state);
    const { coefficients } = this.mixed;
    this.view?.setReflectances(this.patches.reflectances);
    this.sums = this.light.mix(this.mixed, this.gains);
    this.view?.setLight(this.sums, this.gains.map((gain, l) => gain.map((g, c) => g * coefficients[0][l][c])));
  }

  // The light that travels to what is shown, and the coefficient of E in it.
  travelling() {
    const travelling = travellingCoefficients(this.mixed);
    const sums = this.light.mix(travelling, this.gains);
    return { sums, coefficient: travelling.coefficients[0][0]?.[0] ?? 0 };
  }

  // Changes the state; whatever is shown follows with the next picture.
  change(part) {
    Object.assign(this.state, part);
    this.isLightStale ||= LIGHT.some((name) => name in part);
    clearTimeout(this.linkTimer);
    this.linkTimer = setTimeout(() => this.writeLink(), 250);
    this.schedule();
  }

  schedule() {
    if (this.isScheduled) return;
    this.isScheduled = true;
    requestAnimationFrame(() => this.frame());
  }

  frame() {
    this.isScheduled = false;
    const isMoving = performance.now() - this.lastChange < 200;
    this.lastChange = performance.now();
    if (this.isLightStale) this.mixLight();
    this.isLightStale = false;
    for (const follower of this.followers) follower();
    if (this.view) this.draw(isMoving);
  }

  // Whether pictures have taken too long more than once while something moved.
  get isSlow() { return this.slowPictures > 1; }

  // Draws the picture; a hasty one has fewer pixels, and a full one follows when all is still.
  draw(isMoving) {
    const started = performance.now();
    const isHasty = isMoving && this.isSlow;
    this.fitCanvas(isHasty ? HASTY_RATIO : Math.min(PIXEL_RATIO, window.devicePixelRatio || 1));
    this.view.draw(this.camera(), this.state.stops + this.mixed.stops, isHasty ? 0 : 4);
    clearTimeout(this.stillTimer);
    if (isHasty) this.stillTimer = setTimeout(() => this.draw(false), 220);
    else if (isMoving) this.measure(started);
  }

  measure(started) {
    this.view.gl.finish();
    if (performance.now() - started > SLOW) this.slowPictures++;
  }

  fitCanvas(ratio) {
    const { canvas } = this;
    const size = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.max(1, Math.round(x * ratio)));
    if (canvas.width !== size[0]) canvas.width = size[0];
    if (canvas.height !== size[1]) canvas.height = size[1];
  }

  camera() { return perspective(this.scene, this.state, this.canvas.width / this.canvas.height); }

  writeLink() {
    const link = `#${this.story > 0 ? `story=${this.story}&` : ""}${linkOfState(this.scene, this.state)}`;
    try {
      if (link !== location.hash) history.replaceState(null, "", link);
    } catch { /* a page inside another, as in a notebook, has no address of its own */ }
  }

  // Takes the state of a link; returns what was wrong with it.
  readLink(link) {
    clearTimeout(this.linkTimer);
    const { state, problems } = stateOfLink(this.scene, link);
    this.state = state;
    this.isLightStale = true;
    this.schedule();
    return problems;
  }
}
