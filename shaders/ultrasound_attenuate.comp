// Pass 5: two-way amplitude along each scan line, and the haze under the face. One invocation is one line: the sum
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
    float range = sample_range(s);
    float haze = frame.haze * (kHazeNear * exp(-range / kHazeNearDecay) + kHazeFar * exp(-range / kHazeFarDecay)) *
                 0.70710678;
    // Fixed to the probe and smeared along the face.
    uvec2 noise = speckle[speckle_texel(vec3(0.2 * sample_position(l, s).x, 0.0, range))];
    vec4 noise01 = first_looks(noise);
    echo[index] = echo[index] * transmission + haze * noise01.xy;
    if (frame.looks > 1) {
      echo[index + polar_size()] = echo[index + polar_size()] * transmission + haze * noise01.zw;
    }
    if (frame.looks > 2) {
      echo[index + 2 * polar_size()] = echo[index + 2 * polar_size()] * transmission + haze * third_look(noise).xy;
    }
  }
}
