#version 460
// Depth of what has an opening, drape and covers, where it is not open: the colour comes after, where the depth is its own.
// So that the costly shader runs neither in the opening nor where something nearer hides the cloth.
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared.h"
#include "shaders/unforeseen.glsl"

layout(constant_id = 0) const uint kind = 0;
layout(set = 0, binding = 0, std140) uniform Frame { FrameUniforms frame; };
layout(location = 0) in vec4 position;
layout(location = 1) in vec4 normal;

#include "shaders/cover_window.glsl"

void main() {
  if (kind == kCloth && outside_opening(position.xyz, vec2(position.w, normal.w)) < 0.0) discard;
  if (kind == kCover && unforeseen(frame.see.x) == kSeeWindow && outside_window(position.xyz) <= 0.0) discard;
}
