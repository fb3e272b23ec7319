// Pass 1: from the image plane through the deformed tetrahedra to rest space, and what is found there: impedance, loss, and
// backscatter times speckle over the slice thickness. One invocation is one sample; a workgroup goes through one list of
// tetrahedra.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"
#define TISSUE_BINDING 4
#define VOXEL_BINDING 5
#include "shaders/ultrasound_labels.glsl"
#define SPECKLE_BINDING 6
#include "shaders/ultrasound_speckle.glsl"

layout(local_size_x = kTile) in;
layout(binding = 1) uniform samplerBuffer tets;  // a CutTet is six
layout(std430, binding = 2) readonly buffer Starts {
  uint starts[];
};
layout(binding = 3) uniform usamplerBuffer entries;
layout(binding = 7) uniform samplerBuffer elevation;  // [sample][kElevationRow]
layout(std430, binding = 8) writeonly buffer Echo {
  vec2 echo[];  // [look][sample][line]
};
layout(std430, binding = 9) writeonly buffer Impedance {
  float log_impedance[];
};
layout(std430, binding = 10) writeonly buffer Loss {
  float loss[];  // nepers of the sample
};
layout(std430, binding = 11) writeonly buffer Found {
  uint found[];  // texel of the slow fields | row of the tissue table << kTexelBits
};
layout(binding = 12) uniform usamplerBuffer depths;  // below the skin, kDepthUnit, of cells of kDepthCell voxels
layout(std430, binding = 13) buffer Fronts {
  uint fronts[];  // first sample in gas of each line
};
layout(binding = 14) uniform samplerBuffer zone;  // gas, dose of the cells of the heated zone

/// What heat has done at a rest position: gas, share that is dead, and the rim between.
vec3 heated_at(vec3 x) {
  vec3 q = (x - vec3(frame.zone_x, frame.zone_y, frame.zone_z)) / frame.zone_spacing;
  ivec3 size = ivec3(frame.zone_nx, frame.zone_ny, frame.zone_nz);
  vec3 base = floor(q);
  vec3 f = q - base;
  bool inside = all(greaterThanEqual(base, vec3(0.0))) && all(lessThan(base, vec3(size - 1)));
  vec2 mixed = vec2(0.0);
  for (int corner = inside ? 0 : 8; corner < 8; ++corner) {
    ivec3 d = ivec3(corner & 1, (corner >> 1) & 1, corner >> 2);
    vec3 w = mix(1.0 - f, f, vec3(d));
    ivec3 cell = ivec3(base) + d;
    mixed += w.x * w.y * w.z * texelFetch(zone, (cell.z * size.y + cell.y) * size.x + cell.x).xy;
  }
  float dose = (2.0 * mixed.y - 1.0) * kMostDose;
  return vec3(mixed.x, smoothstep(-kCoagulatedEdge, kCoagulatedEdge, dose), 1.0 - smoothstep(0.0, kRimWidth, abs(dose)));
}

/// Depth below the skin at a voxel position, m.
float layer_depth(vec3 q) {
  vec3 base = floor(q / float(kDepthCell));
  vec3 f = q / float(kDepthCell) - base;
  ivec3 size = ivec3(frame.depth_nx, frame.depth_ny, frame.depth_nz);
  float mixed = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    ivec3 d = ivec3(corner & 1, (corner >> 1) & 1, corner >> 2);
    vec3 w = mix(1.0 - f, f, vec3(d));
    ivec3 cell = clamp(ivec3(base) + d, ivec3(0), size - 1);
    mixed += w.x * w.y * w.z * float(texelFetch(depths, (cell.z * size.y + cell.y) * size.x + cell.x).x);
  }
  return kDepthUnit * mixed;
}

