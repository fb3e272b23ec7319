#version 460
// For tests/gpu: writes the invocation's index into a buffer, and a gradient into a 3-D image.
layout(local_size_x = 16, local_size_y = 8) in;
layout(set = 0, binding = 0, std430) buffer Squares { uint squares[]; };
layout(set = 0, binding = 1, r32f) uniform writeonly image3D gradient;
layout(push_constant) uniform Push { uint side; float scale; };

void main() {
  uvec3 p = gl_GlobalInvocationID;
  if (p.x >= side || p.y >= side || p.z >= side) return;
  uint index = (p.z * side + p.y) * side + p.x;
  squares[index] = index * index;
  imageStore(gradient, ivec3(p), vec4(scale * float(p.x + 10u * p.y + 100u * p.z)));
}
