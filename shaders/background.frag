#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared.h"
#include "shaders/lighting.glsl"

layout(set = 0, binding = 0, std140) uniform Frame { FrameUniforms frame; };
layout(location = 0) out vec4 colour;

void main() {
  vec3 c = background(gl_FragCoord.xy / frame.viewport.xy * 2.0 - 1.0);
  colour = vec4(c + dither(gl_FragCoord.xy) * 0.0006, 1.0);
}
