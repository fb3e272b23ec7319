#include "engine/import/organ_labels.h"

#include "engine/readers/deformable.h"
#include "engine/readers/label_volume.h"

#include <fmt/format.h>

#include <algorithm>

namespace stylet::import {

OrganLabels label_organ(const ImportedOrgan& organ, int tissue, std::vector<readers::Organ> inside,
                        std::span<const content::Tissue> tissues, double spacing) {
  readers::Organ boundary;
  boundary.id = organ.id;
  boundary.tissue = tissue;
  content::DeformableBody body;
  body.name = organ.id;
  body.mesh = organ.mesh;
  std::vector<readers::LabelledSolid> solids{{&organ.surface, static_cast<std::uint8_t>(tissue)}};
  for (readers::Organ& part : inside) {
    part.body = organ.id;
    solids.push_back({&part.mesh, static_cast<std::uint8_t>(part.tissue)});
  }
  readers::give_tissues(boundary, inside, tissues, body);
  return {.tet_tissue = std::move(body.tet_tissue),
          .tet_mechanics = std::move(body.tet_mechanics),
          .volume = readers::voxelise(solids, spacing, std::nullopt)};
}

std::vector<LabelReport> count_labels(const OrganLabels& labels, std::span<const content::Tissue> tissues) {
  std::vector<LabelReport> counts;
  for (std::size_t t = 1; t < tissues.size(); ++t) {  // 0 is outside
    const auto label = static_cast<std::uint8_t>(t);
    const auto voxels = std::count(labels.volume.labels.begin(), labels.volume.labels.end(), label);
    const auto tets = std::count(labels.tet_tissue.begin(), labels.tet_tissue.end(), label);
    if (voxels == 0 && tets == 0) continue;
    const double spacing = labels.volume.spacing;
    counts.push_back({.label = static_cast<int>(t),
                      .tissue = tissues[t].name,
                      .volume = static_cast<double>(voxels) * spacing * spacing * spacing,
                      .tetrahedra = static_cast<std::size_t>(tets)});
  }
  return counts;
}

std::string labels_vtk(const std::string& id, const content::LabelVolume& volume) {
  const Eigen::Vector3i& n = volume.size;
  std::string file = fmt::format(
      "# vtk DataFile Version 3.0\nStylet organ {}, tissues: metres, +X left, +Y superior, +Z anterior\nBINARY\n"
      "DATASET STRUCTURED_POINTS\nDIMENSIONS {} {} {}\nORIGIN {} {} {}\nSPACING {} {} {}\n"
      "POINT_DATA {}\nSCALARS tissue unsigned_char 1\nLOOKUP_TABLE default\n",
      id, n.x(), n.y(), n.z(), volume.origin.x(), volume.origin.y(), volume.origin.z(), volume.spacing,
      volume.spacing, volume.spacing, volume.labels.size());
  file.append(reinterpret_cast<const char*>(volume.labels.data()), volume.labels.size());
  return file + "\n";
}

}  // namespace stylet::import
