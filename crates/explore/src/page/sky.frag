#version 300 es
// The sky behind everything: a row of cells after the other, from the zenith down.
precision highp float;
precision highp sampler2D;
in vec2 at;
uniform vec3 forward;
uniform vec3 right;      // times the tangent of half the angle of view
uniform vec3 above;
uniform vec3 skyUp;
uniform vec3 north;
uniform sampler2D sky;   // a row each: the sine at its lower edge and how many cells it has, then their radiances
uniform vec3 gain;
uniform float exposure;  // 0: radiance as it is
out vec4 result;

void main() {
  vec3 direction = normalize(forward + at.x * right + at.y * above);
  int row = 0;
  int last = textureSize(sky, 0).y - 1;
  while (row < last && dot(direction, skyUp) <= texelFetch(sky, ivec2(0, row), 0).x) row++;
  float cells = texelFetch(sky, ivec2(0, row), 0).y;
  float turn = cells > 1.0 ? atan(dot(direction, cross(north, skyUp)), dot(direction, north)) / 6.283185307 : 0.0;
  int cell = int(mod(floor(turn * cells + 0.5), cells));
  vec3 radiance = gain * texelFetch(sky, ivec2(1 + cell, row), 0).rgb;
  result = vec4(exposure > 0.0 ? clamp(radiance * exposure, 0.0, 1.0) : radiance, 1.0);
}
