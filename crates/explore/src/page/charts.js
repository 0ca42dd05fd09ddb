// Charts: the surfaces that carry light, their places in an atlas, and their triangles as arrays for WebGL.

const NONE = 0xffffffff;
export const VERTEX_BYTES = 20;

// Places rectangles in shelves: their corners and the size of the atlas.
function shelves(columns, rows) {
  const order = Array.from(columns.keys()).sort((a, b) => rows[b] - rows[a] || columns[b] - columns[a]);
  const area = order.reduce((sum, i) => sum + columns[i] * rows[i], 0);
  const widest = order.reduce((most, i) => Math.max(most, columns[i]), 1);
  const width = Math.max(widest, Math.ceil(Math.sqrt(area * 1.1)));
  const corners = new Uint16Array(2 * columns.length);
  let [x, y, height] = [0, 0, 0];
  for (const i of order) {
    if (x + columns[i] > width) [x, y, height] = [0, y + height, 0];
    corners.set([x, y], 2 * i);
    height = Math.max(height, rows[i]);
    x += columns[i];
  }
  return { corners, size: [width, y + height] };
}

export class Charts {
  constructor(scene, arrays) {
    this.columns = arrays.chartColumns;
    this.rows = arrays.chartRows;
    this.count = this.columns.length;
    this.fineness = scene.fine;
    const { corners, size } = shelves(this.columns, this.rows);
    this.corners = corners;
    this.size = size;
    this.firstCell = this.#firsts((chart) => this.columns[chart] * this.rows[chart]);
    this.firstTriangle = this.#firsts((chart) => arrays.chartTriangles[chart]);
    this.backs = this.#backs(arrays.chartFront);
    this.cellPlaces = this.#places(1);
    this.texelPlaces = this.#places(this.fineness);
  }

  // Sums of a number per chart over all charts before; one more entry holds the total.
  #firsts(numberOf) {
    const firsts = new Uint32Array(this.count + 1);
    for (let chart = 0; chart < this.count; chart++) firsts[chart + 1] = firsts[chart] + numberOf(chart);
    return firsts;
  }

  // The chart on the back of each chart, or -1.
  #backs(fronts) {
    const backs = new Int32Array(this.count).fill(-1);
    fronts.forEach((front, chart) => {
      if (front !== NONE) backs[front] = chart;
    });
    return backs;
  }

  // The texel of the atlas for every cell (fineness 1) or fine texel, chart after chart, row after row.
  #places(fineness) {
    const places = new Uint32Array(this.firstCell[this.count] * fineness ** 2);
    const width = this.size[0] * fineness;
    let i = 0;
    for (let chart = 0; chart < this.count; chart++) {
      const corner = this.corners[2 * chart + 1] * fineness * width + this.corners[2 * chart] * fineness;
      for (let row = 0; row < this.rows[chart] * fineness; row++) {
        const first = corner + row * width;
        for (let column = 0; column < this.columns[chart] * fineness; column++) places[i++] = first + column;
      }
    }
    return places;
  }

  chartOfCell(cell) {
    let [low, high] = [0, this.count];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.firstCell[middle] <= cell) low = middle;
      else high = middle;
    }
    return low;
  }

  // The fine texels of a cell, as indices of the fine map.
  texelsOfCell(cell) {
    const chart = this.chartOfCell(cell);
    const s = this.fineness;
    const [row, column] = [Math.floor((cell - this.firstCell[chart]) / this.columns[chart]),
      (cell - this.firstCell[chart]) % this.columns[chart]];
    const first = this.firstCell[chart] * s * s + row * s * s * this.columns[chart] + column * s;
    return Array.from({ length: s * s }, (_, k) => first + Math.floor(k / s) * s * this.columns[chart] + (k % s));
  }

  // Four RGBA texels a chart for the shaders: frame, size, material, corner in the atlas, back, first cell.
  table(arrays) {
    const table = new Float32Array(16 * this.count);
    for (let chart = 0; chart < this.count; chart++) {
      const frame = arrays.chartFrame.subarray(9 * chart, 9 * chart + 9);
      table.set([
        ...frame.subarray(0, 3), this.columns[chart], ...frame.subarray(3, 6), this.rows[chart],
        ...frame.subarray(6, 9), arrays.chartMaterial[chart],
        this.corners[2 * chart], this.corners[2 * chart + 1], this.backs[chart], this.firstCell[chart], ], 16 * chart);
    }
    return table;
  }
}

