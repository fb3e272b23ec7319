// Pass 4: behind gas. Nearly all comes back from its surface, so what is shown behind it took a detour: the mirror image of
// what lies in front, echoes between surface and face, and the ringing of froth. In the plane: what the surface throws
// out of it is not followed. One invocation is one line.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"
#define TISSUE_BINDING 6
#include "shaders/ultrasound_labels.glsl"
#define SPECKLE_BINDING 1
#include "shaders/ultrasound_speckle.glsl"

layout(local_size_x = 8) in;
layout(std430, binding = 2) readonly buffer Fronts {
  uint fronts[];  // first sample in gas of each line, at least `samples`: none
};
layout(std430, binding = 3) readonly buffer Found {
  uint found[];
};
layout(std430, binding = 4) buffer Echo {
  vec2 echo[];
};
layout(std430, binding = 5) buffer Loss {
  float loss[];
};

/// How far the surface goes on from line l in steps of `step`, at most `reach` lines.
int edge_of_surface(int l, int step, int reach) {
  int last = l;
  int most = int(kMirrorStep / frame.sample_pitch + 0.5);
  for (int i = 0; i < reach; ++i) {
    int next = last + step;
    if (next < 0 || next >= frame.lines || fronts[next] >= uint(frame.samples) ||
        abs(int(fronts[next]) - int(fronts[last])) > most) {
      break;
    }
    last = next;
  }
  return last;
}

void main() {
  int l = int(gl_GlobalInvocationID.x);
  int samples = unforeseen(frame.samples);
  if (l >= frame.lines || fronts[l] >= uint(samples)) return;
  int front = int(fronts[l]);
  TissueRow gas = tissues[found[polar_index(l, front)] >> kTexelBits];
  // The surface's own echo and loss lie on either side of it, as wide as a voxel.
  int margin = 1 + int(max(frame.label_spacing, 2.0 * frame.sample_pitch) / frame.sample_pitch);
  if (front == 0 || int(found[polar_index(l, front - 1)] >> kTexelBits) == frame.gel_tissue) {
    // The head hangs in the air: there is no surface to see.
    for (int s = max(front - margin, 0); s < samples; ++s) {
      for (int k = 0; k < kLooks; ++k) echo[polar_index(l, s) + k * polar_size()] = vec2(0.0);
    }
    return;
  }
  float surface = 0.0;
  for (int s = max(front - margin, 0); s <= min(front + margin, samples - 1); ++s) {
    surface = max(surface, length(echo[polar_index(l, s)]));
    loss[polar_index(l, s)] = 0.0;
  }

  float depth = sample_range(front);
  float pitch = !kConvex ? frame.line_pitch : (frame.face_radius + depth) * frame.line_pitch;
  int reach = clamp(int(kMirrorReach / pitch + 0.5), 1, 64);
  int left = edge_of_surface(l, -1, reach);
  int right = edge_of_surface(l, 1, reach);
  vec2 beam = line_direction(l);
  vec2 along = sample_position(right, int(fronts[right])) - sample_position(left, int(fronts[left]));
  vec2 normal = left == right ? beam : normalize(vec2(-along.y, along.x));
  vec2 mirrored = beam - 2.0 * dot(beam, normal) * normal;
  float facing = pow(abs(dot(beam, normal)), kInterfaceExponent);
  vec2 from = sample_position(l, front);
  float bubbles = smoothstep(0.0, 1.0, slow_pair(found[polar_index(l, front)] & ((1u << kTexelBits) - 1u)).y);
  float lost = 0.0;
  for (int s = front; s < samples; ++s) {
    int index = polar_index(l, s);
    float range = sample_range(s);
    float behind = range - depth;
    // Where the mirrored way has come to, if it is still in front of gas.
    vec2 there = line_and_sample(from + behind * mirrored);
    int line = int(floor(there.x + 0.5));
    int sample_ = int(floor(there.y + 0.5));
    bool seen = line >= 0 && line < frame.lines && sample_ >= 0 && sample_ < frame.samples &&
                uint(sample_ + margin) < fronts[clamp(line, 0, frame.lines - 1)];
    int image = seen ? polar_index(line, sample_) : index;
    if (seen) lost += loss[image];
    float mirror = seen && s > front + margin ? gas.mirror * exp(-behind / kMirrorLength - lost) : 0.0;
    // Again and again between face and surface; within froth.
    float times = floor(range / depth + 0.5);
    float off = (range - times * depth) / kRingWidth;
    float on_the_way = exp(-frame.tgc * kDbToNepers * behind);  // through tissue, as the depth gain has it
    float again = times < 1.5 ? 0.0 : on_the_way * facing * pow(kFaceReverberation, times - 1.0) * exp(-0.5 * off * off);
    float rings = floor(behind / kRingSpacing + 0.5);
    off = (behind - rings * kRingSpacing) / kRingWidth;
    float ringing = gas.ring_down > 0.0 && rings > 0.5 ? kRing * bubbles * pow(gas.ring_down, rings) * exp(-0.5 * off * off) : 0.0;
    float dirty = (gas.ring_down > 0.0 ? kDirty : kDirtySmooth * kDirty) * on_the_way * exp(-behind / kDirtyLength);
    uint texel = speckle_texel(grain_lattice(vec3(from, range)));
    for (int k = 0; k < kLooks; ++k) {
      int at = index + k * polar_size();
      vec2 shown = mirror * echo[image + k * polar_size()] + vec2(surface * (again + ringing), 0.0) +
                   surface * dirty * 0.70710678 * speckle_of_look(uint(k), texel);
      echo[at] = (s <= front + margin ? echo[at] : vec2(0.0)) + shown;
    }
    loss[index] = 0.0;
  }
}
