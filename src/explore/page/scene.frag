#version 300 es
// Radiance of a point: its emission, and rho times the light that arrives there, read from the two maps within the point's
// chart. With IDS: the number of the cell instead, plus one.
precision highp float;
precision highp int;
in vec3 place;
flat in uvec2 lampAndSlot;
flat in uint front;
uniform highp sampler2D charts;      // four texels a chart
uniform highp sampler2D materials;   // rho and emission of each material
uniform highp sampler2D gains;       // of each lamp, times the coefficient of E; the last is for no lamp
uniform highp sampler2D coarse;      // indirect light
uniform highp sampler2D fine;        // direct light
uniform highp sampler2D cells;       // patch of each cell
uniform highp sampler2D shares;      // what each cell adds to the chosen patch
uniform vec2 scales;                 // of the two maps
uniform float fineness;
uniform float exposure;              // 0: radiance as it is, unclamped
uniform float chosen;                // patch that is outlined, or -1
uniform float largestShare;          // of the row of F that is drawn, or 0
uniform vec3 steps[8];               // colours of the shares, in halves from the largest; sRGB
#ifdef DETAILED
in vec2 uv;
in vec4 colour;
uniform sampler2D image;
uniform sampler2D glow;
uniform sampler2D mask;
uniform vec4 maskChannel;
uniform float maskFactor;
uniform float cutoff;                // shares below are not there; 0 where shares are blended
#endif
#ifdef IDS
out uint result;
#else
out vec4 result;
#endif

vec4 chartTexel(int chart, int k) {
  return texelFetch(charts, ivec2(4 * (chart % 256) + k, chart / 256), 0);
}

vec4 materialTexel(int material, int k) {
  return texelFetch(materials, ivec2(2 * (material % 256) + k, material / 256), 0);
}

float patchAt(vec2 corner, vec2 cell) {
  return texelFetch(cells, ivec2(corner + floor(cell)), 0).x;
}

// Whether the point lies at an edge of its patch: a neighbour a few pixels on is of another patch, or there is none.
bool atEdge(vec2 corner, vec2 cell, vec2 size) {
  vec2 width = max(fwidth(cell) * 2.5, 1e-6);
  for (int k = 0; k < 4; k++) {
    vec2 neighbour = cell + (k < 2 ? vec2(float(2 * k - 1), 0.0) : vec2(0.0, float(2 * k - 5))) * width;
    if (any(lessThan(neighbour, vec2(0.0))) || any(greaterThanEqual(neighbour, size))) return true;
    if (patchAt(corner, neighbour) != chosen) return true;
  }
  return false;
}

vec3 linear(vec3 code) {
  return mix(code / 12.92, pow((code + 0.055) / 1.055, vec3(2.4)), step(0.04045, code));
}

// The colour of a share: one step darker for every halving, with a line between steps of neighbouring cells.
vec3 colourOfShare(vec2 corner, vec2 cell) {
  float share = texelFetch(shares, ivec2(corner + floor(cell)), 0).x;
  int k = share > 0.0 ? clamp(int(floor(log2(largestShare / share))), 0, 7) : 7;
  return linear(steps[7 - k]);
}

void main() {
  float share = 1.0;
#ifdef DETAILED
  share = maskFactor * colour.a;
  if (maskChannel != vec4(0.0)) share *= dot(texture(mask, uv), maskChannel);
  if (share < cutoff) discard;
#endif
  int chart = gl_FrontFacing ? int(front) : int(chartTexel(int(front), 3).z);
  if (chart < 0) {
#ifdef IDS
    result = 0u;
#else
    result = vec4(0.0, 0.0, 0.0, share);
#endif
    return;
  }
  vec4 o = chartTexel(chart, 0), p = chartTexel(chart, 1), q = chartTexel(chart, 2), atlas = chartTexel(chart, 3);
  vec2 size = vec2(o.w, p.w);
  bool gridless = p.xyz == vec3(0.0) && q.xyz == vec3(0.0);
  vec3 offset = place - o.xyz;
  vec2 cell = clamp(vec2(dot(p.xyz, offset), dot(q.xyz, offset)), vec2(0.0), size - 1e-4);
#ifdef IDS
  result = uint(atlas.w + floor(cell.y) * size.x + floor(cell.x)) + 1u;
#else
  if (gridless) cell = vec2(0.5);
  float slot = float(lampAndSlot.y);
  vec2 texel = gridless ? vec2(mod(slot, fineness), floor(slot / fineness)) + 0.5 : cell * fineness;
  vec2 indirectAt = (atlas.xy + clamp(cell, vec2(0.5), size - 0.5)) / vec2(textureSize(coarse, 0));
  vec2 directAt = (atlas.xy * fineness + clamp(texel, vec2(0.5), size * fineness - 0.5)) / vec2(textureSize(fine, 0));
  vec3 light = scales.x * textureLod(coarse, indirectAt, 0.0).rgb + scales.y * textureLod(fine, directAt, 0.0).rgb;
  vec3 rho = materialTexel(int(q.w), 0).rgb;
  vec3 emission = materialTexel(int(q.w), 1).rgb;
#ifdef DETAILED
  rho *= texture(image, uv).rgb * colour.rgb;
  emission *= texture(glow, uv).rgb;
#endif
  vec3 radiance = emission * texelFetch(gains, ivec2(int(lampAndSlot.x), 0), 0).rgb + rho * light;
  if (exposure > 0.0) radiance = clamp(radiance * exposure, 0.0, 1.0);
  if (largestShare > 0.0) radiance = colourOfShare(atlas.xy, cell);
  if (chosen >= 0.0 && patchAt(atlas.xy, cell) == chosen) {
    bool stripe = fract((gl_FragCoord.x + gl_FragCoord.y) / 14.0) < 0.18;
    if (gridless ? stripe : atEdge(atlas.xy, cell, size)) radiance = vec3(1.0, 0.62, 0.1);
  }
  result = vec4(radiance, share);
#endif
}
