// Pass 1: from the image plane through the deformed tetrahedra to rest space.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"
#define VOXEL_BINDING 6
#include "shaders/ultrasound_labels.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 1) readonly buffer Tets {
  CutTet tets[];
};
layout(std430, binding = 2) readonly buffer Starts {
  uint starts[];
};
layout(std430, binding = 3) readonly buffer Entries {
  uint entries[];
};
layout(std430, binding = 4) writeonly buffer Rest {
  vec4 rest[];  // w: body, -1 none
};
layout(std430, binding = 5) writeonly buffer Slope {
  vec4 slope[];  // d rest / d y of the probe
};

void main() {
  int l = int(gl_GlobalInvocationID.x);
  int s = int(gl_GlobalInvocationID.y);
  if (l >= frame.lines) return;
  vec2 p = sample_position(l, s);
  vec3 position = frame.origin.xyz + p.x * frame.lateral.xyz + p.y * frame.axial.xyz;
  vec3 across = frame.elevation.xyz;
  float body = -1.0;

  ivec2 bin = ivec2(floor((p - vec2(frame.bin_x, frame.bin_z)) / frame.bin_size));
  if (all(greaterThanEqual(bin, ivec2(0))) && bin.x < frame.bin_columns && bin.y < frame.bin_rows) {
    int b = bin.y * frame.bin_columns + bin.x;
    uint end = starts[b + 1];
    for (uint e = starts[b]; e < end; ++e) {
      uint t = entries[e];
      vec4 w = vec4(tets[t].barycentric[0].x + tets[t].barycentric[0].y * p.x + tets[t].barycentric[0].w * p.y,
                    tets[t].barycentric[1].x + tets[t].barycentric[1].y * p.x + tets[t].barycentric[1].w * p.y,
                    tets[t].barycentric[2].x + tets[t].barycentric[2].y * p.x + tets[t].barycentric[2].w * p.y,
                    tets[t].barycentric[3].x + tets[t].barycentric[3].y * p.x + tets[t].barycentric[3].w * p.y);
      // A point on a face between two tetrahedra must be found in one of them whatever the rounding.
      if (all(greaterThanEqual(w, vec4(-1e-4)))) {
        position = w.x * tets[t].rest[0].xyz + w.y * tets[t].rest[1].xyz + w.z * tets[t].rest[2].xyz +
                   w.w * tets[t].rest[3].xyz;
        across = tets[t].barycentric[0].z * tets[t].rest[0].xyz + tets[t].barycentric[1].z * tets[t].rest[1].xyz +
                 tets[t].barycentric[2].z * tets[t].rest[2].xyz + tets[t].barycentric[3].z * tets[t].rest[3].xyz;
        body = tets[t].rest[0].w;
        break;
      }
    }
  }
  if (body < 0.0 && frame.breath.w >= 0.0) {
    vec3 before = position - frame.breath.xyz;
    if (owner_of(voxel_at(ivec3(floor(voxel_position(before) + 0.5)))) == int(frame.breath.w)) {
      position = before;
      body = frame.breath.w;
    }
  }
  rest[polar_index(l, s)] = vec4(position, body);
  slope[polar_index(l, s)] = vec4(across, 0.0);
}
