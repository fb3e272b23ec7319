// Pass 3: analytic echoes of the needle and of wires. What is thinner than the beam must be splatted, not sampled:
// sampling drops it. A workgroup is a tile that they reach.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"
#define SPECKLE_BINDING 6
#include "shaders/ultrasound_speckle.glsl"

layout(local_size_x = kTile, local_size_y = kTile) in;
layout(std430, binding = 1) readonly buffer Needle {
  NeedleSegment needle[];  // from the tip to the hub
};
layout(std430, binding = 2) readonly buffer Wires {
  WireSegment wires[];
};
layout(std430, binding = 5) readonly buffer Tiles {
  uint tiles[];
};
layout(std430, binding = 3) buffer Echo {
  vec2 echo[];
};
layout(std430, binding = 4) buffer Loss {
  float loss[];
};

/// Sum of the echoes of the wires: no tip, no copies, no shadow, the same under every angle.
float wire_echo(vec2 at, vec2 beam, float range) {
  float pitch = !kConvex ? frame.line_pitch : (frame.face_radius + range) * frame.line_pitch;
  vec3 scale = 1.0 / vec3(max(kWireWidth / frame.grain, kWirePitches * pitch), elevation_sigma(range),
                          max(kWireWidth / frame.grain, kWirePitches * frame.sample_pitch));
  float sum = 0.0;
  for (int i = 0; i < unforeseen(frame.wires); ++i) {
    vec3 to_p = vec3(at.x, 0.0, at.y) - wires[i].from.xyz;
    vec3 axis = wires[i].to.xyz - wires[i].from.xyz;
    // Across the beam, out of the plane, along the beam.
    to_p = scale * vec3(to_p.x * beam.y - to_p.z * beam.x, to_p.y, to_p.x * beam.x + to_p.z * beam.y);
    axis = scale * vec3(axis.x * beam.y - axis.z * beam.x, axis.y, axis.x * beam.x + axis.z * beam.y);
    float t = clamp(dot(to_p, axis) / dot(axis, axis), 0.0, 1.0);
    vec3 away = to_p - t * axis;
    sum += mix(wires[i].from.w, wires[i].to.w, t) * exp(-0.5 * dot(away, away));
  }
  return sum;
}

/// The point of the shaft that shows most at (x, z): the nearest, lengths counted in standard deviations of the echo.
struct Nearest {
  float distance2;
  float from_tip;
  float along;  // cosine between beam and shaft
};

/// @param scale  1 / standard deviation across the beam, out of the plane, along the beam
Nearest nearest_point(vec2 p, vec2 beam, vec3 scale, int segments) {
  Nearest found = Nearest(1e9, 0.0, 0.0);
  for (int i = 0; i < segments; ++i) {
    vec4 from = needle[i].from;
    vec4 axis = needle[i].to - from;  // w: length
    vec3 to_p = vec3(p.x, 0.0, p.y) - from.xyz;
    vec3 scaled = scale * vec3(to_p.x * beam.y - to_p.z * beam.x, to_p.y, to_p.x * beam.x + to_p.z * beam.y);
    float with_beam = axis.x * beam.x + axis.z * beam.y;
    vec3 scaled_axis = scale * vec3(axis.x * beam.y - axis.z * beam.x, axis.y, with_beam);
    float t = clamp(dot(scaled, scaled_axis) / dot(scaled_axis, scaled_axis), 0.0, 1.0);
    vec3 away = scaled - t * scaled_axis;
    float distance2 = dot(away, away);
    if (distance2 < found.distance2) found = Nearest(distance2, from.w + t * axis.w, with_beam / axis.w);
  }
  return found;
}

/// Share of the echo of a shaft square to the beam: mirror-like, and of the tip.
float mirror_law(Nearest at, vec2 beam) {
  float sin2 = max(1.0 - at.along * at.along, 0.0);
  float tip = exp(-at.from_tip * at.from_tip / (kTipLength * kTipLength));
  float facing = beam.x * frame.bevel.x + beam.y * frame.bevel.z;
  return kNeedleMirror * sin2 * sin2 * sin2 * sin2 + kNeedleFloor +
         tip * (kTipFloor + kBevelFlash * mix(0.5 * sin2, facing * facing, frame.bevel.w));
}

void main() {
  uint tile = tiles[gl_WorkGroupID.x];
  int l = int(tile % uint(frame.tile_columns)) * kTile + int(gl_LocalInvocationID.x);
  int s = int(tile / uint(frame.tile_columns)) * kTile + int(gl_LocalInvocationID.y);
  if (l >= frame.lines || s >= frame.samples) return;
  int segments = unforeseen(frame.needle_segments);
  vec2 at = sample_position(l, s);
  vec2 beam = line_direction(l);
  float mirror = 0.0;
  float rough = 0.0;
  float shadow = 0.0;
  uint texel = 0u;
  if (segments > 0) {
    float sigma = elevation_sigma(sample_range(s));
    float width = kNeedleWidth / frame.grain;
    vec3 scale = 1.0 / vec3(width, sigma, width);
    // The echo comes from the near side of the shaft.
    vec2 p = at + frame.needle_radius * beam;
    Nearest shaft = nearest_point(p, beam, scale, segments);
    float profile = exp(-0.5 * shaft.distance2);
    float sin2 = max(1.0 - shaft.along * shaft.along, 0.0);
    mirror = profile * mirror_law(shaft, beam);
    rough = profile * kNeedleRough * sin2;
    vec3 on_shaft = vec3(shaft.from_tip, 0.0, 0.0);
    texel = speckle_texel(grain_lattice(on_shaft));
    shadow = profile;
    Nearest lobe = nearest_point(p, beam, vec3(1.0 / kSideLobeWidth, scale.yz), segments);
    mirror += kSideLobe * exp(-0.5 * lobe.distance2) * mirror_law(lobe, beam);
    // Copies arrive later. Those of a shaft that does not face the beam go elsewhere.
    float gain = kReverberationGain * sin2 * sin2 * sin2 * sin2;
    for (int n = 1; n <= kReverberations && kNeedleGain * gain > kLeastReverberation; ++n) {
      Nearest copy = nearest_point(p - 2.0 * float(n) * frame.needle_radius * beam, beam, scale, segments);
      mirror += gain * exp(-0.5 * copy.distance2);
      gain *= kReverberationDecay;
    }
    if (kTextured) mirror *= exp(kNeedleRipple * (slow_pair(slow_texel(speckle_lattice(on_shaft))).y - kNeedleRipple));
  }
  int index = polar_index(l, s);
  float echoes = kNeedleGain * mirror + wire_echo(at, beam, sample_range(s));
  for (int k = 0; k < kLooks; ++k) {
    echo[index + k * polar_size()] += vec2(echoes, 0.0) + kNeedleGain * rough * 0.70710678 * speckle_of_look(uint(k), texel);
  }
  // The profile integrates to sqrt(2 pi) sigma across the shaft.
  loss[index] += kNeedleShadow * shadow * frame.sample_pitch * frame.grain / (2.5066283 * kNeedleWidth);
}
