// Pass 7: the pulse's length: Gaussian over samples, longer with depth. One invocation is kBlock samples, which share what
// they read. z: look.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 1) readonly buffer Weights {
  float weights[];  // [sample][kAxialTaps], centre first
};
layout(binding = 2) uniform samplerBuffer before;
layout(std430, binding = 3) writeonly buffer After {
  vec2 after[];
};

void main() {
  int l = int(gl_GlobalInvocationID.x);
  int s = int(gl_GlobalInvocationID.y) * kBlock;
  if (l >= frame.lines) return;
  int first = int(gl_GlobalInvocationID.z) * polar_size() + l;
  // The weights of the block's last sample reach furthest.
  int last = min(s + kBlock, frame.samples) - 1;
  int reach = 0;
  while (reach + 1 < kAxialTaps && weights[last * kAxialTaps + reach + 1] != 0.0) ++reach;
  vec2 sum[kBlock] = vec2[](vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0));
  for (int i = -reach; i < reach + kBlock; ++i) {
    vec2 value = texelFetch(before, first + clamp(s + i, 0, frame.samples - 1) * frame.lines).xy;
    for (int j = 0; j < kBlock; ++j) {
      int tap = abs(i - j);
      sum[j] += (tap <= reach ? weights[min(s + j, last) * kAxialTaps + tap] : 0.0) * value;
    }
  }
  for (int j = 0; j < kBlock && s + j < frame.samples; ++j) after[first + (s + j) * frame.lines] = sum[j];
}
