#version 460
// Lit surfaces. The output is what the screen shows, linear and premultiplied; the attachment encodes sRGB.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_multiview : require
#include "shaders/shared.h"
#include "shaders/cover_window.glsl"
#include "shaders/lighting.glsl"

layout(set = 0, binding = 0, std140) uniform Frame { FrameUniforms frame; };
layout(push_constant) uniform Push { SurfaceStyle style; };
layout(location = 0) in vec4 position;
layout(location = 1) in vec3 normal;
layout(location = 0) out vec4 colour;

void main() {
  vec3 v = normalize(frame.eye[gl_ViewIndex].xyz - position.xyz);
  vec3 n = normalize(normal);
  if (!gl_FrontFacing) n = -n;
  float facing = clamp(dot(n, v), 0.0, 1.0);
  uint kind = style.kind.x;
  vec3 albedo = style.colour.rgb;
  float roughness = style.surface.x;
  float f0 = 0.04;
  // Skin over a dark ground looks grey: light that comes back through it has lost its blue.
  if (kind == kCover) albedo *= vec3(1.10, 0.86, 0.74);
  if (kind == kSteel) {
    f0 = 0.75;
    // Marks every centimetre, as biopsy needles have; the fifth is wider.
    float cm = position.w * 100.0;
    float mark = abs(cm - round(cm)) * 0.01;
    float half_width = mod(round(cm), 5.0) == 0.0 ? 0.00075 : 0.0004;
    if (cm > 0.5) albedo *= mix(0.30, 1.0, smoothstep(half_width, half_width * 1.4, mark));
  }
  Shade s = shade(frame, albedo, n, v, roughness, f0);

  // Depth cue: what lies behind the focus sinks a little into the ground.
  float behind = length(position.xyz - frame.eye[gl_ViewIndex].xyz) - frame.focus_axis.w;
  float haze = clamp(behind / 0.45, 0.0, 0.45);

  float alpha = 1.0;
  if (kind == kGlass || kind == kCover) {
    float edge = pow(1.0 - facing, style.surface.z);
    alpha = mix(style.colour.a, style.surface.y, edge);
    if (kind == kCover) {
      float open = outside_window(frame, position.xyz);
      alpha *= open;
      s.specular *= open;
    }
  } else {
    s.diffuse *= mix(0.55, 1.0, smoothstep(0.0, 0.55, facing));  // darker towards the outline: reads as round
  }
  vec3 lit = tone_map(s.diffuse);
  vec3 shine = kind == kGlass || kind == kCover ? min(s.specular, vec3(0.6)) * max(alpha, 0.25) : s.specular;
  if (kind != kGlass && kind != kCover) {
    lit = tone_map(s.diffuse + s.specular);
    shine = vec3(0.0);
  }
  vec3 ground = background(gl_FragCoord.xy / frame.viewport.xy * 2.0 - 1.0);
  colour = vec4(mix(lit, ground, haze) * alpha + shine * (1.0 - haze), alpha);
}
