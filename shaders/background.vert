#version 460
// The ground: the whole picture at infinity (reversed depth: 0), as a grid of cells of at most 64 pixels. One large
// triangle would do, but lavapipe of Mesa 22.3.6 draws what covers a whole 64 x 64 tile into the first view only.
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared.h"

layout(set = 0, binding = 0, std140) uniform Frame { FrameUniforms frame; };

void main() {
  const uvec2 corners[6] = uvec2[](uvec2(0, 0), uvec2(1, 0), uvec2(1, 1), uvec2(0, 0), uvec2(1, 1), uvec2(0, 1));
  uint columns = uint(frame.viewport.z);
  uint cell = uint(gl_VertexIndex) / 6u;
  uvec2 corner = uvec2(cell % columns, cell / columns) + corners[gl_VertexIndex % 6];
  gl_Position = vec4(vec2(corner) / frame.viewport.zw * 2.0 - 1.0, 0.0, 1.0);
}
