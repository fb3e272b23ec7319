// How deep every place of the patient lies below the skin: the layers of the body run along it.
#pragma once

#include "engine/content/scene.h"

#include <Eigen/Core>

#include <cstdint>
#include <span>
#include <vector>

namespace stylet::ultrasound {

/// A coarse volume of depths, of which the passes look up the trilinear mix.
struct LayerDepth {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();  ///< 0: no tissue of the scene is layered
  std::vector<std::uint16_t> depth;                ///< kDepthUnit, x fastest; cell (i, j, k) is centred on voxel
                                                   ///< kDepthCell (i, j, k) of the labels

  /// @param words  engine/ultrasound/voxel_words.h, of scene.labels
  static LayerDepth of(const content::Scene& scene, std::span<const std::uint16_t> words);

  /// At a position in voxels of the labels, m.
  float at(const Eigen::Vector3f& voxel) const;
};

}  // namespace stylet::ultrasound
