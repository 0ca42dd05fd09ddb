// K at other reflectances, without new rays. Where all surfaces change by one factor, so does K, and the terms by its
// powers: exact. Where one material changes, light is solved again between the few coarse patches whose rows of F are
// in the page, before and after, and what is shown is the fine light times the ratio of both: fine light at that factor
// for all surfaces which gives K the same radius, so that ratios stay moderate and both series converge together.

const LATER = 40;    // terms after the last, which are summed one by one
const PRODUCTS = 60; // for an eigenvalue

// The factor on the reflectance of every material, [m].
export const factorsOf = (scene, { rho, rhoOf }) => scene.materials.map((_, m) => rho * (rhoOf[m] ?? 1));

export class Reflectance {
  constructor(scene, patches) {
    Object.assign(this, { scene, patches, known: new Map() });
    const { arrays } = patches;
    this.coarseOfCell = Uint16Array.from(arrays.cellPatch, (patch) => arrays.patchCoarse[patch]);
  }

  // What other reflectances make of the light at a state: the factor for all surfaces [c], that of the radius, whether
  // this is exact; and where it is not, ratios [n][l][c] by coarse patch, of powers too, and of the rest [c].
  change(state, light, gains) {
    const { rho, rhoOf } = state;
    const isUniform = Object.values(rhoOf).every((factor) => factor === 1) || !this.scene.coarse?.count;
    if (isUniform) return { scale: [rho, rho, rho], radius: rho, isExact: true };
    const before = this.#coarse(state.tau, light, null, "before");
    const after = this.#coarse(state.tau, light, factorsOf(this.scene, state), JSON.stringify([rho, rhoOf]));
    const over = (a, b) => (b > 0 ? a / b : 1);
    const scale = after.lambda.map((x, c) => over(x, before.lambda[c]));
    const most = (x) => Math.max(...x);
    const ratios = after.terms.map((lamps, n) => lamps.map((channels, l) => channels.map((own, c) =>
      own.map((x, j) => over(x, before.terms[n][l][c][j] * scale[c] ** (n - 1))))));
    const powers = after.powers.map((lamps, n) => lamps.map((channels, l) =>
      channels.map((x, c) => over(x, before.powers[n][l][c] * scale[c] ** n))));
    const rest = scale.map((s, c) => {
      const [own, base] = [this.#rest(after, state.alpha, c, gains), this.#rest(before, state.alpha * s, c, gains)];
      return own.map((x, j) => over(x, base[j]));
    });
    return { scale, radius: over(most(after.lambda), most(before.lambda)), isExact: false, ratios, powers, rest };
  }

  // Light between coarse patches at factors on materials [m]: what arrives of each term [n][l][c], powers of what is
  // reflected of it, and the largest eigenvalue [c].
  #coarse(tau, light, factors, key) {
    if (this.tau !== tau) this.known.clear();
    if (!this.known.has("F")) this.known.set("F", this.patches.matrixOfF(tau));
    this.tau = tau;
    if (this.known.has(key)) return this.known.get(key);
    const { scene, patches } = this;
    const [f, { areas, rho }] = [this.known.get("F"), patches.coarseRho(factors)];
    const lambda = rho.map((own) => eigenvalue(f, own));
    const terms = [[]];
    terms[1] = scene.lamps.map((_, l) => rho.map((_own, c) => patches.coarseMean(light.layer(l, 1, c))));
    for (let n = 2; n <= scene.terms; n++) {
      terms[n] = terms[n - 1].map((channels) => channels.map((own, c) => passedOn(f, rho[c], own)));
    }
    const power = (own, c) => own.reduce((sum, x, j) => sum + areas[j] * rho[c][j] * x, 0);
    const powers = terms.map((lamps) => lamps.map((channels) => channels.map(power)));
    if (this.known.size > 8) this.known.delete([...this.known.keys()].find((name) => !/^(F|before)$/.test(name)));
    this.known.set(key, { f, rho, lambda, terms, powers });
    return this.known.get(key);
  }

  // What arrives of all terms after the last, of all lamps, where each counts alpha times as much as that before.
  #rest({ f, rho, lambda, terms }, alpha, c, gains) {
    const [last, first] = [terms.at(-1), alpha ** (terms.length - 2)];
    let own = last[0][c].map((_, j) => gains.reduce((all, gain, l) => all + gain[c] * last[l][c][j], 0));
    const sum = new Float64Array(own.length);
    own = own.map((x) => first * x);
    for (let n = 0; n < LATER; n++) {
      own = passedOn(f, rho[c], own).map((x) => alpha * x);
      const later = n === LATER - 1 ? 1 / (1 - Math.min(0.999, alpha * lambda[c])) : 1;
      own.forEach((x, j) => (sum[j] += later * x));
    }
    return sum;
  }
}

// F times rho times light.
function passedOn(f, rho, light) {
  const count = light.length;
  const sent = light.map((x, j) => x * rho[j]);
  return Float64Array.from({ length: count }, (_, i) => {
    let sum = 0;
    for (let j = 0, at = i * count; j < count; j++, at++) sum += f[at] * sent[j];
    return sum;
  });
}

// The largest eigenvalue of F rho; shifted, so that facing walls do not make the iteration swing.
function eigenvalue(f, rho) {
  let [x, lambda] = [new Float64Array(rho.length).fill(1), 0];
  for (let k = 0; k < PRODUCTS; k++) {
    const next = passedOn(f, rho, x);
    const [all, more] = [x, next].map((v) => v.reduce((sum, y) => sum + y, 0));
    if (!(more > 0)) return 0;
    lambda = more / all;
    x = next.map((y, i) => (y + 0.2 * lambda * x[i]) / more);
  }
  return lambda;
}
