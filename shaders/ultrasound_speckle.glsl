// The speckle field (engine/ultrasound/speckle_field.h): lookup by rest position. Define SPECKLE_BINDING before.
layout(binding = SPECKLE_BINDING) uniform samplerBuffer speckle;

/// From rest space to the lattice, in texels. Linear.
vec3 speckle_lattice(vec3 x) {
  return vec3(kSpeckleX0 * x.x + kSpeckleX1 * x.y + kSpeckleX2 * x.z,
              kSpeckleY0 * x.x + kSpeckleY1 * x.y + kSpeckleY2 * x.z,
              kSpeckleZ0 * x.x + kSpeckleZ1 * x.y + kSpeckleZ2 * x.z) * (1.0 / kSpeckleSpacing);
}

/// The same to the lattice of the looks, which is as fine as the probe.
vec3 grain_lattice(vec3 x) {
  return frame.grain * speckle_lattice(x);
}

/// Place of the texel that holds a point of the lattice, in a field of a look: bricks of 4 x 4 x 4, two cache lines each.
uint speckle_texel(vec3 lattice) {
  ivec3 cell = ivec3(floor(lattice));
  ivec3 box = cell >> 6;
  uint shift = uint(box.x + (box.y << 6) + (box.z << 12)) * 2654435769u;
  shift = ((shift ^ (shift >> 15)) * 2246822519u) >> 14;
  cell = (cell + ivec3(shift & 63u, (shift >> 6) & 63u, (shift >> 12) & 63u)) & (kSpeckleSize - 1);
  return uint((cell.z & ~3) << 12 | (cell.y & ~3) << 8 | (cell.x & ~3) << 4 | (cell.z & 3) << 4 | (cell.y & 3) << 2 |
              (cell.x & 3));
}

/// The same in the slow fields.
uint slow_texel(vec3 lattice) {
  ivec3 cell = ivec3(floor(lattice)) & ivec3(kSlowSize - 1, kSlowSize - 1, kSlowDepth - 1);
  return uint((cell.z & ~3) << 14 | (cell.y & ~3) << 9 | (cell.x & ~3) << 4 | (cell.z & 3) << 4 | (cell.y & 3) << 2 |
              (cell.x & 3));
}

vec2 speckle_pair(uint index) {
  return kSpeckleScale * texelFetch(speckle, int(index)).xy;
}

/// Real and imaginary part, mean square 2.
vec2 speckle_of_look(uint look, uint texel) {
  return speckle_pair(look * kSpeckleTexels + texel);
}

/// Slow texture and beads.
vec2 slow_pair(uint texel) {
  return speckle_pair(uint(kMaxLooks) * kSpeckleTexels + texel);
}
