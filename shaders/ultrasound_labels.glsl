// The anatomy in rest space: tissue of a voxel as the beam meets it. Define TISSUE_BINDING and VOXEL_BINDING before.
layout(std430, binding = TISSUE_BINDING) readonly buffer Tissues {
  TissueRow tissues[];
};
layout(std430, binding = VOXEL_BINDING) readonly buffer Voxels {
  uint voxels[];  // two voxels a word: label | (body + 1) << 8
};

/// @param body  deformable body whose rest space this is, -1: none
/// @param gel   label 0 is coupling gel, not air
int tissue_at(ivec3 voxel, int body, bool gel) {
  ivec3 size = ivec3(frame.label_nx, frame.label_ny, frame.label_nz);
  if (any(lessThan(voxel, ivec3(0))) || any(greaterThanEqual(voxel, size))) return gel ? frame.gel_tissue : 0;
  int i = (voxel.z * size.y + voxel.y) * size.x + voxel.x;
  uint both = voxels[i >> 1] >> ((i & 1) << 4);
  int label = int(both & 255u);
  int owner = int((both >> 8) & 255u) - 1;
  // The organ that was here at rest has moved away.
  if (owner >= 0 && owner != body) return frame.filler_tissue;
  return label == 0 && gel ? frame.gel_tissue : label;
}

/// Voxel coordinates of a rest position.
vec3 voxel_position(vec3 rest) {
  return (rest - vec3(frame.label_x, frame.label_y, frame.label_z)) / frame.label_spacing;
}
