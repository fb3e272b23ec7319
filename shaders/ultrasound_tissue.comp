// Pass 2: trilinear mix of the tissues around each sample, in rest space.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"
#define TISSUE_BINDING 1
#define VOXEL_BINDING 2
#include "shaders/ultrasound_labels.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 3) readonly buffer Rest {
  vec4 rest[];
};
layout(std430, binding = 4) writeonly buffer Mixes {
  vec4 mixes[];  // ln Z, loss, texture
};

void main() {
  int l = int(gl_GlobalInvocationID.x);
  int s = int(gl_GlobalInvocationID.y);
  if (l >= frame.lines) return;
  vec4 x = rest[polar_index(l, s)];
  bool gel = sample_range(s) < frame.coupling;
  vec3 q = voxel_position(x.xyz);
  vec3 base = floor(q);
  vec3 f = q - base;
  vec3 mixed = vec3(0.0);
  for (int corner = 0; corner < 8; ++corner) {
    ivec3 d = ivec3(corner & 1, (corner >> 1) & 1, corner >> 2);
    vec3 w = mix(1.0 - f, f, vec3(d));
    TissueRow row = tissues[tissue_at(ivec3(base) + d, int(x.w), gel)];
    mixed += w.x * w.y * w.z * vec3(row.log_impedance, row.loss, row.texture);
  }
  mixes[polar_index(l, s)] = vec4(mixed, 0.0);
}
