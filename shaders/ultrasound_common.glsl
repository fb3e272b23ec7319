// What the ultrasound passes share: the frame's constants at binding 0, the polar grid, random bits. One invocation is one
// sample of one scan line (x: line, y: sample) unless a pass says otherwise. Polar arrays are [sample][line].
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_shared.h"

layout(std140, binding = 0) uniform Frame {
  FrameConstants frame;
};

// What an imager is made for (ScanModel::switches): what it never needs is compiled away, which a software rasteriser
// would otherwise go through masked.
layout(constant_id = 0) const int kLooks = kMaxLooks;
layout(constant_id = 1) const bool kTextured = true;   // slow texture, triads and beads
layout(constant_id = 2) const bool kBreathing = true;  // some voxels go with the breath
layout(constant_id = 3) const bool kConvex = true;     // the probe's face is an arc
layout(constant_id = 4) const bool kLayered = true;    // some tissue's texture runs along the layers of the body
layout(constant_id = 5) const bool kHeated = true;     // tissue may be ablated

// Where branches and loops hang on uniforms alone, lavapipe makes another shader for every use and keeps them all: memory
// grows with each image. They go through here, with a nothing in it that a compiler cannot foresee.
int unforeseen(int value) { return value + int(gl_NumWorkGroups.x == 0u); }
float unforeseen(float value) { return value + float(gl_NumWorkGroups.x == 0u); }

float sample_range(int s) {
  return (float(s) + 0.5) * frame.sample_pitch;
}

/// Unit direction (x, z) of a scan line.
vec2 line_direction(int l) {
  float c = frame.first_line + float(l) * frame.line_pitch;
  return !kConvex ? vec2(0.0, 1.0) : vec2(sin(c), cos(c));
}

/// (x, z) in the probe frame.
vec2 sample_position(int l, int s) {
  float r = sample_range(s);
  if (!kConvex) return vec2(frame.first_line + float(l) * frame.line_pitch, r);
  return (frame.face_radius + r) * line_direction(l) - vec2(0.0, frame.face_radius);
}

/// Fractional line and sample of (x, z) in the probe frame: the inverse of sample_position().
vec2 line_and_sample(vec2 p) {
  float across = p.x;
  float range = p.y;
  if (kConvex) {
    across = atan(p.x, p.y + frame.face_radius);
    range = length(p + vec2(0.0, frame.face_radius)) - frame.face_radius;
  }
  return vec2((across - frame.first_line) / frame.line_pitch, range / frame.sample_pitch - 0.5);
}

const float kDbToNepers = 0.115129255;

int polar_index(int l, int s) {
  return s * frame.lines + l;
}

int polar_size() {
  return frame.samples * frame.lines;
}

/// PCG output permutation (O'Neill 2014): random bits of a counter.
uint hash(uint x) {
  x = x * 747796405u + 2891336453u;
  x = ((x >> ((x >> 28u) + 4u)) ^ x) * 277803737u;
  return (x >> 22u) ^ x;
}

float elevation_sigma(float range) {
  float defocus = (range - frame.elevation_focus) / frame.elevation_field_depth;
  return 0.42466090 * frame.elevation_width * sqrt(1.0 + defocus * defocus);
}
