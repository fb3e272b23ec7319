// Pass 4: analytic echoes of the needle. A shaft thinner than the beam must be splatted, not sampled: sampling drops it.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 1) readonly buffer Needle {
  NeedleSegment needle[];  // from the tip to the hub
};
layout(std430, binding = 2) buffer Echo {
  vec2 echo[];
};
layout(std430, binding = 3) buffer Loss {
  float loss[];
};

void main() {
  int l = int(gl_GlobalInvocationID.x);
  int s = int(gl_GlobalInvocationID.y);
  if (l >= frame.lines) return;
  vec2 at = sample_position(l, s);
  if (at.x < frame.needle_min_x || at.x > frame.needle_max_x || at.y < frame.needle_min_z || at.y > frame.needle_max_z) {
    return;
  }
  vec2 beam = line_direction(l);
  float sigma = elevation_sigma(sample_range(s));
  float amplitude = 0.0;
  float shadow = 0.0;
  float gain = 1.0;
  for (int n = 0; n <= kReverberations; ++n) {
    // The echo comes from the near side of the shaft; copy n arrives later.
    vec2 p = at + (frame.needle_radius - float(n) * kReverberationSpacing) * beam;
    float copy = 0.0;
    for (int i = 0; i < frame.needle_segments; ++i) {
      vec4 from = needle[i].from;
      vec4 axis = needle[i].to - from;  // w: length
      vec2 flat_axis = axis.xz;
      float t = clamp(dot(p - from.xz, flat_axis) / max(dot(flat_axis, flat_axis), 1e-12), 0.0, 1.0);
      vec2 away = p - from.xz - t * flat_axis;
      float y = from.y + t * axis.y;
      float along = dot(beam, flat_axis) / sqrt(max(dot(axis.xyz, axis.xyz), 1e-12));
      float sin2 = max(1.0 - along * along, 0.0);
      float sin6 = sin2 * sin2 * sin2;
      float from_tip = (from.w + t * axis.w) / kTipLength;
      float tip = exp(-from_tip * from_tip);
      float profile = exp(-0.5 * dot(away, away) / (kNeedleWidth * kNeedleWidth)) * exp(-0.5 * y * y / (sigma * sigma));
      if (n == 0) {
        float law = kNeedleMirror * sin6 + kNeedleRough * sin2 + kNeedleFloor;
        copy = max(copy, profile * (law * (1.0 + kTipGain * tip) + kTipFloor * tip));
        shadow = max(shadow, profile);
      } else {
        copy = max(copy, profile * sin6);
      }
    }
    amplitude += gain * copy;
    gain = n == 0 ? kReverberationGain : gain * kReverberationDecay;
  }
  int index = polar_index(l, s);
  for (int k = 0; k < frame.looks; ++k) echo[index + k * polar_size()].x += kNeedleGain * amplitude;
  // The profile integrates to sqrt(2 pi) sigma across the shaft.
  loss[index] += kNeedleShadow * shadow * frame.sample_pitch / (2.5066283 * kNeedleWidth);
}
