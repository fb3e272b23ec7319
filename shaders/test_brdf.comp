#version 460
// How much of an even white light a surface reflects: the directional albedo of brdf.glsl, integrated over all directions.
// One invocation a material and direction of sight.
#extension GL_GOOGLE_include_directive : require
#include "shaders/brdf.glsl"

layout(local_size_x = 64) in;
struct Case {
  vec4 albedo;   // rgb; w: cosine of the direction of sight
  vec4 surface;  // roughness, metalness, wrap, coat
};
layout(set = 0, binding = 0, std430) readonly buffer Cases { Case cases[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Sums { vec4 sums[]; };
layout(push_constant) uniform Push { uint count; };

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= count) return;
  Case c = cases[i];
  Material m = Material(c.albedo.rgb, c.surface.x, c.surface.y, c.surface.z, c.surface.w);
  vec3 n = vec3(0.0, 0.0, 1.0), v = vec3(sqrt(1.0 - c.albedo.w * c.albedo.w), 0.0, c.albedo.w);
  const uint rings = 192u, sides = 384u;  // of equal solid angle
  vec3 sum = vec3(0.0);
  for (uint r = 0u; r < rings; ++r) {
    float z = 1.0 - 2.0 * (float(r) + 0.5) / float(rings), s = sqrt(1.0 - z * z);
    for (uint k = 0u; k < sides; ++k) {
      float angle = 2.0 * kPi * (float(k) + 0.5) / float(sides);
      Reflected at = reflected(m, n, v, vec3(s * cos(angle), s * sin(angle), z), true, true);
      sum += at.diffuse + at.specular;
    }
  }
  sums[i] = vec4(sum * 4.0 * kPi / float(rings * sides), 0.0);
}
