// Pass 3: analytic echoes of the needle and of wires. What is thinner than the beam must be splatted, not sampled:
// sampling drops it. A workgroup is a tile that they reach.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"

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
  vec3 scale = 1.0 / vec3(max(kWireWidth, kWirePitches * pitch), elevation_sigma(range),
                          max(kWireWidth, kWirePitches * frame.sample_pitch));
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

void main() {
  uint tile = tiles[gl_WorkGroupID.x];
  int l = int(tile % uint(frame.tile_columns)) * kTile + int(gl_LocalInvocationID.x);
  int s = int(tile / uint(frame.tile_columns)) * kTile + int(gl_LocalInvocationID.y);
  if (l >= frame.lines || s >= frame.samples) return;
  int segments = unforeseen(frame.needle_segments);
  vec2 at = sample_position(l, s);
  vec2 beam = line_direction(l);
  float sigma = elevation_sigma(sample_range(s));
  float amplitude = 0.0;
  float shadow = 0.0;
  float gain = 1.0;
  for (int n = 0; segments > 0 && n <= kReverberations; ++n) {
    // The echo comes from the near side of the shaft; copy n arrives later.
    vec2 p = at + (frame.needle_radius - float(n) * kReverberationSpacing) * beam;
    // The point of the shaft that shows most here: the nearest, lengths counted in standard deviations of the echo across
    // the shaft (in the plane) and of the beam (out of it).
    vec3 scale = vec3(1.0 / kNeedleWidth, 1.0 / sigma, 1.0 / kNeedleWidth);
    float nearest2 = 1e9;
    float from_tip = 0.0;
    float along = 0.0;
    for (int i = 0; i < segments; ++i) {
      vec4 from = needle[i].from;
      vec4 axis = needle[i].to - from;  // w: length
      vec3 to_p = scale * (vec3(p.x, 0.0, p.y) - from.xyz);
      vec3 scaled_axis = scale * axis.xyz;
      float t = clamp(dot(to_p, scaled_axis) / dot(scaled_axis, scaled_axis), 0.0, 1.0);
      vec3 away = to_p - t * scaled_axis;
      float distance2 = dot(away, away);
      if (distance2 < nearest2) {
        nearest2 = distance2;
        from_tip = from.w + t * axis.w;
        along = dot(beam, axis.xz) / axis.w;
      }
    }
    float profile = exp(-0.5 * nearest2);
    float sin2 = max(1.0 - along * along, 0.0);
    float sin6 = sin2 * sin2 * sin2;
    if (n == 0) {
      float tip = exp(-from_tip * from_tip / (kTipLength * kTipLength));
      float law = kNeedleMirror * sin6 + kNeedleRough * sin2 + kNeedleFloor;
      amplitude = profile * (law * (1.0 + kTipGain * tip) + kTipFloor * tip);
      shadow = profile;
      gain = kReverberationGain;
    } else {
      amplitude += gain * profile * sin6;
      gain *= kReverberationDecay;
    }
  }
  int index = polar_index(l, s);
  float echoes = kNeedleGain * amplitude + wire_echo(at, beam, sample_range(s));
  for (int k = 0; k < kLooks; ++k) echo[index + k * polar_size()].x += echoes;
  // The profile integrates to sqrt(2 pi) sigma across the shaft.
  loss[index] += kNeedleShadow * shadow * frame.sample_pitch / (2.5066283 * kNeedleWidth);
}
