// The anatomy in rest space: tissue of a voxel as the beam meets it. Define VOXEL_BINDING before, and TISSUE_BINDING
// where the properties of tissues are wanted, which need no voxels.
#ifdef TISSUE_BINDING
layout(std140, binding = TISSUE_BINDING) uniform Tissues {
  TissueRow tissues[kTissueRows];
};
#endif
#ifdef VOXEL_BINDING
layout(binding = VOXEL_BINDING) uniform usamplerBuffer voxels;

/// label | (body + 1) << 8 | clearance << 11; beyond the volume as at its border, far away 0.
uint voxel_at(ivec3 voxel) {
  ivec3 size = ivec3(frame.label_nx, frame.label_ny, frame.label_nz);
  ivec3 wanted = voxel;
  voxel = clamp(voxel, ivec3(0), size - 1);
  if (any(greaterThan(abs(wanted - voxel), ivec3(kBeyond)))) return 0u;
  return texelFetch(voxels, (voxel.z * size.y + voxel.y) * size.x + voxel.x).x;
}

/// Whose the voxel is, -1: nobody's.
int owner_of(uint voxel) {
  return int((voxel >> 8) & 7u) - 1;
}

/// All voxels nearer than this, along every axis, are as this one.
int clearance_of(uint voxel) {
  return int(voxel >> 11);
}

/// @param body  whose rest space this is, -1: none
/// @param gel   label 0 is coupling gel, not air
int tissue_of(uint voxel, int body, bool gel) {
  int label = int(voxel & 255u);
  int owner = owner_of(voxel);
  // The organ that was here at rest has moved away.
  if (owner >= 0 && owner != body) return frame.filler_tissue;
  return label == 0 && gel ? frame.gel_tissue : label;
}

/// Voxel coordinates of a rest position.
vec3 voxel_position(vec3 rest) {
  return (rest - vec3(frame.label_x, frame.label_y, frame.label_z)) / frame.label_spacing;
}
#endif
