// The shape functions of a quadratic tetrahedron at its four points, side by side. Internal to its mechanics.
//
// With barycentric L a corner has N = L_k (2 L_k - 1), the middle of an edge N = 4 L_k L_l. The positions of the ten
// nodes along an axis are a symmetric matrix X: X_kk is corner k, X_kl the middle of edge kl. At point p, where L_p
// is kPointNear and the others kPointFar, the derivative of a position is
//   dx/dL_k = 4 (kPointNear - kPointFar) X_kp + 4 kPointFar sum_l X_kl - X_kk (eq. 42b)
// so of an element no gradients need be kept, but how its own coordinates xi_k = L_k, k = 1 to 3, change in space.
#pragma once

#include "physics/tissue/closest_rotation.h"
#include "physics/tissue/lanes.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>

namespace stylet::physics {

// Four points, exact for quadratic integrands.
inline constexpr double kPointNear = 0.58541019662496845446;
inline constexpr double kPointFar = 0.13819660112501051518;

/// X of the three axes, by rows, from corner 0 on: what is small next to the body is rounded less.
using NodeLanes = std::array<std::array<Lanes, 4>, 3>;

inline NodeLanes node_lanes(const QuadraticRest& rest, const Eigen::Matrix3Xd& positions) {
  std::array<const double*, 10> x;
  for (std::size_t a = 0; a < x.size(); ++a) x[a] = positions.col(rest.nodes[a]).data();
  NodeLanes lanes;
  for (std::size_t i = 0; i < 3; ++i) {
    const double from = x[0][i];
    lanes[i][0] = Lanes(from, x[4][i], x[5][i], x[6][i]) - from;
    lanes[i][1] = Lanes(x[4][i], x[1][i], x[7][i], x[8][i]) - from;
    lanes[i][2] = Lanes(x[5][i], x[7][i], x[2][i], x[9][i]) - from;
    lanes[i][3] = Lanes(x[6][i], x[8][i], x[9][i], x[3][i]) - from;
  }
  return lanes;
}

/// Of four rows the entries on the diagonal.
inline Lanes diagonal_of(const std::array<Lanes, 4>& rows) {
  return {rows[0][0], rows[1][1], rows[2][2], rows[3][3]};
}

/// F of the points.
inline LaneMatrix deformation_gradients(const QuadraticRest& rest, const NodeLanes& x) {
  LaneMatrix f;
  for (std::size_t i = 0; i < 3; ++i) {
    const Lanes same = 4 * kPointFar * (x[i][0] + x[i][1] + x[i][2] + x[i][3]) - diagonal_of(x[i]);  // at all points
    std::array<Lanes, 3> natural;
    for (std::size_t k = 0; k < 3; ++k) {
      natural[k] =
          4 * (kPointNear - kPointFar) * (x[i][k + 1] - x[i][0]) + (same[static_cast<Eigen::Index>(k) + 1] - same[0]);
    }
    for (std::size_t j = 0; j < 3; ++j) {
      f[i][j] = natural[0] * rest.natural[0][j] + natural[1] * rest.natural[1][j] + natural[2] * rest.natural[2][j];
    }
  }
  return f;
}

inline LaneMatrix deformation_gradients(const QuadraticRest& rest, const Eigen::Matrix3Xd& positions) {
  return deformation_gradients(rest, node_lanes(rest, positions));
}

/// Forces of stress on the nodes, to add(node of the element, axis, N): the transpose of deformation_gradients().
/// @param p  first Piola-Kirchhoff stress times the volume of the point, N m
template <typename Add>
void add_nodal_forces(const QuadraticRest& rest, const LaneMatrix& p, const Add& add) {
  for (std::size_t i = 0; i < 3; ++i) {
    std::array<Lanes, 4> t;  // work per dx/dL_k
    for (std::size_t k = 0; k < 3; ++k) {
      t[k + 1] = p[i][0] * rest.natural[k][0] + p[i][1] * rest.natural[k][1] + p[i][2] * rest.natural[k][2];
    }
    t[0] = -(t[1] + t[2] + t[3]);
    const std::array<Lanes, 4> of_points = transposed(t);
    const Lanes sums = of_points[0] + of_points[1] + of_points[2] + of_points[3];
    const Lanes corners = (4 * kPointFar - 1) * sums + 4 * (kPointNear - kPointFar) * diagonal_of(t);
    for (std::size_t k = 0; k < 4; ++k) add(k, i, corners[static_cast<Eigen::Index>(k)]);
    std::array<Lanes, 3> edges;
    for (std::size_t k = 0; k < 3; ++k) {
      edges[k] = 4 * (kPointNear - kPointFar) * (t[k] + of_points[k]) +
                 4 * kPointFar * (sums[static_cast<Eigen::Index>(k)] + sums);
    }
    for (Eigen::Index l = 1; l < 4; ++l) add(3 + static_cast<std::size_t>(l), i, edges[0][l]);
    add(7, i, edges[1][2]);
    add(8, i, edges[1][3]);
    add(9, i, edges[2][3]);
  }
}

/// Of the eight tetrahedra of an element, in order.
using OfTets = std::array<Lanes, 2>;

/// Six times their volumes; the inner four may have the other sign, the same at rest and now.
inline OfTets tet_determinants(const QuadraticRest& rest, const NodeLanes& x, const Eigen::Matrix3Xd& positions) {
  const auto product = [](const std::array<Lanes, 3>& a, const std::array<Lanes, 3>& b,
                          const std::array<Lanes, 3>& c) {
    return Lanes((a[1] * b[2] - a[2] * b[1]) * c[0] +
                 ((a[2] * b[0] - a[0] * b[2]) * c[1] + (a[0] * b[1] - a[1] * b[0]) * c[2]));
  };
  // Node j of the tetrahedron at corner i is X_ij.
  std::array<std::array<Lanes, 3>, 3> edges;
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < 3; ++i) edges[k][i] = x[i][k + 1] - x[i][0];
  }
  // The others lie around a diagonal, each between two nodes of a ring.
  std::array<const double*, 6> inner;
  for (std::size_t n = 0; n < inner.size(); ++n) inner[n] = positions.col(rest.inner[n]).data();
  std::array<Lanes, 3> diagonal;
  std::array<Lanes, 3> spoke;
  std::array<Lanes, 3> next;
  for (std::size_t i = 0; i < 3; ++i) {
    const double from = inner[0][i];
    diagonal[i].setConstant(inner[1][i] - from);
    spoke[i] = Lanes(inner[2][i], inner[3][i], inner[4][i], inner[5][i]) - from;
    next[i] = {spoke[i][1], spoke[i][2], spoke[i][3], spoke[i][0]};
  }
  return {product(edges[0], edges[1], edges[2]), product(spoke, next, diagonal)};
}

}  // namespace stylet::physics
