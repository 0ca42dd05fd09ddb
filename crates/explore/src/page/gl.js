// Small helpers for WebGL2: programs with their uniforms, textures, and pictures to draw into.

function compiled(gl, type, name, defines) {
  const source = document.getElementById(name).textContent.trim().split("\n");
  const shader = gl.createShader(type);
  const lines = [source[0], ...defines.map((define) => `#define ${define}`), ...source.slice(1)];
  gl.shaderSource(shader, lines.join("\n"));
  gl.compileShader(shader);
  return shader;
}

// A program of two shaders, with the place and type of each of its uniforms.
export function program(gl, vertex, fragment, defines = []) {
  const handle = gl.createProgram();
  gl.attachShader(handle, compiled(gl, gl.VERTEX_SHADER, vertex, defines));
  const shader = compiled(gl, gl.FRAGMENT_SHADER, fragment, defines);
  gl.attachShader(handle, shader);
  gl.linkProgram(handle);
  if (!gl.getProgramParameter(handle, gl.LINK_STATUS)) {
    throw new Error(`${fragment}: ${gl.getProgramInfoLog(handle)} ${gl.getShaderInfoLog(shader)}`);
  }
  const uniforms = new Map();
  for (let i = 0; i < gl.getProgramParameter(handle, gl.ACTIVE_UNIFORMS); i++) {
    const { name, type } = gl.getActiveUniform(handle, i);
    uniforms.set(name.replace("[0]", ""), { type, location: gl.getUniformLocation(handle, name) });
  }
  return { handle, uniforms };
}

// Uses a program and sets those uniforms that it has.
export function use(gl, { handle, uniforms }, values) {
  gl.useProgram(handle);
  for (const [name, value] of Object.entries(values)) {
    const uniform = uniforms.get(name);
    if (!uniform) continue;
    if (uniform.type === gl.FLOAT) gl.uniform1f(uniform.location, value);
    else if (uniform.type === gl.FLOAT_VEC2) gl.uniform2fv(uniform.location, value);
    else if (uniform.type === gl.FLOAT_VEC3) gl.uniform3fv(uniform.location, value);
    else if (uniform.type === gl.FLOAT_VEC4) gl.uniform4fv(uniform.location, value);
    else if (uniform.type === gl.FLOAT_MAT4) gl.uniformMatrix4fv(uniform.location, false, value);
    else gl.uniform1i(uniform.location, value);
  }
}

// A texture of numbers; `texels` has as many channels as the format.
export function numberTexture(gl, internal, width, height, texels, filter) {
  const handle = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, handle);
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, filter);
  for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
  const texture = { handle, internal, width, height };
  refill(gl, texture, texels);
  return texture;
}

export function refill(gl, { handle, internal, width, height }, texels) {
  gl.bindTexture(gl.TEXTURE_2D, handle);
  const format = internal === gl.R32F ? gl.RED : gl.RGBA;
  gl.texImage2D(gl.TEXTURE_2D, 0, internal, width, height, 0, format, gl.FLOAT, texels);
}

// An RGBA32F table of rows of at most `perRow` texels.
export function tableTexture(gl, table, perRow) {
  const height = Math.max(1, Math.ceil(table.length / 4 / perRow));
  const padded = new Float32Array(4 * perRow * height);
  padded.set(table);
  return numberTexture(gl, gl.RGBA32F, perRow, height, padded, gl.NEAREST);
}

// A texture of an image: colours are sRGB, the numbers of a mask are taken as they are.
export function imageTexture(gl, image, { wrap, nearest }, internal) {
  const handle = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, handle);
  gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
  gl.texImage2D(gl.TEXTURE_2D, 0, internal, gl.RGBA, gl.UNSIGNED_BYTE, image);
  gl.generateMipmap(gl.TEXTURE_2D);
  const wraps = { repeat: gl.REPEAT, mirror: gl.MIRRORED_REPEAT, clamp: gl.CLAMP_TO_EDGE };
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, wraps[wrap[0]]);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, wraps[wrap[1]]);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, nearest ? gl.NEAREST : gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, nearest ? gl.NEAREST : gl.LINEAR_MIPMAP_LINEAR);
  return { handle };
}

// Something to draw into: a texture with depth, and with samples > 0 a buffer of several samples a pixel before it.
export function target(gl, internal, width, height, samples = 0) {
  const picture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, picture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, internal, width, height);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  const resolved = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, resolved);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, picture, 0);
  const drawn = samples > 0 ? gl.createFramebuffer() : resolved;
  gl.bindFramebuffer(gl.FRAMEBUFFER, drawn);
  const buffers = [gl.DEPTH_COMPONENT24, ...(samples > 0 ? [internal] : [])].map((format) => {
    const buffer = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
    gl.renderbufferStorageMultisample(gl.RENDERBUFFER, samples, format, width, height);
    const place = format === internal ? gl.COLOR_ATTACHMENT0 : gl.DEPTH_ATTACHMENT;
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffer);
    return buffer;
  });
  return { drawn, resolved, picture, buffers, width, height, samples, internal };
}

// Makes the texture of a target hold what was drawn with several samples a pixel.
export function resolve(gl, { drawn, resolved, width, height }) {
  if (drawn === resolved) return;
  gl.bindFramebuffer(gl.READ_FRAMEBUFFER, drawn);
  gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, resolved);
  gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
}

export function dispose(gl, { drawn, resolved, picture, buffers }) {
  for (const buffer of buffers) gl.deleteRenderbuffer(buffer);
  for (const framebuffer of new Set([drawn, resolved])) gl.deleteFramebuffer(framebuffer);
  gl.deleteTexture(picture);
}
