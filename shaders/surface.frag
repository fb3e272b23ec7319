#version 460
// Lit surfaces. The output is what the screen shows, linear and premultiplied; the attachment encodes sRGB. One pipeline a
// kind of surface: lavapipe runs all branches of a shader, so what a kind does not need is left out when it is compiled.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_multiview : require
#include "shaders/shared.h"
#include "shaders/unforeseen.glsl"

layout(constant_id = 0) const uint kind = 0;
layout(set = 0, binding = 0, std140) uniform Frame { FrameUniforms frame; };
layout(set = 0, binding = 3) uniform sampler2D screen;
layout(set = 0, binding = 4) uniform sampler2DShadow shadow_map;
layout(push_constant) uniform Push { SurfaceStyle style; };
layout(location = 0) in vec4 position;
layout(location = 1) in vec4 normal;
layout(location = 0) out vec4 colour;

// Organs lie in the patient: whatever stands over them casts no shadow into the picture that the window shows.
const bool kInside = kind == kSolid || kind == kGlass || kind == kCavity;
const bool kMirrors = kind != kCloth && kind != kCavity;
const bool kCoated = kind == kSolid || kind == kGlass || kind == kMatte;

#include "shaders/brdf.glsl"
#include "shaders/cover_window.glsl"
#include "shaders/room.glsl"
#include "shaders/lighting.glsl"
#include "shaders/shadow.glsl"

vec3 linear_of(vec3 encoded) {
  return mix(encoded / 12.92, pow((encoded + 0.055) / 1.055, vec3(2.4)), greaterThan(encoded, vec3(0.04045)));
}

/// The screen's picture, averaged over the pixel: it has no smaller versions of itself.
vec3 picture() {
  vec2 at = vec2(position.w, normal.w), dx = dFdx(at), dy = dFdy(at);
  vec3 sum = vec3(0.0);
  bool encoded = unforeseen(style.kind.z) == kEncodedPicture;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) {
      vec3 texel = texture(screen, at + (float(i) - 1.0) / 3.0 * dx + (float(j) - 1.0) / 3.0 * dy).rgb;
      sum += encoded ? linear_of(texel) : texel;
    }
  return sum / 9.0;
}

void main() {
  uint see = unforeseen(frame.see.x);
  if (kind == kGlow) {
    colour = vec4(style.colour.rgb, 1.0);
    return;
  }
  if (kind == kScreen) {
    colour = vec4(unforeseen(style.kind.z) != kNoPicture ? picture() : style.colour.rgb, 1.0);
    return;
  }
  vec3 v = normalize(frame.eye[gl_ViewIndex].xyz - position.xyz);
  vec3 n = normalize(normal.xyz);
  if (!gl_FrontFacing) n = -n;
  float facing = clamp(dot(n, v), 0.0, 1.0);
  Material m = Material(style.colour.rgb, style.surface.x, style.surface.y, style.surface.z, style.surface.w);
  if (kind == kSteel) {
    // Marks every centimetre, as biopsy needles have; the fifth is wider.
    float cm = position.w * 100.0;
    float mark = abs(cm - round(cm)) * 0.01;
    float half_width = mod(round(cm), 5.0) == 0.0 ? 0.00075 : 0.0004;
    if (cm > 0.5) m.albedo *= mix(0.12, 1.0, smoothstep(half_width, half_width * 1.4, mark));
  }
  if (kind == kCloth) {  // with a hem round its opening
    float in_cloth = outside_opening(position.xyz, vec2(position.w, normal.w));
    m.albedo = mix(vec3(0.34, 0.47, 0.52), m.albedo, smoothstep(0.010, 0.0115, in_cloth));
  }

  if (kind == kCover && see != kSeeGlass) m.albedo *= vec3(0.80, 0.72, 0.66);  // tables give it thin

  float lit = kInside ? 1.0 : lamp_seen(position.xyz, n);
  Reflected s = shade(m, position.xyz, n, v, lit);

  float alpha = 1.0;
  // Darker to the outline: reads as round. Light that has gone through skin is red.
  if (kind == kSolid) s.diffuse *= mix(0.55, 1.0, smoothstep(0.0, 0.55, facing));
  if (kind == kCover) s.diffuse *= mix(vec3(1.08, 0.97, 0.94), vec3(1.0), lit);
  if (kind == kGlass || (kind == kCover && see == kSeeGlass)) {
    alpha = mix(style.colour.a, style.glass.x, pow(1.0 - facing, style.glass.y));
    colour = vec4(tone_map(s.diffuse) * alpha + min(s.specular, vec3(0.6)) * max(alpha, 0.25), alpha);
    return;
  }
  if (kind == kCover && see == kSeeWindow) alpha = outside_window(position.xyz);
  colour = vec4(tone_map(s.diffuse + s.specular) * alpha, alpha);
}
