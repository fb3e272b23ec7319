#version 460
// Vertices are pulled from the buffer that deform.comp and the host filled; both eyes in one pass.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_multiview : require
#include "shaders/shared.h"

layout(set = 0, binding = 0, std140) uniform Frame { FrameUniforms frame; };
layout(set = 0, binding = 1, std430) readonly buffer Drawn { DrawnVertex drawn[]; };

layout(location = 0) out vec4 position;  // patient frame; w: first coordinate
layout(location = 1) out vec4 normal;    // w: second coordinate

invariant gl_Position;  // the depth pass of a glass organ and its colour pass must agree to the bit

void main() {
  DrawnVertex v = drawn[gl_VertexIndex];
  position = v.position;
  normal = v.normal;
  gl_Position = frame.clip_from_patient[gl_ViewIndex] * vec4(v.position.xyz, 1.0);
}
