// The picture: what is uploaded to WebGL2, how the scene is drawn, and what is read back.
import { atlasTexels } from "./light.js";
import { VERTEX_BYTES, isBlended } from "./charts.js";
import { dispose, imageTexture, numberTexture, program, refill, resolve, tableTexture, target, use } from "./gl.js";

const UNITS = ["charts", "materials", "gains", "coarse", "fine", "cells", "shares", "image", "glow", "mask"];

// The images of the scene, decoded.
export function loadedImages(textures) {
  return Promise.all(textures.map(async ({ url }) => {
    const image = new Image();
    image.src = url;
    await image.decode();
    return image;
  }));
}

export class View {
  constructor(gl, scene, arrays, charts, buffers, images) {
    Object.assign(this, { gl, scene, charts, buffers, images });
    this.programs = {
      plain: program(gl, "scene.vert", "scene.frag"), ids: program(gl, "scene.vert", "scene.frag", ["IDS"]),
      sky: program(gl, "quad.vert", "sky.frag"), encode: program(gl, "quad.vert", "encode.frag"), };
    if (buffers.detailed.length > 0) {
      this.programs.detailed = program(gl, "scene.vert", "scene.frag", ["DETAILED"]);
      this.programs.detailedIds = program(gl, "scene.vert", "scene.frag", ["DETAILED", "IDS"]);
    }
    this.targets = new Map();
    this.pictures = new Map();
    this.overlay = { chosen: -1, largestShare: 0, steps: new Float32Array(24) };
    this.#uploadTables(arrays);
    this.#uploadTriangles();
  }

  #uploadTables(arrays) {
    const { gl, charts } = this;
    const [width, height] = charts.size;
    const s = charts.fineness;
    const patches = new Float32Array(width * height).fill(-1);
    charts.cellPlaces.forEach((place, cell) => (patches[place] = arrays.cellPatch[cell]));
    this.textures = {
      charts: tableTexture(gl, charts.table(arrays), 1024), materials: tableTexture(gl, this.#materials([]), 512),
      gains: tableTexture(gl, new Float32Array(4), 256),
      coarse: numberTexture(gl, gl.RGBA16F, width, height, null, gl.LINEAR),
      fine: numberTexture(gl, gl.RGBA16F, width * s, height * s, null, gl.LINEAR),
      cells: numberTexture(gl, gl.R32F, width, height, patches, gl.NEAREST),
      shares: numberTexture(gl, gl.R32F, width, height, null, gl.NEAREST), };
    const white = numberTexture(gl, gl.RGBA32F, 1, 1, new Float32Array([1, 1, 1, 1]), gl.NEAREST);
    Object.assign(this.textures, { image: white, glow: white, mask: white, white, sky: this.#skyTexture() });
    this.shares = new Float32Array(width * height);
    this.texels = { coarse: new Float32Array(4 * width * height), fine: new Float32Array(4 * width * height * s * s) };
  }

  // A row of texels for each of the sky's: its lower edge and how many cells it has, then their radiances.
  #skyTexture() {
    const { gl, scene } = this;
    if (!scene.sky) return null;
    const { rows, radiances } = scene.sky;
    const width = 1 + Math.max(...rows.map(({ cells }) => cells));
    const texels = new Float32Array(4 * width * rows.length);
    rows.forEach(({ low, before, cells }, row) => {
      texels.set([low, cells], 4 * width * row);
      for (let k = 0; k < cells; k++) texels.set(radiances[before + k], 4 * (width * row + 1 + k));
    });
    return numberTexture(gl, gl.RGBA32F, width, rows.length, texels, gl.NEAREST);
  }

  // Reflectance and emission of the materials, where reflectances have factors [m].
  #materials(factors) {
    const { materials } = this.scene;
    const table = new Float32Array(2048 * Math.ceil(materials.length / 256));
    materials.forEach(({ rho, emission }, m) =>
      table.set([...rho.map((x) => x * (factors[m] ?? 1)), 0, ...emission, 0], 8 * m));
    return table;
  }

  setReflectances(factors) { refill(this.gl, this.textures.materials, this.#materials(factors)); }

  #uploadTriangles() {
    const { gl, buffers } = this;
    const upload = (bytes) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, bytes, gl.STATIC_DRAW);
      return buffer;
    };
    const vertices = upload(buffers.vertices);
    const details = upload(buffers.details);
    this.vertexArrays = { plain: this.#vertexArray(vertices, null), detailed: this.#vertexArray(vertices, details) };
    buffers.vertices = buffers.details = null;
  }

