#version 300 es
// Vertices of the scene. All that a triangle has of its chart, material and lamp is looked up here. Fronts and backs
// are drawn one after the other; a back without a chart is black.
precision highp float;
precision highp int;
layout(location = 0) in vec3 place;
layout(location = 1) in uint lampAndSlot;            // 4 and 12 bits
layout(location = 2) in uint front;
#ifdef DETAILED
layout(location = 3) in vec2 placeInImage;
layout(location = 4) in vec4 cornerColour;
out vec2 uv;
out vec4 colour;
#endif
uniform mat4 camera;
uniform bool isBack;
uniform float fineness;
uniform highp sampler2D charts;      // four texels a chart
uniform highp sampler2D materials;   // rho and emission of each material
uniform highp sampler2D gains;       // of each lamp, times the coefficient of E
out vec2 cell;                       // place in the chart
flat out vec4 rectangle;             // of the chart in the atlas: corner and size, in cells
flat out float firstCell;            // of the chart, or -1
flat out vec2 fixedTexel;            // fine texel of a triangle without a grid, else -1
flat out vec3 rho;
flat out vec3 emission;

vec4 chartTexel(int chart, int k) {
  return texelFetch(charts, ivec2(4 * (chart % 256) + k, chart / 256), 0);
}

vec3 materialTexel(int material, int k) {
  return texelFetch(materials, ivec2(2 * (material % 256) + k, material / 256), 0).rgb;
}

void main() {
#ifdef DETAILED
  uv = placeInImage;
  colour = cornerColour;
#endif
  gl_Position = camera * vec4(place, 1.0);
  cell = vec2(0.5);
  rectangle = vec4(0.0, 0.0, 1.0, 1.0);
  firstCell = -1.0;
  fixedTexel = vec2(-1.0);
  rho = emission = vec3(0.0);
  int chart = isBack ? int(chartTexel(int(front), 3).z) : int(front);
  if (chart < 0) return;
  vec4 o = chartTexel(chart, 0), p = chartTexel(chart, 1), q = chartTexel(chart, 2), atlas = chartTexel(chart, 3);
  rectangle = vec4(atlas.xy, o.w, p.w);
  firstCell = atlas.w;
  if (p.xyz == vec3(0.0) && q.xyz == vec3(0.0)) {
    uint slot = lampAndSlot >> 4, width = uint(fineness * o.w);
    fixedTexel = vec2(slot % width, slot / width) + 0.5;
    cell = floor(fixedTexel / fineness) + 0.5;
  } else {
    cell = vec2(dot(p.xyz, place - o.xyz), dot(q.xyz, place - o.xyz));
  }
#ifndef IDS
  rho = materialTexel(int(q.w), 0);
  emission = materialTexel(int(q.w), 1) * texelFetch(gains, ivec2(int(lampAndSlot & 15u), 0), 0).rgb;
#endif
}
