#version 300 es
// Linear shares of display white as sRGB codes.
precision highp float;
uniform sampler2D picture;
out vec4 result;

void main() {
  vec3 v = texelFetch(picture, ivec2(gl_FragCoord.xy), 0).rgb;
  vec3 code = mix(12.92 * v, 1.055 * pow(max(v, 1e-6), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, v));
  result = vec4(code, 1.0);
}
