// Pass 9: from scan lines to the picture: x = (R0 + r) sin t, z = (R0 + r) cos t - R0, inverted; grey map; depth scale.
// One invocation is one pixel, a workgroup kPixels of a row that it finds in a list: most of them lie in the sector.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"

layout(local_size_x = kPixels) in;
layout(binding = 1) uniform samplerBuffer display;
layout(binding = 2, rgba8) writeonly uniform image2D picture;

layout(std430, binding = 3) readonly buffer Runs {
  uint runs[];  // first pixel | row << 16
};

void main() {
  uint run = runs[gl_WorkGroupID.x];
  ivec2 pixel = ivec2((run & 0xffffu) + gl_LocalInvocationID.x, run >> 16);
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
  float grey = 0.0;
  if (line >= -0.5 && line <= float(frame.lines) - 0.5 && along >= -0.5 && along <= float(frame.samples) - 0.5) {
    float fl = clamp(line, 0.0, float(frame.lines - 1));
    float fs = clamp(along, 0.0, float(frame.samples - 1));
    int l = min(int(fl), frame.lines - 2);
    int s = min(int(fs), frame.samples - 2);
    float wl = fl - float(l);
    float ws = fs - float(s);
    float value = (1.0 - ws) * ((1.0 - wl) * texelFetch(display, polar_index(l, s)).x + wl * texelFetch(display, polar_index(l + 1, s)).x) +
                  ws * ((1.0 - wl) * texelFetch(display, polar_index(l, s + 1)).x + wl * texelFetch(display, polar_index(l + 1, s + 1)).x);
    float curve = value * value * (3.0 - 2.0 * value);
    grey = (1.0 - kSCurve) * pow(value, kGreyGamma) + kSCurve * curve;
  }
  if (unforeseen(frame.tick_pitch) > 0.0 && z >= -0.5 * frame.pixel && z <= float(frame.samples) * frame.sample_pitch) {
    float mark = floor(z / frame.tick_pitch + 0.5);
    bool fifth = abs(mark - 5.0 * floor(mark / 5.0 + 0.5)) < 0.5;
    if (abs(z - mark * frame.tick_pitch) <= 0.5 * frame.pixel && pixel.x < frame.width - 4 &&
        pixel.x >= frame.width - (fifth ? 14 : 9)) {
      grey = 0.6;
    }
  }
  imageStore(picture, pixel, vec4(vec3(grey), 1.0));
}
