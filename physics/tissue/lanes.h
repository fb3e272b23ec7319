// Four matrices or rotations side by side, and one of them.
#pragma once

#include "physics/tissue/closest_rotation.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cstddef>
#include <span>

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

/// x, y, z, w of four rotations from `first` on.
inline std::array<Lanes, 4> quaternions_of(std::span<const Eigen::Quaterniond> rotations, std::size_t first) {
  std::array<Lanes, 4> q;
  for (int lane = 0; lane < kLanes; ++lane) {
    const auto& from = rotations[first + static_cast<std::size_t>(lane)].coeffs();
    for (std::size_t i = 0; i < 4; ++i) q[i][lane] = from[static_cast<Eigen::Index>(i)];
  }
  return q;
}

inline void set_quaternions(const std::array<Lanes, 4>& q, std::span<Eigen::Quaterniond> rotations,
                            std::size_t first) {
  for (int lane = 0; lane < kLanes; ++lane) {
    rotations[first + static_cast<std::size_t>(lane)].coeffs() << q[0][lane], q[1][lane], q[2][lane], q[3][lane];
  }
}

inline LaneMatrix matrix_of(const std::array<Lanes, 4>& q) {
  const auto& [x, y, z, w] = q;
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
           {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
           {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
}

}  // namespace stylet::physics
