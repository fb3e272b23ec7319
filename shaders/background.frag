#version 460
// What is seen where nothing stands: the room's floor and walls, or a plain ground.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_multiview : require
#include "shaders/shared.h"

layout(constant_id = 0) const uint room = 0;
layout(set = 0, binding = 0, std140) uniform Frame { FrameUniforms frame; };
layout(location = 0) out vec4 colour;

const bool kInside = false, kMirrors = false, kCoated = false;

#include "shaders/brdf.glsl"
#include "shaders/room.glsl"
#include "shaders/lighting.glsl"

void main() {
  vec2 at = gl_FragCoord.xy / frame.viewport.xy * 2.0 - 1.0;
  if (room == 0u) {
    colour = vec4(plain_ground(at) + dither(gl_FragCoord.xy) * 0.0006, 1.0);
    return;
  }
  vec4 on_near_plane = frame.patient_from_clip[gl_ViewIndex] * vec4(at.x, -at.y, 1.0, 1.0);
  vec3 eye = frame.eye[gl_ViewIndex].xyz;
  mat3 turn = mat3(frame.table_from_patient);
  vec3 direction = turn * normalize(on_near_plane.xyz / on_near_plane.w - eye);
  vec3 c = tone_map(room_ground((frame.table_from_patient * vec4(eye, 1.0)).xyz, direction));
  colour = vec4(c + dither(gl_FragCoord.xy) * 0.004 * max(max(c.r, c.g), 0.15), 1.0);
}
