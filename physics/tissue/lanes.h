// One of four matrices side by side.
#pragma once

#include "physics/tissue/closest_rotation.h"

#include <Eigen/Core>

#include <cstddef>

namespace stylet::physics {

inline Eigen::Matrix3d of_lane(const LaneMatrix& m, int lane) {
  Eigen::Matrix3d result;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      result(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = m[i][j][lane];
    }
  }
  return result;
}

inline void set_lane(const Eigen::Matrix3d& m, int lane, LaneMatrix& to) {
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      to[i][j][lane] = m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
}

}  // namespace stylet::physics
