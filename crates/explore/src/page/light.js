// Mixes the stored layers of light into the two maps that are shown: indirect light, one value a cell, and direct
// light, one value a fine texel. Layers interpolated at the present tau are kept: only another tau decodes anything.
import { lightOfCodes, restoreLayers } from "./numbers.js";

export class Light {
  constructor(scene, arrays) {
    this.scene = scene;
    const [taus, lamps] = [scene.taus.length, scene.lamps.length];
    restoreLayers(arrays.light, [taus, lamps, scene.terms - 1]);
    restoreLayers(arrays.direct, [taus, lamps, 1]);
    restoreLayers(arrays.dominant, [taus, 1, 1]);
    this.codes = { coarse: arrays.light, fine: arrays.direct, dominant: arrays.dominant };
    this.counts = { coarse: arrays.cellPatch.length, fine: arrays.cellPatch.length * scene.fine ** 2 };
    this.values = lightOfCodes();
    this.layers = new Map();
    this.blend = null;
  }

  // The interpolation whose layers are mixed from now on; those of another tau are filled anew when they are needed.
  interpolate(blend) {
    if (this.blend?.tau === blend.tau) return;
    this.blend = blend;
    for (const layer of this.layers.values()) layer.isStale = true;
  }

  // Ratios [n][l][c] and of the rest [c] by coarse patch that reflected light is multiplied by from now on, or none.
  setRatios({ ratios, rest }, coarseOfCell) {
    if (this.ratios === ratios && this.rest === rest) return;
    Object.assign(this, { ratios, rest, coarseOfCell });
    for (const [key, layer] of this.layers) if (!key.includes(" 1 ")) layer.isStale = true;
  }

  // Incident light of term n ≥ 1, lamp l and channel c at the present tau.
  layer(l, n, c) {
    const { lamps, terms } = this.scene;
    const weights = this.blend.factors[l][n][c];
    const indexOf = (q) => {
      const lamp = q * lamps.length + l;
      return n === 1 ? 3 * lamp + c : 3 * (lamp * (terms - 1) + n - 2) + c;
    };
    const ratio = n > 1 ? this.ratios?.[n][l][c] : null;
    return this.#interpolated(`${l} ${n} ${c}`, n === 1 ? "fine" : "coarse", weights, indexOf, ratio);
  }

  // Incident light of the dominant eigenvector of K at the present tau.
  dominantLayer(c) {
    return this.#interpolated(`dominant ${c}`, "dominant", this.blend.weights, (q) => 3 * q + c, this.rest?.[c]);
  }

  // The sum of the nodes' layers times their weights; it is kept until tau changes.
  #interpolated(key, kind, weights, indexOf, ratio) {
    const count = this.counts[kind === "fine" ? "fine" : "coarse"];
    if (!this.layers.has(key)) this.layers.set(key, { isStale: true, numbers: new Float32Array(count) });
    const layer = this.layers.get(key);
    if (!layer.isStale) return layer.numbers;
    layer.isStale = false;
    layer.numbers.fill(0);
    weights.forEach((weight, q) => {
      if (weight !== 0) addDecoded(layer.numbers, this.codes[kind], indexOf(q) * count, this.values, weight);
    });
    if (ratio) this.coarseOfCell.forEach((j, i) => (layer.numbers[i] *= ratio[j]));
    return layer.numbers;
  }

  // The maps at coefficients [n][l][c] of the terms, gains [l][c], and coefficients [c] of the dominant eigenvector:
  // three planes each, {coarse: [r, g, b], fine: [r, g, b]}.
  mix({ coefficients, dominant }, gains) {
    const planes = (count) => [0, 1, 2].map(() => new Float32Array(count));
    const sums = { coarse: planes(this.counts.coarse), fine: planes(this.counts.fine) };
    for (let n = 1; n <= this.scene.terms; n++) {
      const map = n === 1 ? sums.fine : sums.coarse;
      gains.forEach((gain, l) => gain.forEach((g, c) => {
        const weight = g * coefficients[n][l][c];
        if (weight !== 0) addScaled(map[c], this.layer(l, n, c), weight);
      }));
    }
    dominant.forEach((weight, c) => {
      if (weight !== 0) addScaled(sums.coarse[c], this.dominantLayer(c), weight);
    });
    return sums;
  }
}

function addDecoded(sum, codes, start, values, weight) {
  for (let i = 0; i < sum.length; i++) sum[i] += weight * values[codes[start + i]];
}

function addScaled(sum, layer, weight) {
  for (let i = 0; i < sum.length; i++) sum[i] += weight * layer[i];
}

// Three planes as texels of an atlas, scaled so that half floats hold them: {texels, scale}, value = texel × scale.
export function atlasTexels(planes, places, size, texels) {
  let largest = 0;
  for (const plane of planes) for (let i = 0; i < plane.length; i++) largest = Math.max(largest, Math.abs(plane[i]));
  const scale = largest > 0 ? largest / 32768 : 1;
  const out = texels ?? new Float32Array(4 * size[0] * size[1]);
  planes.forEach((plane, c) => {
    for (let i = 0; i < plane.length; i++) out[4 * places[i] + c] = plane[i] / scale;
  });
  return { texels: out, scale };
}
