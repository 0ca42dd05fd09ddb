#version 300 es
// Vertices of the scene: the place in unit coordinates, and the numbers of chart, lamp and slot for the whole triangle.
layout(location = 0) in vec3 code;
layout(location = 1) in uvec2 tags;
layout(location = 2) in uint chart;
#ifdef DETAILED
layout(location = 3) in vec2 placeInImage;
layout(location = 4) in vec4 cornerColour;
out vec2 uv;
out vec4 colour;
#endif
uniform mat4 camera;
out vec3 place;
flat out uvec2 lampAndSlot;
flat out uint front;

void main() {
#ifdef DETAILED
  uv = placeInImage;
  colour = cornerColour;
#endif
  place = 2.0 * code - 1.0;
  lampAndSlot = tags;
  front = chart;
  gl_Position = camera * vec4(place, 1.0);
}
