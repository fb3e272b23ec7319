#version 460
// Places every vertex: carried by the nodes of a tetrahedron, fixed in the patient, going with the breath, or riding on
// the probe.
// A normal goes with F^-T, F the deformation gradient of the tetrahedron: with edges D at rest and d now, F = d D^-1 and
// F^-T n = d^-T (D^T n), which the cross products below form without an inverse (up to the factor det d).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shaders/shared.h"

layout(local_size_x = 64) in;
layout(set = 0, binding = 0, std430) readonly buffer Rest { RestVertex rest[]; };
layout(set = 0, binding = 1, scalar) readonly buffer RestNodes { vec3 rest_nodes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Nodes { vec3 nodes[]; };
layout(set = 0, binding = 3, std430) writeonly buffer Drawn { DrawnVertex drawn[]; };
layout(set = 0, binding = 4, std140) uniform Frame { FrameUniforms frame; };
layout(push_constant) uniform Push { DeformPush push; };

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.vertex_count) return;
  RestVertex v = rest[i];
  vec3 position = v.weights.xyz;
  vec3 normal = v.normal.xyz;
  if (v.nodes.x == kFixedToProbe) {
    position = (frame.patient_from_probe * vec4(position, 1.0)).xyz;
    normal = mat3(frame.patient_from_probe) * normal;
  } else if (v.nodes.x == kFixedToBreath) {
    position += frame.breath.xyz;
  } else if (v.nodes.x != kFixedToPatient) {
    vec3 x0 = nodes[v.nodes.x], x1 = nodes[v.nodes.y], x2 = nodes[v.nodes.z], x3 = nodes[v.nodes.w];
    vec3 r0 = rest_nodes[v.nodes.x];
    position = v.weights.x * x0 + v.weights.y * x1 + v.weights.z * x2 + v.weights.w * x3;
    vec3 m = vec3(dot(rest_nodes[v.nodes.y] - r0, normal), dot(rest_nodes[v.nodes.z] - r0, normal),
                  dot(rest_nodes[v.nodes.w] - r0, normal));
    vec3 d1 = x1 - x0, d2 = x2 - x0, d3 = x3 - x0;
    vec3 carried = m.x * cross(d2, d3) + m.y * cross(d3, d1) + m.z * cross(d1, d2);
    if (dot(d1, cross(d2, d3)) < 0.0) carried = -carried;
    float size = dot(carried, carried);
    if (size > 0.0) normal = carried * inversesqrt(size);
  }
  drawn[i].position = vec4(position, v.at.x);
  drawn[i].normal = vec4(normal, v.at.y);
}
