#version 300 es
// The sky behind everything: one radiance above the horizon, another below.
precision highp float;
in vec2 at;
uniform vec3 forward;
uniform vec3 right;      // times the tangent of half the angle of view
uniform vec3 above;
uniform vec3 skyUp;
uniform vec3 upper;
uniform vec3 lower;
uniform float exposure;  // 0: radiance as it is
out vec4 result;

void main() {
  vec3 direction = forward + at.x * right + at.y * above;
  vec3 radiance = dot(direction, skyUp) > 0.0 ? upper : lower;
  result = vec4(exposure > 0.0 ? clamp(radiance * exposure, 0.0, 1.0) : radiance, 1.0);
}
