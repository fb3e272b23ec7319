#version 460
// What surface a pixel of the 3-D view shows, and how far away: every surface counts as opaque, covers where they are
// more than half there.
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared.h"
#include "shaders/unforeseen.glsl"

layout(set = 0, binding = 0, std140) uniform Frame { FrameUniforms frame; };
layout(push_constant) uniform Push { SurfaceStyle style; };
layout(location = 0) in vec4 position;
layout(location = 1) in vec4 normal;
layout(location = 0) out uint label_and_depth;

#include "shaders/cover_window.glsl"

void main() {
  uint kind = unforeseen(style.kind.x);
  if (kind == kCover && unforeseen(frame.see.x) != kSeeClosed && outside_window(position.xyz) < 0.5) discard;
  if (kind == kCloth && outside_opening(position.xyz, vec2(position.w, normal.w)) < 0.0) discard;
  float depth = 1.0 / gl_FragCoord.w;  // along the viewing direction, m
  if (unforeseen(style.kind.y) == 0u) {  // the room: no part of the scene, but it hides what is behind
    label_and_depth = 0u;
    return;
  }
  label_and_depth = (style.kind.y & 0xffu) | uint(clamp(depth / kDepthUnit + 0.5, 1.0, 65535.0)) << 8;
}
