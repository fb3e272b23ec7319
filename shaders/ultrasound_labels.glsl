// The anatomy in rest space: tissue of a voxel as the beam meets it. Define VOXEL_BINDING before, and TISSUE_BINDING
// where the properties of tissues are wanted, which need no voxels.
#ifdef TISSUE_BINDING
layout(std140, binding = TISSUE_BINDING) uniform Tissues {
  TissueRow tissues[kTissueRows];
};
#endif
#ifdef VOXEL_BINDING
layout(binding = VOXEL_BINDING) uniform usamplerBuffer voxels;

/// A word (engine/ultrasound/voxel_words.h); beyond the volume as at its border, far away the outside.
uint voxel_at(ivec3 voxel) {
  ivec3 size = ivec3(frame.label_nx, frame.label_ny, frame.label_nz);
  ivec3 wanted = voxel;
  voxel = clamp(voxel, ivec3(0), size - 1);
  if (any(greaterThan(abs(wanted - voxel), ivec3(kBeyond)))) return kFarOutside;
  return texelFetch(voxels, (voxel.z * size.y + voxel.y) * size.x + voxel.x).x;
}

/// The eight voxels around a place that is not far outside.
struct Cell {
  ivec3 low;  // of them, within the volume
  ivec3 high;
  vec3 f;     // way from the one to the other
};

Cell cell_at(vec3 q) {
  ivec3 last = ivec3(frame.label_nx, frame.label_ny, frame.label_nz) - 1;
  vec3 base = floor(q);
  return Cell(clamp(ivec3(base), ivec3(0), last), clamp(ivec3(base) + 1, ivec3(0), last), q - base);
}

/// @param[out] weight  trilinear
uint corner_of(Cell cell, int corner, out float weight) {
  bvec3 high = bvec3((corner & 1) != 0, (corner & 2) != 0, (corner & 4) != 0);
  vec3 w = mix(1.0 - cell.f, cell.f, high);
  ivec3 v = mix(cell.low, cell.high, high);
  weight = w.x * w.y * w.z;
  return texelFetch(voxels, (v.z * frame.label_ny + v.y) * frame.label_nx + v.x).x;
}

/// Whose the voxel is, -1: nobody's.
int owner_of(uint voxel) {
  return int((voxel >> 8) & 7u) - 1;
}

/// All voxels nearer than this, along every axis, are as this one.
int clearance_of(uint voxel) {
  return max(int(voxel >> 11) + 2 - kEdges, 1);
}

/// Of a voxel beside one that differs: from its centre to the surface between them, voxels.
float edge_of(uint voxel) {
  return float((voxel >> 11) + 1u) / kEdgesPerVoxel;
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

/// What lies at a place: one tissue, or near a surface two, the second's share rising through it over a voxel.
struct Mixture {
  int tissue;   // of the nearest voxel
  int other;
  float share;  // of `tissue`
};

/// The surface lies where the distances of the eight voxels around to it, counted negative on the other side, cancel.
/// @param here  word of the nearest voxel
Mixture mixture_at(vec3 q, uint here, int body, bool gel) {
  Mixture found = Mixture(tissue_of(here, body, gel), 0, 1.0);
  found.other = found.tissue;
  if (clearance_of(here) >= 2) return found;
  Cell cell = cell_at(q);
  float distance = 0.0;
  float most = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    float weight;
    uint word = corner_of(cell, corner, weight);
    weight *= edge_of(word);
    int tissue = tissue_of(word, body, gel);
    bool same = tissue == found.tissue;
    distance += same ? weight : -weight;
    if (!same && weight > most) {
      most = weight;
      found.other = tissue;
    }
  }
  if (most > 0.0) found.share = clamp(0.5 + distance, 0.0, 1.0);
  return found;
}

/// Whether a place belongs to what goes with the breath.
bool breathes_at(vec3 q) {
  int breath = int(frame.breath.w);
  uint here = voxel_at(ivec3(floor(q + 0.5)));
  if (clearance_of(here) >= 2) return owner_of(here) == breath;
  Cell cell = cell_at(q);
  float distance = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    float weight;
    uint word = corner_of(cell, corner, weight);
    distance += weight * (owner_of(word) == breath ? edge_of(word) : -edge_of(word));
  }
  return distance > 0.0;
}

/// Voxel coordinates of a rest position.
vec3 voxel_position(vec3 rest) {
  return (rest - vec3(frame.label_x, frame.label_y, frame.label_z)) / frame.label_spacing;
}
#endif
