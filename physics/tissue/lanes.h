// Four matrices or rotations side by side, and one of them.
#pragma once

#include "physics/tissue/closest_rotation.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <immintrin.h>

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

inline LaneMatrix cofactors_of(const LaneMatrix& f) {
  LaneMatrix c;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t i1 = (i + 1) % 3;
      const std::size_t i2 = (i + 2) % 3;
      const std::size_t j1 = (j + 1) % 3;
      const std::size_t j2 = (j + 2) % 3;
      c[i][j] = f[i1][j1] * f[i2][j2] - f[i1][j2] * f[i2][j1];
    }
  }
  return c;
}

inline LaneMatrix difference(const LaneMatrix& a, const LaneMatrix& b) {
  LaneMatrix c;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) c[i][j] = a[i][j] - b[i][j];
  }
  return c;
}

/// Rows for columns.
inline std::array<Lanes, 4> transposed(const std::array<Lanes, 4>& rows) {
  const __m256d r0 = _mm256_loadu_pd(rows[0].data()), r1 = _mm256_loadu_pd(rows[1].data());
  const __m256d r2 = _mm256_loadu_pd(rows[2].data()), r3 = _mm256_loadu_pd(rows[3].data());
  const __m256d low01 = _mm256_unpacklo_pd(r0, r1), high01 = _mm256_unpackhi_pd(r0, r1);
  const __m256d low23 = _mm256_unpacklo_pd(r2, r3), high23 = _mm256_unpackhi_pd(r2, r3);
  std::array<Lanes, 4> columns;
  _mm256_storeu_pd(columns[0].data(), _mm256_permute2f128_pd(low01, low23, 0x20));
  _mm256_storeu_pd(columns[1].data(), _mm256_permute2f128_pd(high01, high23, 0x20));
  _mm256_storeu_pd(columns[2].data(), _mm256_permute2f128_pd(low01, low23, 0x31));
  _mm256_storeu_pd(columns[3].data(), _mm256_permute2f128_pd(high01, high23, 0x31));
  return columns;
}

/// x, y, z, w of four rotations from `first` on.
inline std::array<Lanes, 4> quaternions_of(std::span<const Eigen::Quaterniond> rotations, std::size_t first) {
  std::array<Lanes, 4> of_lanes;
  for (std::size_t lane = 0; lane < kLanes; ++lane) of_lanes[lane] = rotations[first + lane].coeffs().array();
  return transposed(of_lanes);
}

inline void set_quaternions(const std::array<Lanes, 4>& q, std::span<Eigen::Quaterniond> rotations,
                            std::size_t first) {
  const std::array<Lanes, 4> of_lanes = transposed(q);
  for (std::size_t lane = 0; lane < kLanes; ++lane) rotations[first + lane].coeffs() = of_lanes[lane].matrix();
}

inline LaneMatrix matrix_of(const std::array<Lanes, 4>& q) {
  const auto& [x, y, z, w] = q;
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
           {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
           {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
}

}  // namespace stylet::physics
