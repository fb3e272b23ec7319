// Pass 4: two-way amplitude along each scan line, and the haze under the face. One invocation is one line: the sum
// along it is the only serial work of the chain.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"
#define SPECKLE_BINDING 1
#include "shaders/ultrasound_speckle.glsl"

layout(local_size_x = 8) in;
layout(std430, binding = 2) readonly buffer Loss {
  float loss[];
};
layout(std430, binding = 3) buffer Echo {
  vec2 echo[];
};

void main() {
  int l = int(gl_GlobalInvocationID.x);
  if (l >= frame.lines) return;
  float lost = 0.0;
  for (int s = 0; s < frame.samples; ++s) {
    int index = polar_index(l, s);
    float here = loss[index];
    float transmission = exp(-(lost + 0.5 * here));
    lost += here;
    for (int k = 0; k < kLooks; ++k) echo[index + k * polar_size()] *= transmission;
  }
  if (frame.haze == 0.0) return;
  int end = min(frame.samples, int(kHazeDepth / frame.sample_pitch + 0.5));
  for (int s = 0; s < end; ++s) {
    int index = polar_index(l, s);
    float range = sample_range(s);
    float haze = kHazeNear * exp(-range / kHazeNearDecay) + kHazeFar * exp(-range / kHazeFarDecay);
    // Fixed to the probe and smeared along the face.
    uint texel = speckle_texel(speckle_lattice(vec3(0.2 * sample_position(l, s).x, 0.0, range)));
    for (int k = 0; k < kLooks; ++k) {
      echo[index + k * polar_size()] += haze * 0.70710678 * speckle_of_look(uint(k), texel);
    }
  }
}
