#version 460
// The probe's imaging plane: a pane of light with a bright border, or the ultrasound image itself where it is.
#extension GL_GOOGLE_include_directive : require
#include "shaders/shared.h"
#include "shaders/unforeseen.glsl"

layout(set = 0, binding = 0, std140) uniform Frame { FrameUniforms frame; };
layout(set = 0, binding = 2) uniform sampler2D ultrasound;
layout(location = 0) in vec4 position;
layout(location = 0) out vec4 colour;

void main() {
  vec3 p = (frame.probe_from_patient * vec4(position.xyz, 1.0)).xyz;
  float radius = frame.fan.x, half_extent = frame.fan.y;
  // Range below the face, and distance from the nearest side, m.
  float range = p.z, side = half_extent - abs(p.x), across = p.x;
  if (unforeseen(frame.fan.w) > 0.5) {
    float r = length(vec2(p.x, p.z + radius));
    range = r - radius;
    across = atan(p.x, p.z + radius);
    side = r * (half_extent - abs(across));
  }
  // It ends where the patient does, softly: so far as voxels know where that is.
  float ray = clamp((0.5 + 0.5 * across / half_extent) * float(kFanRays), 0.0, float(kFanRays));
  int left = min(int(ray), kFanRays - 1);
  float reach = mix(frame.fan_reach[left / 4][left % 4], frame.fan_reach[(left + 1) / 4][(left + 1) % 4], ray - float(left));
  float inside = reach < 0.999 * frame.fan.z ? smoothstep(0.0, 0.008, reach - range) : 1.0;
  if (inside <= 0.0) {
    colour = vec4(0.0);
    return;
  }
  float border = min(side, min(range, frame.fan.z - range));
  float line = 1.0 - smoothstep(0.0005, 0.0013, border);
  float ticks = 1.0 - smoothstep(0.0003, 0.0007, abs(fract(range * 50.0 + 0.5) - 0.5) * 0.02);  // every 2 cm
  vec3 light = vec3(0.35, 0.68, 0.95);
  float alpha = 0.05 + 0.75 * line + 0.13 * ticks;
  vec3 c = light * (0.7 + 0.3 * line);
  if (unforeseen(frame.fan_image.z) > 0.0) {
    vec2 uv = (p.xz - frame.fan_image.xy) * frame.fan_image.zw;
    float grey = texture(ultrasound, uv).r;
    c = mix(vec3(grey) * vec3(0.92, 0.97, 1.0), c, line);
    alpha = max(0.30 + 0.55 * grey, 0.75 * line);
  }
  alpha *= inside;
  colour = vec4(c * alpha, alpha);
}
