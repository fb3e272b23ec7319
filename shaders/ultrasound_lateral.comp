// Pass 6: the beam's width: Gaussian over lines, wider with depth. One invocation is kBlock lines, which share what they
// read. z: look.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"

layout(local_size_x = 16) in;
layout(std430, binding = 1) readonly buffer Weights {
  float weights[];  // [sample][kLateralTaps], centre first
};
layout(binding = 2) uniform samplerBuffer before;
layout(std430, binding = 3) writeonly buffer After {
  vec2 after[];
};

void main() {
  int l = int(gl_GlobalInvocationID.x) * kBlock;
  int s = int(gl_GlobalInvocationID.y);
  if (l >= frame.lines) return;
  int row = int(gl_GlobalInvocationID.z) * polar_size() + s * frame.lines;
  int first_weight = s * kLateralTaps;
  int reach = 0;
  while (reach + 1 < kLateralTaps && weights[first_weight + reach + 1] != 0.0) ++reach;
  vec2 sum[kBlock] = vec2[](vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0));
  for (int i = -reach; i < reach + kBlock; ++i) {
    vec2 value = texelFetch(before, row + clamp(l + i, 0, frame.lines - 1)).xy;
    for (int j = 0; j < kBlock; ++j) {
      int tap = abs(i - j);
      sum[j] += (tap <= reach ? weights[first_weight + tap] : 0.0) * value;
    }
  }
  for (int j = 0; j < kBlock && l + j < frame.lines; ++j) after[row + l + j] = sum[j];
}