// What a material needs beside its numbers: images, colours of corners, or a share of opacity.
function needsOf(material) {
  const images = material.texture !== null || material.glow !== null || (material.mask?.texture ?? null) !== null;
  return { images, colours: material.coloured, detailed: images || material.coloured || material.mask !== null };
}

// A uniform share of opacity is blended with what lies behind; all other masks let through or not.
export function isBlended(material) {
  return material.mask !== null && material.mask.texture === null && material.mask.cutoff === null
    && (material.mask.factor < 1 || material.coloured);
}

// The vertices of all triangles, 20 bytes each: place (3 × f32), lamp (4 bits) and slot (u32), chart (u32). Detailed
// triangles come first, in groups of one material; `details` has 12 bytes for each of their vertices: u, v (f32),
// colour (4 × u8).
export function triangleBuffers(scene, arrays, charts) {
  const needs = scene.materials.map(needsOf);
  const material = arrays.chartMaterial;
  const withTriangles = Array.from(charts.columns.keys()).filter((chart) => arrays.chartTriangles[chart] > 0);
  const group = (chart) => (needs[material[chart]].detailed ? material[chart] : scene.materials.length);
  const order = [...withTriangles].sort((a, b) => group(a) - group(b) || a - b);
  const groups = [];
  let triangles = 0;
  for (const chart of order) {
    if (groups.at(-1)?.material !== group(chart)) groups.push({ material: group(chart), first: triangles, count: 0 });
    groups.at(-1).count += arrays.chartTriangles[chart];
    triangles += arrays.chartTriangles[chart];
  }
  const detailed = groups.filter((g) => g.material < scene.materials.length);
  const plain = groups.find((g) => g.material === scene.materials.length) ?? { first: triangles, count: 0 };
  const vertices = vertexBuffer(arrays, charts, order, triangles);
  return { vertices, details: detailBuffer(arrays, charts, withTriangles, order, needs, plain.first), detailed, plain };
}

function vertexBuffer(arrays, charts, order, triangles) {
  const { x, y, z, corners, lamp, slot } = arrays;
  const buffer = new ArrayBuffer(3 * VERTEX_BYTES * triangles);
  const [floats, words] = [new Float32Array(buffer), new Uint32Array(buffer)];
  let at = 0;
  for (const chart of order) {
    for (let triangle = charts.firstTriangle[chart]; triangle < charts.firstTriangle[chart + 1]; triangle++) {
      const tags = Math.min(lamp[triangle], 15) | (slot[triangle] << 4);
      for (let corner = 3 * triangle; corner < 3 * triangle + 3; corner++, at += 5) {
        const vertex = corners[corner];
        floats[at] = x[vertex];
        floats[at + 1] = y[vertex];
        floats[at + 2] = z[vertex];
        words[at + 3] = tags;
        words[at + 4] = chart;
      }
    }
  }
  return buffer;
}

// Where in textureU and in colours the triangles of each chart begin.
function detailStarts(arrays, charts, withTriangles, needs) {
  const starts = { images: new Map(), colours: new Map() };
  let [images, colours] = [0, 0];
  for (const chart of withTriangles) {
    const need = needs[arrays.chartMaterial[chart]];
    const corners = 3 * (charts.firstTriangle[chart + 1] - charts.firstTriangle[chart]);
    starts.images.set(chart, images);
    starts.colours.set(chart, colours);
    if (need.images) images += corners;
    if (need.colours) colours += corners;
  }
  return starts;
}

function detailBuffer(arrays, charts, withTriangles, order, needs, triangles) {
  const starts = detailStarts(arrays, charts, withTriangles, needs);
  const buffer = new ArrayBuffer(36 * triangles);
  const [floats, bytes] = [new Float32Array(buffer), new Uint8Array(buffer).fill(255)];
  let at = 0;
  for (const chart of order) {
    const need = needs[arrays.chartMaterial[chart]];
    if (!need.detailed) break;
    const corners = 3 * (charts.firstTriangle[chart + 1] - charts.firstTriangle[chart]);
    for (let corner = 0; corner < corners; corner++, at++) {
      const [image, colour] = [starts.images.get(chart) + corner, 4 * (starts.colours.get(chart) + corner)];
      floats[3 * at] = need.images ? arrays.textureU[image] : 0;
      floats[3 * at + 1] = need.images ? arrays.textureV[image] : 0;
      if (need.colours) bytes.set(arrays.colours.subarray(colour, colour + 4), 12 * at + 8);
    }
  }
  return buffer;
}
