#version 300 es
// Radiance of a point: its emission, and rho times the light that arrives there, read from two maps. With IDS: the
// number of the point's cell plus one instead.
precision highp float;
precision highp int;
in vec2 cell;
flat in vec4 rectangle;
flat in float firstCell;
flat in vec2 fixedTexel;
flat in vec3 rho;
flat in vec3 emission;
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

// Column and row of the cell at a place of the chart.
vec2 cellAt(vec2 at) {
  return clamp(floor(at), vec2(0.0), rectangle.zw - 1.0);
}

float patchAt(vec2 at) {
  return texelFetch(cells, ivec2(rectangle.xy + cellAt(at)), 0).x;
}

// Whether a place of the chart lies at an edge of its patch: a pixel or two on there is another patch, or none.
bool isAtEdge(vec2 at) {
  vec2 width = max(fwidth(cell) * 2.5, 1e-6);
  for (int k = 0; k < 4; k++) {
    vec2 next = at + (k < 2 ? vec2(float(2 * k - 1), 0.0) : vec2(0.0, float(2 * k - 5))) * width;
    if (any(lessThan(next, vec2(0.0))) || any(greaterThanEqual(next, rectangle.zw))) return true;
    if (patchAt(next) != chosen) return true;
  }
  return false;
}

vec3 linear(vec3 code) {
  return mix(code / 12.92, pow((code + 0.055) / 1.055, vec3(2.4)), step(0.04045, code));
}

// The colour of a share: one step darker for every halving.
vec3 colourOfShare(vec2 at) {
  float share = texelFetch(shares, ivec2(rectangle.xy + cellAt(at)), 0).x;
  int k = share > 0.0 ? clamp(int(floor(log2(largestShare / share))), 0, 7) : 7;
  return linear(steps[7 - k]);
}

// Indirect and direct light at a place of the chart, each read within the chart's own texels.
vec3 incident(vec2 at) {
  vec2 texel = fixedTexel.x < 0.0 ? at * fineness : fixedTexel;
  vec2 indirect = rectangle.xy + clamp(at, vec2(0.5), rectangle.zw - 0.5);
  vec2 direct = rectangle.xy * fineness + clamp(texel, vec2(0.5), rectangle.zw * fineness - 0.5);
  vec3 sum = scales.x * textureLod(coarse, indirect / vec2(textureSize(coarse, 0)), 0.0).rgb
    + scales.y * textureLod(fine, direct / vec2(textureSize(fine, 0)), 0.0).rgb;
  return max(sum, 0.0);
}

void main() {
  float share = 1.0;
#ifdef DETAILED
  share = maskFactor * colour.a;
  if (maskChannel != vec4(0.0)) share *= dot(texture(mask, uv), maskChannel);
  if (share < cutoff) discard;
#endif
#ifdef IDS
  result = firstCell < 0.0 ? 0u : uint(firstCell + dot(cellAt(cell), vec2(1.0, rectangle.z))) + 1u;
#else
#ifdef DETAILED
  vec3 radiance = emission * texture(glow, uv).rgb + rho * texture(image, uv).rgb * colour.rgb * incident(cell);
#else
  vec3 radiance = emission + rho * incident(cell);
#endif
  if (exposure > 0.0) radiance = clamp(radiance * exposure, 0.0, 1.0);
  if (largestShare > 0.0) {
    bool isLit = firstCell >= 0.0 && texelFetch(shares, ivec2(rectangle.xy + cellAt(cell)), 0).x > largestShare / 256.0;
    radiance = mix(0.3 * radiance, isLit ? colourOfShare(cell) : vec3(0.0), isLit ? 0.75 : 0.0);
  }
  if (firstCell >= 0.0 && chosen >= 0.0 && patchAt(cell) == chosen) {
    bool isStripe = fract((gl_FragCoord.x + gl_FragCoord.y) / 14.0) < 0.18;
    if (fixedTexel.x < 0.0 ? isAtEdge(cell) : isStripe) radiance = vec3(1.0, 0.62, 0.1);
  }
  result = vec4(radiance, share);
#endif
}
