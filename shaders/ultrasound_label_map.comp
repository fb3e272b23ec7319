// Beside the image, when asked for: what each pixel of the picture shows. From the pixel to the nearest sample of the scan,
// to the tissue found there; nothing is interpolated. One invocation is one pixel.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 1) readonly buffer Found {
  uint found[];
};
layout(std430, binding = 2) readonly buffer Needle {
  NeedleSegment needle[];
};
layout(std430, binding = 3) writeonly buffer Labels {
  uint labels[];  // of pixels, row by row
};

/// The shaft, as thick as it is; thinner where it leaves the slice, gone where the beam has half its sensitivity.
bool on_needle(vec2 p, float range) {
  float radius = max(frame.needle_radius, 0.75 * frame.pixel);
  vec3 scale = vec3(1.0 / radius, 1.0 / (0.5 / 0.42466090 * elevation_sigma(range)), 1.0 / radius);
  for (int i = 0; i < unforeseen(frame.needle_segments); ++i) {
    vec3 from = needle[i].from.xyz;
    vec3 axis = scale * (needle[i].to.xyz - from);
    vec3 to_p = scale * (vec3(p.x, 0.0, p.y) - from);
    float t = clamp(dot(to_p, axis) / dot(axis, axis), 0.0, 1.0);
    vec3 away = to_p - t * axis;
    if (dot(away, away) <= 1.0) return true;
  }
  return false;
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (pixel.x >= frame.width) return;
  float x = frame.picture_x + (float(pixel.x) + 0.5) * frame.pixel;
  float z = frame.picture_z + (float(pixel.y) + 0.5) * frame.pixel;
  float across = x;
  float range = z;
  if (kConvex) {
    across = atan(x, z + frame.face_radius);
    range = sqrt(x * x + (z + frame.face_radius) * (z + frame.face_radius)) - frame.face_radius;
  }
  float line = (across - frame.first_line) / frame.line_pitch;
  float along = range / frame.sample_pitch - 0.5;
  int label = 0;
  if (line >= -0.5 && line <= float(frame.lines) - 0.5 && along >= -0.5 && along <= float(frame.samples) - 0.5) {
    int l = clamp(int(floor(line + 0.5)), 0, frame.lines - 1);
    int s = clamp(int(floor(along + 0.5)), 0, frame.samples - 1);
    label = int(found[polar_index(l, s)] >> kTexelBits);
    if (label == 0) label = frame.gel_tissue;
    if (on_needle(vec2(x, z), range)) label = frame.filler_tissue + 1;
  }
  labels[pixel.y * frame.width + pixel.x] = uint(label);
}
