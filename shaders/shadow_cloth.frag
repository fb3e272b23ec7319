#version 460
// Light falls through the opening of the drape.
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared.h"
#include "shaders/unforeseen.glsl"

layout(set = 0, binding = 0, std140) uniform Frame { FrameUniforms frame; };
layout(location = 0) in vec2 at;

#include "shaders/cover_window.glsl"

void main() {
  if (outside_field(at) < 0.0) discard;
}