  #vertexArray(vertices, details) {
    const { gl } = this;
    const vertexArray = gl.createVertexArray();
    gl.bindVertexArray(vertexArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, vertices);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, VERTEX_BYTES, 0);
    gl.vertexAttribIPointer(1, 1, gl.UNSIGNED_INT, VERTEX_BYTES, 12);
    gl.vertexAttribIPointer(2, 1, gl.UNSIGNED_INT, VERTEX_BYTES, 16);
    for (let i = 0; i < 3; i++) gl.enableVertexAttribArray(i);
    if (!details) return vertexArray;
    gl.bindBuffer(gl.ARRAY_BUFFER, details);
    gl.vertexAttribPointer(3, 2, gl.FLOAT, false, 12, 0);
    gl.vertexAttribPointer(4, 4, gl.UNSIGNED_BYTE, true, 12, 8);
    for (let i = 3; i < 5; i++) gl.enableVertexAttribArray(i);
    return vertexArray;
  }

  // Shows the mixed light; `emission` [l][c] are the gains times the coefficient of E.
  setLight(sums, emission) {
    const { gl, charts } = this;
    const [width, height] = charts.size;
    const s = charts.fineness;
    const coarse = atlasTexels(sums.coarse, charts.cellPlaces, [width, height], this.texels.coarse);
    const fine = atlasTexels(sums.fine, charts.texelPlaces, [width * s, height * s], this.texels.fine);
    refill(gl, this.textures.coarse, coarse.texels);
    refill(gl, this.textures.fine, fine.texels);
    const gains = new Float32Array(1024);
    emission.forEach((gain, l) => gains.set(gain, 4 * l));
    refill(gl, this.textures.gains, gains);
    this.scales = [coarse.scale, fine.scale];
    this.emission = emission;
  }

  // Draws a number per cell in colour steps instead of light; null: light again.
  setShares(shareOfCell, largest, steps) {
    this.overlay.largestShare = shareOfCell ? largest : 0;
    if (!shareOfCell) return;
    this.charts.cellPlaces.forEach((place, cell) => (this.shares[place] = shareOfCell[cell]));
    refill(this.gl, this.textures.shares, this.shares);
    this.overlay.steps = steps;
  }

  // A target that is kept for the next picture of the same use and size.
  #target(purpose, internal, width, height, samples = 0) {
    const { gl } = this;
    const old = this.targets.get(purpose);
    if (old && old.width === width && old.height === height && old.samples === samples) return old;
    if (old) dispose(gl, old);
    const made = target(gl, internal, width, height, samples);
    this.targets.set(purpose, made);
    return made;
  }

  #bindTextures(names = UNITS) {
    const { gl } = this;
    for (const name of names) {
      gl.activeTexture(gl.TEXTURE0 + UNITS.indexOf(name));
      gl.bindTexture(gl.TEXTURE_2D, this.textures[name].handle);
    }
    gl.activeTexture(gl.TEXTURE0 + UNITS.length);
  }

  // An image as a texture, made when it is first needed; `use` is "colours" or "numbers".
  #picture(t, kind) {
    if (t === null) return this.textures.white;
    const key = `${t} ${kind}`;
    if (!this.pictures.has(key)) {
      const internal = kind === "colours" ? this.gl.SRGB8_ALPHA8 : this.gl.RGBA8;
      this.pictures.set(key, imageTexture(this.gl, this.images[t], this.scene.textures[t], internal));
    }
    return this.pictures.get(key);
  }

  #uniforms(camera, exposure, overlay) {
    const units = Object.fromEntries(UNITS.map((name, unit) => [name, unit]));
    const { scales, charts } = this;
    return { ...units, camera: camera.matrix, scales, fineness: charts.fineness, exposure, ...overlay };
  }

  #drawDetailed(shader, group) {
    const { gl, scene } = this;
    const { texture, glow, mask } = scene.materials[group.material];
    this.textures.image = this.#picture(texture, "colours");
    this.textures.glow = this.#picture(glow, "colours");
    this.textures.mask = this.#picture(mask?.texture ?? null, "numbers");
    this.#bindTextures(["image", "glow", "mask"]);
    const hasImage = (mask?.texture ?? null) !== null;
    const blended = isBlended(scene.materials[group.material]);
    use(gl, shader, {
      maskChannel: [hasImage ? 1 : 0, 0, 0, 0], maskFactor: mask?.factor ?? 1,
      cutoff: mask === null || blended ? -1 : mask.cutoff ?? (hasImage ? 0.5 : 0), });
    gl.drawArrays(gl.TRIANGLES, 3 * group.first, 3 * group.count);
  }

  // The triangles into what is bound: fronts and, unless they are culled, backs of all that is opaque, then of all that
  // is blended with what lies behind.
  #drawTriangles(shaders, uniforms, isCulled) {
    const { gl, buffers, vertexArrays, scene } = this;
    const sides = isCulled ? [false] : [false, true];
    const isBehind = (group) => isBlended(scene.materials[group.material]);
    this.#bindTextures();
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    // Where front and back meet at a silhouette the front is seen.
    gl.polygonOffset(1, 4);
    for (const isBack of sides) {
      gl.cullFace(isBack ? gl.FRONT : gl.BACK);
      if (isBack) gl.enable(gl.POLYGON_OFFSET_FILL);
      use(gl, shaders[0], { ...uniforms, isBack });
      gl.bindVertexArray(vertexArrays.plain);
      gl.drawArrays(gl.TRIANGLES, 3 * buffers.plain.first, 3 * buffers.plain.count);
      this.#drawGroups(shaders[1], buffers.detailed.filter((group) => !isBehind(group)), { ...uniforms, isBack });
    }
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE);
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    for (const isBack of sides) {
      gl.cullFace(isBack ? gl.FRONT : gl.BACK);
      this.#drawGroups(shaders[1], buffers.detailed.filter(isBehind), { ...uniforms, isBack });
    }
    gl.depthMask(true);
    for (const what of [gl.BLEND, gl.CULL_FACE, gl.DEPTH_TEST, gl.POLYGON_OFFSET_FILL]) gl.disable(what);
  }

  #drawGroups(shader, groups, uniforms) {
    if (groups.length === 0) return;
    use(this.gl, shader, uniforms);
    this.gl.bindVertexArray(this.vertexArrays.detailed);
    for (const group of groups) this.#drawDetailed(shader, group);
  }

  #drawSky(camera, exposure) {
    const { gl, scene } = this;
    if (!scene.sky || camera.culled) return;
    gl.activeTexture(gl.TEXTURE0 + UNITS.length);
    gl.bindTexture(gl.TEXTURE_2D, this.textures.sky.handle);
    use(gl, this.programs.sky, {
      forward: camera.forward, right: camera.right.map((x) => x * camera.tangents[0]),
      above: camera.up.map((x) => x * camera.tangents[1]), skyUp: scene.sky.up, north: scene.sky.north,
      sky: UNITS.length, gain: this.emission[scene.sky.lamp], exposure, });
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  // Sky and triangles into a target.
  #drawScene(into, camera, exposure, overlay) {
    const { gl, programs } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, into.drawn);
    gl.viewport(0, 0, into.width, into.height);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.#drawSky(camera, exposure);
    this.#drawTriangles([programs.plain, programs.detailed], this.#uniforms(camera, exposure, overlay), camera.culled);
  }

  // A picture in sRGB codes into a framebuffer (null: the canvas), by way of a target that blends linear light.
  #drawEncoded(framebuffer, purpose, width, height, samples, camera, stops, overlay) {
    const { gl, programs } = this;
    const shown = this.#target(purpose, gl.SRGB8_ALPHA8, width, height, samples);
    this.#drawScene(shown, camera, 2 ** stops, overlay);
    resolve(gl, shown);
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.viewport(0, 0, width, height);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, shown.picture);
    use(gl, programs.encode, { picture: 0 });
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  // The picture on the canvas.
  draw(camera, stops, samples = 4) {
    const { gl } = this;
    const { width, height } = gl.canvas;
    this.#drawEncoded(null, "canvas", width, height, samples, camera, stops, this.overlay);
  }

  // Reads images at points, without the means over squares that a pixel sees of them; or with those again.
  readImagesAt(points) {
    const { gl } = this;
    for (const [key, { handle }] of this.pictures) {
      const { nearest } = this.scene.textures[parseInt(key, 10)] ?? {};
      if (nearest !== false) continue;
      gl.bindTexture(gl.TEXTURE_2D, handle);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, points ? gl.LINEAR : gl.LINEAR_MIPMAP_LINEAR);
    }
  }

  // A picture without overlays as bytes RGBA, the lowest row first.
  readPicture(width, height, camera, stops, samples = 0) {
    const { gl } = this;
    const codes = this.#target("codes", gl.RGBA8, width, height);
    const none = { ...this.overlay, chosen: -1, largestShare: 0 };
    this.#drawEncoded(codes.drawn, "picture", width, height, samples, camera, stops, none);
    const pixels = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels;
  }

  // Linear radiance as floats RGBA, the lowest row first.
  readLinear(width, height, camera) {
    const { gl } = this;
    const whole = gl.getExtension("EXT_color_buffer_float");
    if (!whole && !gl.getExtension("EXT_color_buffer_half_float")) throw new Error("no framebuffer of floats");
    if (whole) gl.getExtension("EXT_float_blend");
    const linear = this.#target("linear", whole ? gl.RGBA32F : gl.RGBA16F, width, height);
    this.#drawScene(linear, camera, 0, { ...this.overlay, chosen: -1, largestShare: 0 });
    const pixels = new Float32Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, pixels);
    return pixels;
  }

  // The number of the cell seen in a pixel of the canvas (from its lower left), or -1.
  cellAt(x, y, camera) {
    const { gl, programs } = this;
    const one = this.#target("cell", gl.R32UI, 1, 1);
    gl.bindFramebuffer(gl.FRAMEBUFFER, one.drawn);
    gl.viewport(-x, -y, gl.canvas.width, gl.canvas.height);
    gl.clearBufferuiv(gl.COLOR, 0, [0, 0, 0, 0]);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    this.#drawTriangles([programs.ids, programs.detailedIds], this.#uniforms(camera, 0, this.overlay), camera.culled);
    const cell = new Uint32Array(4);
    gl.readPixels(0, 0, 1, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, cell);
    return cell[0] - 1;
  }
}
