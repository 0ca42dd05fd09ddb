// Patches in numbers: the light on a patch, its power per bounce, and its row of F: where its light comes from.
import { factorsOfCodes } from "./numbers.js";

const NO_LAMP = 255;

export class Patches {
  constructor(scene, arrays, charts) {
    Object.assign(this, { scene, arrays, charts });
    this.count = arrays.patchArea.length;
    this.factors = factorsOfCodes();
    this.lamps = this.#lamps();
    this.cellCounts = new Uint32Array(this.count);
    arrays.cellPatch.forEach((patch) => (this.cellCounts[patch] += 1));
  }

  // The lamp whose emission a patch has, or NO_LAMP: that of the first emitting triangle of its chart.
  #lamps() {
    const { arrays, charts } = this;
    const lamps = new Uint8Array(this.count).fill(NO_LAMP);
    for (let chart = 0; chart < charts.count; chart++) {
      const front = arrays.chartFront[chart] === 0xffffffff ? chart : arrays.chartFront[chart];
      const own = arrays.lamp.subarray(charts.firstTriangle[front], charts.firstTriangle[front + 1]);
      const lamp = own.find((l) => l !== NO_LAMP);
      if (lamp === undefined) continue;
      for (let cell = charts.firstCell[chart]; cell < charts.firstCell[chart + 1]; cell++) {
        lamps[arrays.cellPatch[cell]] = lamp;
      }
    }
    return lamps;
  }

  cellsOf(patch) {
    const cells = [];
    this.arrays.cellPatch.forEach((owner, cell) => {
      if (owner === patch) cells.push(cell);
    });
    return cells;
  }

  rho(patch) {
    const factor = this.reflectances?.[this.arrays.patchMaterial[patch]] ?? 1;
    return [...this.arrays.patchRho.subarray(3 * patch, 3 * patch + 3)].map((x) => factor * x);
  }

  // Radiance that a patch emits with the lamps at their gains: what is seen of it, or what it `sends`.
  emission(patch, gains, half = "emission") {
    const emission = this.scene.materials[this.arrays.patchMaterial[patch]][half];
    const lamp = this.lamps[patch];
    return emission.map((x, c) => (lamp === NO_LAMP ? 0 : x * gains[lamp][c]));
  }

  // The mean of one plane of a map over the cells of a patch.
  #meanOfCells(plane, cells, isFine) {
    const texels = isFine ? cells.flatMap((cell) => this.charts.texelsOfCell(cell)) : cells;
    return texels.reduce((sum, i) => sum + plane[i], 0) / Math.max(1, texels.length);
  }

  // L of a patch in the picture, per channel: its emission and rho times the mixed light.
  radiance(patch, sums, mixed, gains) {
    const cells = this.cellsOf(patch);
    const rho = this.rho(patch);
    const shown = mixed.coefficients[0][0]?.[0] ?? 0;
    return this.emission(patch, gains).map((e, c) => shown * e + rho[c]
      * (this.#meanOfCells(sums.coarse[c], cells, false) + this.#meanOfCells(sums.fine[c], cells, true)));
  }

  // The power of every term on a patch [n][c] in W.
  powers(patch, light, gains, alphas) {
    const cells = this.cellsOf(patch);
    const rho = this.rho(patch);
    const size = Math.PI * this.arrays.patchArea[patch];
    const emitted = this.emission(patch, gains).map((e) => size * e);
    const terms = Array.from({ length: this.scene.terms }, (_, i) => i + 1).map((n) => [0, 1, 2].map((c) =>
      gains.reduce((sum, gain, l) => gain[c] === 0 ? sum
        : sum + gain[c] * this.#meanOfCells(light.layer(l, n, c), cells, n === 1), 0)
      * size * rho[c] * alphas[c] ** (n - 1)));
    return [emitted, ...terms];
  }

  // Areas of coarse patches, and their reflectance [c] where materials have factors [m]; those of the sky are 0.
  coarseRho(factors) {
    const { arrays, count } = this;
    const areas = new Float64Array(this.scene.coarse.count);
    const rho = [0, 1, 2].map(() => new Float64Array(areas.length));
    for (let patch = 0; patch < count; patch++) {
      const [j, factor] = [arrays.patchCoarse[patch], factors?.[arrays.patchMaterial[patch]] ?? 1];
      areas[j] += arrays.patchArea[patch];
      rho.forEach((own, c) => (own[j] += arrays.patchArea[patch] * factor * arrays.patchRho[3 * patch + c]));
    }
    return { areas, rho: rho.map((own) => own.map((x, j) => (areas[j] > 0 ? x / areas[j] : 0))) };
  }

  // Means over coarse patches of light in texels.
  coarseMean(plane) {
    const { arrays, scene } = this;
    const [sums, counts] = [new Float64Array(scene.coarse.count), new Float64Array(scene.coarse.count)];
    this.texels ??= Array.from(arrays.cellPatch, (_, cell) => this.charts.texelsOfCell(cell));
    arrays.cellPatch.forEach((patch, cell) => {
      const share = arrays.patchArea[patch] / this.cellCounts[patch];
      counts[arrays.patchCoarse[patch]] += share;
      for (const texel of this.texels[cell]) sums[arrays.patchCoarse[patch]] += share * plane[texel] / scene.fine ** 2;
    });
    return sums.map((sum, j) => (counts[j] > 0 ? sum / counts[j] : 0));
  }

  // F between coarse patches at tau, row by row.
  matrixOfF(tau) {
    const { count, depths } = this.scene.coarse;
    const powers = Array.from({ length: depths }, (_, k) => tau ** k);
    return Float64Array.from({ length: count * count }, (_, at) =>
      powers.reduce((sum, power, k) => sum + power * this.factors[this.arrays.rows[k * count * count + at]], 0));
  }

  // L of every coarse patch as the mean of r, g, b, from the light that travels.
  #coarseLight(sums, coefficient, gains) {
    const { scene, arrays, charts } = this;
    const [cells, light] = [new Float64Array(this.count), new Float64Array(3 * this.count)];
    arrays.cellPatch.forEach((patch) => (cells[patch] += 1));
    const perTexel = 1 / scene.fine ** 2;
    arrays.cellPatch.forEach((patch, cell) => {
      const texels = charts.texelsOfCell(cell);
      for (let c = 0; c < 3; c++) {
        const direct = texels.reduce((sum, texel) => sum + sums.fine[c][texel], 0) * perTexel;
        light[3 * patch + c] += (sums.coarse[c][cell] + direct) / cells[patch];
      }
    });
    const [areas, powers] = [new Float64Array(scene.coarse.count), new Float64Array(scene.coarse.count)];
    for (let patch = 0; patch < this.count; patch++) {
      const [area, coarse, rho] = [arrays.patchArea[patch], arrays.patchCoarse[patch], this.rho(patch)];
      const sent = this.emission(patch, gains, "sends");
      const leaving = sent.map((e, c) => coefficient * e + rho[c] * light[3 * patch + c]);
      areas[coarse] += area;
      powers[coarse] += (area * (leaving[0] + leaving[1] + leaving[2])) / 3;
    }
    return powers.map((power, j) => (areas[j] > 0 ? power / areas[j] : this.#skyLight(j, coefficient, gains)));
  }

  #skyLight(j, coefficient, gains) {
    const { sky, coarse } = this.scene;
    if (coarse.objects[j] >= 0 || !sky) return 0;
    const [r, g, b] = sky.radiances[-1 - coarse.objects[j]].map((x, c) => x * gains[sky.lamp][c]);
    return (coefficient * (r + g + b)) / 3;
  }

  // Row i of F at tau: what share of the cosine-weighted directions from a patch meets each coarse patch.
  rowOfF(patch, tau) {
    const { count, depths } = this.scene.coarse;
    const i = this.arrays.patchCoarse[patch];
    return Float64Array.from({ length: count }, (_, j) => {
      let f = 0;
      for (let k = depths - 1; k >= 0; k--) f = f * tau + this.factors[this.arrays.rows[(k * count + i) * count + j]];
      return f;
    });
  }

  // Where the light of a patch comes from: F_ij L_j of every coarse patch, as shares of all that arrives.
  sharesOfLight(patch, tau, travelling, gains, coefficient) {
    const light = this.#coarseLight(travelling, coefficient, gains);
    const arriving = this.rowOfF(patch, tau).map((f, j) => Math.max(0, f * light[j]));
    const total = arriving.reduce((sum, x) => sum + x, 0);
    return total > 0 ? arriving.map((x) => x / total) : arriving;
  }

  // Shares of coarse patches by the object they belong to, largest first: [{name, share}].
  byObject(shares) {
    const { coarse, objects } = this.scene;
    const sums = new Map();
    shares.forEach((share, j) => {
      const name = coarse.objects[j] < 0 ? "the sky" : objects[coarse.objects[j]];
      sums.set(name, (sums.get(name) ?? 0) + share);
    });
    return [...sums].map(([name, share]) => ({ name, share })).sort((a, b) => b.share - a.share);
  }

  // A number of coarse patches for every cell.
  toCells(numbers) {
    const { cellPatch, patchCoarse } = this.arrays;
    return Float32Array.from(cellPatch, (patch) => numbers[patchCoarse[patch]]);
  }
}
