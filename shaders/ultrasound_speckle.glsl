// The speckle field (engine/ultrasound/speckle_field.h): lookup by rest position. Define SPECKLE_BINDING before.
layout(std430, binding = SPECKLE_BINDING) readonly buffer Speckle {
  uvec2 speckle[];
};

uint speckle_texel(vec3 x) {
  vec3 q = vec3(kSpeckleX0 * x.x + kSpeckleX1 * x.y + kSpeckleX2 * x.z,
                kSpeckleY0 * x.x + kSpeckleY1 * x.y + kSpeckleY2 * x.z,
                kSpeckleZ0 * x.x + kSpeckleZ1 * x.y + kSpeckleZ2 * x.z) * (1.0 / kSpeckleSpacing);
  ivec3 cell = ivec3(floor(q)) & (kSpeckleSize - 1);
  // Stored in bricks of 2 x 2 x 2 texels, a cache line each: neighbours in any direction are near in memory.
  ivec3 brick = cell >> 1;
  ivec3 corner = cell & 1;
  return uint((((brick.z * (kSpeckleSize / 2) + brick.y) * (kSpeckleSize / 2) + brick.x) << 3) + (corner.z << 2) +
              (corner.y << 1) + corner.x);
}

/// Looks 0 and 1 as (re, im, re, im), mean square 2 each.
vec4 first_looks(uvec2 texel) {
  return kSpeckleScale * unpackSnorm4x8(texel.x);
}

/// Look 2 as (re, im), then texture and beads.
vec4 third_look(uvec2 texel) {
  return kSpeckleScale * unpackSnorm4x8(texel.y);
}
