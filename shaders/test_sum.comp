#version 460
// For tests/gpu: reads what test_fill wrote, the image through a sampler, and adds the two.
layout(local_size_x = 16, local_size_y = 8) in;
layout(set = 0, binding = 0, std430) readonly buffer Squares { uint squares[]; };
layout(set = 0, binding = 1) uniform sampler3D gradient;
layout(set = 0, binding = 2, std430) writeonly buffer Sums { float sums[]; };
layout(push_constant) uniform Push { uint side; float scale; };

void main() {
  uvec3 p = gl_GlobalInvocationID;
  if (p.x >= side || p.y >= side || p.z >= side) return;
  uint index = (p.z * side + p.y) * side + p.x;
  sums[index] = float(squares[index]) + texture(gradient, (vec3(p) + 0.5) / float(side)).r;
}
