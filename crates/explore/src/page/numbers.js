// Decodes the numbers of the scene: a base64 text, deflated, of arrays stored as byte planes and differences.

// The bytes behind a base64 text.
const bytesOfBase64 = (text) => Uint8Array.fromBase64?.(text) ?? Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

// The byte blob behind a base64 text of a zlib stream.
export async function inflated(text) {
  const stream = new Blob([bytesOfBase64(text.trim())]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Two byte planes of zigzag-coded differences modulo 2^16.
function decodeU16(blob, offset, count) {
  const numbers = new Uint16Array(count);
  const high = offset + count;
  for (let i = 0, value = 0; i < count; i++) {
    const z = blob[offset + i] | (blob[high + i] << 8);
    value += (z >>> 1) ^ -(z & 1);
    numbers[i] = value;
  }
  return numbers;
}

// Four byte planes of zigzag-coded differences modulo 2^32.
function decodeU32(blob, offset, count) {
  const numbers = new Uint32Array(count);
  for (let i = 0, at = offset, value = 0; i < count; i++, at++) {
    const z = blob[at] | (blob[at + count] << 8) | (blob[at + 2 * count] << 16) | (blob[at + 3 * count] << 24);
    value = (value + ((z >>> 1) ^ -(z & 1))) | 0;
    numbers[i] = value;
  }
  return numbers;
}

// Four byte planes of little-endian floats.
function decodeF32(blob, offset, count) {
  const bytes = new Uint8Array(4 * count);
  for (let plane = 0; plane < 4; plane++) {
    for (let i = 0, at = offset + plane * count; i < count; i++) bytes[4 * i + plane] = blob[at + i];
  }
  return new Float32Array(bytes.buffer);
}

// Every array of the manifest by its name.
export function decodedArrays(descriptions, blob) {
  const decoders = {
    u8: (bytes, offset, count) => bytes.subarray(offset, offset + count),
    u16: decodeU16, u32: decodeU32, f32: decodeF32, };
  const arrays = {};
  for (const [name, { type, offset, count }] of Object.entries(descriptions)) {
    arrays[name] = decoders[type](blob, offset, count);
  }
  return arrays;
}

// Adds to every layer of codes the layer that it was predicted from, modulo 2^16, in place: that of the node of tau
// before, of the term before, and of green for red and blue. Layers are by tau, lamp, term and channel.
export function restoreLayers(codes, [taus, lamps, terms]) {
  const count = codes.length / (3 * taus * lamps * terms);
  const add = (layer, other) => {
    for (let i = layer * count, j = other * count, end = i + count; i < end; i++, j++) codes[i] += codes[j];
  };
  const perTau = 3 * lamps * terms;
  for (let layer = perTau; layer < taus * perTau; layer++) add(layer, layer - perTau);
  for (let layer = 0; layer < taus * perTau; layer++) if (Math.floor(layer / 3) % terms > 0) add(layer, layer - 3);
  for (let green = 1; green < taus * perTau; green += 3) [green - 1, green + 1].forEach((layer) => add(layer, green));
}

// What each of the 65536 codes of light stands for: 0, or a power of two in steps of 1/256.
export function lightOfCodes() {
  const values = new Float32Array(65536);
  for (let code = 1; code < 65536; code++) values[code] = 2 ** ((code - 32768) / 256);
  return values;
}

// What each of the 256 codes of a form factor stands for.
export function factorsOfCodes() {
  const values = new Float32Array(256);
  for (let code = 1; code < 256; code++) values[code] = 2 ** ((code - 255) / 12);
  return values;
}