void main() {
  int l = int(gl_GlobalInvocationID.x);
  int s = int(gl_GlobalInvocationID.y);
  vec2 p = sample_position(l, s);
  vec3 position = frame.origin.xyz + p.x * frame.lateral.xyz + p.y * frame.axial.xyz;
  vec3 across = frame.elevation.xyz;
  float body = -1.0;

  uint tile = gl_WorkGroupID.y / uint(kTile) * uint(frame.tile_columns) + gl_WorkGroupID.x;
  uint end = starts[tile + 1];
  for (uint e = starts[tile]; e < end; ++e) {
    int t = 6 * int(texelFetch(entries, int(e)).x);
    vec4 row0 = texelFetch(tets, t);
    vec4 row1 = texelFetch(tets, t + 1);
    vec4 row2 = texelFetch(tets, t + 2);
    vec3 b = vec3(row0.x + row0.y * p.x + row0.z * p.y, row1.x + row1.y * p.x + row1.z * p.y,
                  row2.x + row2.y * p.x + row2.z * p.y);
    if (min(min(b.x, b.y), min(b.z, 1.0 - (b.x + b.y + b.z))) >= kInsideTet) {
      vec4 rest0 = texelFetch(tets, t + 3);
      vec4 rest1 = texelFetch(tets, t + 4);
      vec4 rest2 = texelFetch(tets, t + 5);
      position = vec3(rest0.x + rest0.y * p.x + rest0.z * p.y, rest1.x + rest1.y * p.x + rest1.z * p.y,
                      rest2.x + rest2.y * p.x + rest2.z * p.y);
      across = vec3(rest0.w, rest1.w, rest2.w);
      body = row0.w;
      break;
    }
  }
  if (kBreathing && body < 0.0) {
    vec3 before = position - frame.breath.xyz;
    if (breathes_at(voxel_position(before))) {
      position = before;
      body = frame.breath.w;
    }
  }
  if (l >= frame.lines) return;

  bool gel = sample_range(s) < frame.coupling;
  vec3 voxel = voxel_position(position);
  uint here = voxel_at(ivec3(floor(voxel + 0.5)));
  Mixture around = mixture_at(voxel, here, int(body), gel);
  int tissue = around.share < 0.5 ? around.other : around.tissue;
  vec2 mixed = mix(vec2(tissues[around.other].log_impedance, tissues[around.other].loss),
                   vec2(tissues[around.tissue].log_impedance, tissues[around.tissue].loss), around.share);

  vec3 lattice = speckle_lattice(position);
  int weights = s * kElevationRow;
  vec3 plane_step = texelFetch(elevation, weights + kElevationRow - 1).x * across;
  vec3 grain = frame.grain * lattice;
  vec3 grain_step = grain_lattice(plane_step);
  vec3 voxel_step = plane_step / frame.label_spacing;
  int last_plane = frame.planes / 2;
  vec2 sum0 = vec2(0.0);
  vec2 sum1 = vec2(0.0);
  vec2 sum2 = vec2(0.0);
  // Where all planes lie in one tissue, as most do, its label is known.
  vec3 reach = float(last_plane) * abs(voxel_step);
  bool clear = float(clearance_of(here)) > 1.0 + max(reach.x, max(reach.y, reach.z));
  float level = 0.70710678 * tissues[tissue].backscatter;
  for (int plane = clear ? -last_plane : last_plane + 1; plane <= last_plane; ++plane) {
    uint texel = speckle_texel(grain + float(plane) * grain_step);
    float w = level * texelFetch(elevation, weights + abs(plane)).x;
    sum0 += w * speckle_of_look(0u, texel);
    if (kLooks > 1) sum1 += w * speckle_of_look(1u, texel);
    if (kLooks > 2) sum2 += w * speckle_of_look(2u, texel);
  }
  // Elsewhere the tissue of each scatterer is drawn from the two around it, by bits that belong to its place.
  for (int plane = clear ? last_plane + 1 : -last_plane; plane <= last_plane; ++plane) {
    uint texel = speckle_texel(grain + float(plane) * grain_step);
    vec3 q = voxel + float(plane) * voxel_step;
    Mixture drawn = mixture_at(q, voxel_at(ivec3(floor(q + 0.5))), int(body), gel);
    bool first = float(hash(texel) >> 8) < 16777216.0 * drawn.share;
    float w = 0.70710678 * tissues[first ? drawn.tissue : drawn.other].backscatter * texelFetch(elevation, weights + abs(plane)).x;
    sum0 += w * speckle_of_look(0u, texel);
    if (kLooks > 1) sum1 += w * speckle_of_look(1u, texel);
    if (kLooks > 2) sum2 += w * speckle_of_look(2u, texel);
  }

  if (kHeated && unforeseen(frame.zone_nx) > 0) {
    vec3 heated = heated_at(position);
    float patches = slow_pair(slow_texel(lattice)).y;
    float tissue_gain = exp(kCoagulatedEcho * heated.y + kRimEcho * heated.z);
    float bubbles = 0.70710678 * kBubbleEcho * heated.x * exp(kBubblePatches * patches);
    uint texel = speckle_texel(grain);
    sum0 = tissue_gain * sum0 + bubbles * speckle_of_look(0u, texel);
    if (kLooks > 1) sum1 = tissue_gain * sum1 + bubbles * speckle_of_look(1u, texel);
    if (kLooks > 2) sum2 = tissue_gain * sum2 + bubbles * speckle_of_look(2u, texel);
    mixed.y += kBubbleLoss * heated.x + kCoagulatedLoss * heated.y;
  }

  float layering = kLayered ? tissues[tissue].layering : 0.0;
  if (layering > 0.0) {
    float finer = kTextureFwhm / kLayerFwhm;
    lattice = finer / layering * lattice +
              (finer - finer / layering) / kSpeckleSpacing * layer_depth(voxel) * vec3(kLayerX, kLayerY, kLayerZ);
  }
  int index = polar_index(l, s);
  echo[index] = sum0;
  if (kLooks > 1) echo[index + polar_size()] = sum1;
  if (kLooks > 2) echo[index + 2 * polar_size()] = sum2;
  log_impedance[index] = mixed.x;
  loss[index] = mixed.y * frame.sample_pitch;
  found[index] = slow_texel(lattice) | uint(tissue) << kTexelBits;
  if (tissues[tissue].mirror + tissues[tissue].ring_down > 0.0) atomicMin(fronts[l], uint(s));
}
