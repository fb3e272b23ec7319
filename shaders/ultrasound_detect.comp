// Pass 8: receiver noise, compounding of looks, envelope, depth gain, log compression,
// persistence (a recursive filter over frames of the compressed value).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 1) readonly buffer Echo {
  vec2 echo[];
};
layout(std430, binding = 2) writeonly buffer Envelope {
  float envelope[];
};
layout(std430, binding = 3) buffer Display {
  float display[];  // 0 black to 1 white; before this pass: of the frame before
};

/// dB that the TGC sliders add: linear between the middles of the eighths of the depth.
float slider_gain(int s) {
  float at = clamp((float(s) + 0.5) * 8.0 / float(frame.samples) - 0.5, 0.0, 7.0);
  int below = min(int(at), 6);
  int above = below + 1;
  return mix(frame.tgc_sliders[below >> 2][below & 3], frame.tgc_sliders[above >> 2][above & 3], at - float(below));
}

float unit(uint bits) {
  return (float(bits >> 8) + 0.5) * (1.0 / 16777216.0);
}

void main() {
  int l = int(gl_GlobalInvocationID.x);
  int s = int(gl_GlobalInvocationID.y);
  if (l >= frame.lines) return;
  int index = polar_index(l, s);
  float intensity = 0.0;
  for (int k = 0; k < kLooks; ++k) {
    int here = k * polar_size() + index;
    uint first = hash(uint(here) + hash(uint(frame.noise_seed)));
    uint second = hash(first);
    // Box-Muller; a complex number of mean square 1.
    float modulus = frame.noise * sqrt(-log(unit(first)));
    float phase = 2.0 * kPi * unit(second);
    vec2 iq = echo[here] + modulus * vec2(cos(phase), sin(phase));
    intensity += dot(iq, iq);
  }
  float amplitude = sqrt(intensity / float(kLooks));
  envelope[index] = amplitude;
  float db = 8.6858896 * log(max(amplitude, 1e-9)) + frame.tgc * sample_range(s) + slider_gain(s);
  float now = clamp((db - frame.white_db + frame.dynamic_range) / frame.dynamic_range, 0.0, 1.0);
  display[index] = unforeseen(frame.persistence) > 0.0 ? now + frame.persistence * (display[index] - now) : now;
}
