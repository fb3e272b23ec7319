// The anatomy in rest space: tissue of a voxel as the beam meets it. Define VOXEL_BINDING before, and TISSUE_BINDING
// where the properties of tissues are wanted.
#ifdef TISSUE_BINDING
layout(std430, binding = TISSUE_BINDING) readonly buffer Tissues {
  TissueRow tissues[];
};
#endif
layout(std430, binding = VOXEL_BINDING) readonly buffer Voxels {
  uint voxels[];  // two voxels a word: label | (body + 1) << 8
};

/// label | (body + 1) << 8; 0 outside the volume.
uint voxel_at(ivec3 voxel) {
  ivec3 size = ivec3(frame.label_nx, frame.label_ny, frame.label_nz);
  if (any(lessThan(voxel, ivec3(0))) || any(greaterThanEqual(voxel, size))) return 0u;
  int i = (voxel.z * size.y + voxel.y) * size.x + voxel.x;
  return (voxels[i >> 1] >> ((i & 1) << 4)) & 0xffffu;
}

/// Whose the voxel is, -1: nobody's.
int owner_of(uint voxel) {
  return int(voxel >> 8) - 1;
}

/// @param body  whose rest space this is, -1: none
/// @param gel   label 0 is coupling gel, not air
int tissue_at(ivec3 voxel, int body, bool gel) {
  uint both = voxel_at(voxel);
  int label = int(both & 255u);
  int owner = owner_of(both);
  // The organ that was here at rest has moved away.
  if (owner >= 0 && owner != body) return frame.filler_tissue;
  return label == 0 && gel ? frame.gel_tissue : label;
}

/// Voxel coordinates of a rest position.
vec3 voxel_position(vec3 rest) {
  return (rest - vec3(frame.label_x, frame.label_y, frame.label_z)) / frame.label_spacing;
}
