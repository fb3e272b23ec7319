// Pass 6: the beam's width: Gaussian over lines, wider with depth. z: look.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 1) readonly buffer Weights {
  float weights[];  // [sample][kLateralTaps], centre first
};
layout(std430, binding = 2) readonly buffer Before {
  vec2 before[];
};
layout(std430, binding = 3) writeonly buffer After {
  vec2 after[];
};

void main() {
  int l = int(gl_GlobalInvocationID.x);
  int s = int(gl_GlobalInvocationID.y);
  if (l >= frame.lines) return;
  int row = int(gl_GlobalInvocationID.z) * polar_size() + s * frame.lines;
  vec2 sum = weights[s * kLateralTaps] * before[row + l];
  for (int i = 1; i < kLateralTaps; ++i) {
    float w = weights[s * kLateralTaps + i];
    if (w == 0.0) break;
    sum += w * (before[row + max(l - i, 0)] + before[row + min(l + i, frame.lines - 1)]);
  }
  after[row + l] = sum;
}
