// Pass 7: the pulse's length: Gaussian over samples, longer with depth. z: look.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 1) readonly buffer Weights {
  float weights[];  // [sample][kAxialTaps], centre first
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
  int first = int(gl_GlobalInvocationID.z) * polar_size() + l;
  vec2 sum = weights[s * kAxialTaps] * before[first + s * frame.lines];
  for (int i = 1; i < kAxialTaps; ++i) {
    float w = weights[s * kAxialTaps + i];
    if (w == 0.0) break;
    sum += w * (before[first + max(s - i, 0) * frame.lines] +
                                          before[first + min(s + i, frame.samples - 1) * frame.lines]);
  }
  after[first + s * frame.lines] = sum;
}
