// Pass 5: two-way amplitude along each scan line, how well the face touches the skin there, the haze under the face and the
// clutter behind what is bright. One invocation is one line: the sums along it are the only serial work of the chain.
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
  int samples = unforeseen(frame.samples);
  float lost = 0.0;
  vec2 face = !kConvex ? vec2(sample_position(l, 0).x, 0.0)
                      : frame.face_radius * line_direction(l) - vec2(0.0, frame.face_radius);
  if (kTextured) {  // what is wrong with the contact belongs to the skin
    vec3 skin = frame.origin.xyz + face.x * frame.lateral.xyz + face.y * frame.axial.xyz;
    lost = kContactDb * kDbToNepers * slow_pair(slow_texel(kContactStretch * speckle_lattice(skin))).y;
  }
  for (int s = 0; s < samples; ++s) {
    int index = polar_index(l, s);
    float here = loss[index];
    float transmission = exp(-(lost + 0.5 * here));
    lost += here;
    for (int k = 0; k < kLooks; ++k) echo[index + k * polar_size()] *= transmission;
  }
  if (unforeseen(frame.haze) == 0.0) return;
  float fresh = 1.0 - exp(-frame.sample_pitch / kClutterLength);
  float above = 0.0;
  for (int s = 0; s < samples; ++s) {
    int index = polar_index(l, s);
    float range = sample_range(s);
    float haze = kClutter * above;
    if (range < kHazeDepth) haze += kHazeNear * exp(-range / kHazeNearDecay) + kHazeFar * exp(-range / kHazeFarDecay);
    float level = length(echo[index]);
    above += fresh * (level - above);
    if (haze < kLeastHaze * level) continue;
    // Fixed to the probe and smeared along the face.
    uint texel = speckle_texel(grain_lattice(vec3(0.2 * sample_position(l, s).x, 0.0, range)));
    for (int k = 0; k < kLooks; ++k) {
      echo[index + k * polar_size()] += haze * 0.70710678 * speckle_of_look(uint(k), texel);
    }
  }
}
