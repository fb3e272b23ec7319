#version 460
// The scene as the surgical lamp sees it.
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared.h"

layout(set = 0, binding = 0, std140) uniform Frame { FrameUniforms frame; };
layout(set = 0, binding = 1, std430) readonly buffer Drawn { DrawnVertex drawn[]; };
layout(location = 0) out vec2 at;

void main() {
  vec4 position = drawn[gl_VertexIndex].position;
  at = vec2(position.w, drawn[gl_VertexIndex].normal.w);
  gl_Position = frame.light_clip_from_patient * vec4(position.xyz, 1.0);
}
