// Mixes the stored layers of light into the two maps that are shown: indirect light, one value a cell, and direct light,
// one value a fine texel. Layers interpolated at the present tau are kept, so that only a change of tau decodes anything.
import { lightOfCodes } from "./numbers.js";

export class Light {
  constructor(scene, arrays) {
    this.scene = scene;
    this.codes = { coarse: arrays.light, fine: arrays.direct };
    this.counts = { coarse: arrays.cellPatch.length, fine: arrays.cellPatch.length * scene.fine ** 2 };
    this.values = lightOfCodes();
    this.layers = new Map();
    this.blend = null;
  }

  // The interpolation whose layers are mixed from now on; those of another tau are filled anew when they are needed.
  interpolate(blend) {
    if (this.blend?.tau === blend.tau) return;
    this.blend = blend;
    for (const layer of this.layers.values()) layer.stale = true;
  }

  // Incident light of term n ≥ 1, lamp l and channel c at the present tau.
  layer(l, n, c) {
    const key = (l * (this.scene.terms + 1) + n) * 3 + c;
    const map = n === 1 ? "fine" : "coarse";
    if (!this.layers.has(key)) this.layers.set(key, { stale: true, numbers: new Float32Array(this.counts[map]) });
    const layer = this.layers.get(key);
    if (layer.stale) this.#fill(layer.numbers, map, l, n, c);
    layer.stale = false;
    return layer.numbers;
  }

  #fill(numbers, map, l, n, c) {
    const { lamps, terms } = this.scene;
    const count = numbers.length;
    numbers.fill(0);
    this.blend.factors[l][n][c].forEach((weight, q) => {
      if (weight === 0) return;
      const lamp = q * lamps.length + l;
      const start = (n === 1 ? lamp * 3 + c : (lamp * (terms - 1) + n - 2) * 3 + c) * count;
      addDecoded(numbers, this.codes[map], start, this.values, weight);
    });
  }

  // The maps at coefficients [n][l][c] and gains [l][c]: three planes each, {coarse: [r, g, b], fine: [r, g, b]}.
  mix(coefficients, gains) {
    const planes = (count) => [0, 1, 2].map(() => new Float32Array(count));
    const sums = { coarse: planes(this.counts.coarse), fine: planes(this.counts.fine) };
    for (let n = 1; n <= this.scene.terms; n++) {
      const map = n === 1 ? sums.fine : sums.coarse;
      gains.forEach((gain, l) => gain.forEach((g, c) => {
        const weight = g * coefficients[n][l][c];
        if (weight !== 0) addScaled(map[c], this.layer(l, n, c), weight);
      }));
    }
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
