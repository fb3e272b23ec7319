// What heat does to the tissue round an electrode, for the pictures; in the tissue at rest, which carries it.
#pragma once

#include "engine/content/scene.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace stylet::content {

/// Cells x fastest; centre of cell (i,j,k) = origin + spacing * (i,j,k). Patient frame, m.
struct HeatedZone {
  std::uint64_t version = 0;  ///< 0: nothing was heated; another one after every change
  Surface surface{};          ///< of what is destroyed: closed, with normals; empty before there is any
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  float spacing = 0;
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  std::vector<float> gas{};   ///< [cells] bubbles, 0: none, 1: as many as there can be
  std::vector<float> dose{};  ///< [cells] ln of the thermal dose over the lethal one: destroyed where positive
};

}  // namespace stylet::content
