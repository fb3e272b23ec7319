// What lies inside an imported organ: vessels, tumours and regions as tissues of its tetrahedra and as a label
// volume.
#pragma once

#include "engine/content/scene.h"
#include "engine/import/organ_import.h"
#include "engine/readers/anatomy.h"

#include <span>
#include <string>
#include <vector>

namespace stylet::import {

struct OrganLabels {
  std::vector<std::uint8_t> tet_tissue;                 ///< [tets] index into the tissues, by the centroid
  std::vector<physics::ElasticMaterial> tet_mechanics;  ///< [tets] mean over the volume (deformable.h)
  content::LabelVolume volume;                          ///< the organ at rest and what lies in it; 0 around it
};

/// @param tissue   of the organ, index into `tissues`
/// @param inside   with role, tissue and closed surface; where they overlap the later one counts
/// @param spacing  of the volume, m; it grows until the volume fits
OrganLabels label_organ(const ImportedOrgan& organ, int tissue, std::vector<readers::Organ> inside,
                        std::span<const content::Tissue> tissues, double spacing = 1e-3);

/// The tissues that occur, by label.
std::vector<LabelReport> count_labels(const OrganLabels& labels, std::span<const content::Tissue> tissues);

/// The volume as a legacy VTK file (structured points, binary bytes, version 3.0), which ParaView and 3D Slicer open.
std::string labels_vtk(const std::string& id, const content::LabelVolume& volume);

}  // namespace stylet::import
