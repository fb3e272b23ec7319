#include "physics/tissue/stiffness.h"

#include "physics/tissue/refinement.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stylet::physics {
namespace {

constexpr std::size_t kPairs = 10;           // of a tetrahedron's nodes
constexpr std::size_t kQuadraticPairs = 55;  // of a quadratic one's
constexpr std::size_t kTrianglePairs = 6;

std::span<const int> nodes_of(const TissueModel& model, std::size_t element) {
  if (model.is_quadratic()) return model.quadratics[element].nodes;
  return model.mesh.tets[element];
}

}  // namespace

StiffnessPattern::StiffnessPattern(const TissueModel& model) {
  // Free neighbours with a larger index, per free node: the blocks below the diagonal of its three columns.
  std::vector<std::vector<int>> below(static_cast<std::size_t>(model.free_node_count));
  const std::size_t elements = model.is_quadratic() ? model.quadratics.size() : model.mesh.tets.size();
  for (std::size_t e = 0; e < elements; ++e) {
    for (const int n : nodes_of(model, e)) {
      for (const int m : nodes_of(model, e)) {
        const int i = model.free_index[n];
        const int j = model.free_index[m];
        if (j >= 0 && i > j) below[j].push_back(i);
      }
    }
  }
  column_start_.push_back(0);
  for (std::size_t j = 0; j < below.size(); ++j) {
    auto& list = below[j];
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    for (int c = 0; c < 3; ++c) {
      for (int r = c; r < 3; ++r) rows_.push_back(static_cast<int>(3 * j) + r);
      for (const int i : list) {
        for (int r = 0; r < 3; ++r) rows_.push_back(3 * i + r);
      }
      column_start_.push_back(static_cast<int>(rows_.size()));
    }
  }

  const auto add_pairs = [&](std::span<const int> nodes, std::vector<BlockAddress>& scatter) {
    for (int row = 0; row < static_cast<int>(nodes.size()); ++row) {
      for (int column = 0; column <= row; ++column) {
        BlockAddress& address = scatter.emplace_back(BlockAddress{.row = row, .column = column});
        int i = model.free_index[nodes[static_cast<std::size_t>(row)]];
        int j = model.free_index[nodes[static_cast<std::size_t>(column)]];
        if (i < j) {
          std::swap(i, j);
          std::swap(address.row, address.column);
        }
        if (j < 0) continue;
        const auto& list = below[j];
        const auto rank = static_cast<int>(std::lower_bound(list.begin(), list.end(), i) - list.begin());
        for (int c = 0; c < 3; ++c) {
          const int start = column_start_[3 * j + c];
          // Diagonal block: its first entry is (c, c). Others come after the 3 - c entries of the diagonal block.
          address.start[c] = i == j ? start - c : start + (3 - c) + 3 * rank;
        }
      }
    }
  };
  scatter_.reserve(elements * (model.is_quadratic() ? kQuadraticPairs : kPairs));
  for (std::size_t e = 0; e < elements; ++e) add_pairs(nodes_of(model, e), scatter_);
  membrane_scatter_.reserve(model.membrane.size() * kTrianglePairs);
  for (const MembraneTriangle& triangle : model.membrane) add_pairs(triangle.nodes, membrane_scatter_);
}

void StiffnessPattern::assemble(const TissueModel& model, std::span<const Eigen::Quaterniond> rotations, double scale,
                                std::span<double> values, std::span<const SqueezedTet> squeezed,
                                std::span<const Eigen::Matrix3d> cofactors,
                                std::span<const PointStiffness> stiffening,
                                std::span<const MembraneGradient> membrane) const {
  std::fill(values.begin(), values.end(), 0.0);
  add_membrane(model, scale, membrane, values);
  if (model.is_quadratic()) {
    assemble_quadratic(model, rotations, scale, values, squeezed, cofactors, stiffening);
    return;
  }
  const auto blocks_of = [&](std::size_t tet) { return std::span(scatter_).subspan(kPairs * tet, kPairs); };
  for (std::size_t t = 0; t < model.tets.size(); ++t) {
    const TetRest& rest = model.tets[t];
    // K_ab = V (lambda g_a g_b^T + mu g_b g_a^T + mu (g_a . g_b) I) with rotated gradients g = R grad N: R K0 R^T
    // without ever forming K0.
    const Eigen::Matrix<double, 3, 4> g = rotations[t].toRotationMatrix() * rest.gradients;
    const double lambda = scale * rest.volume * rest.lambda;
    double mu = scale * rest.volume * rest.mu;
    if (!stiffening.empty() && model.materials[t].stiffening > 0) {
      // What stiffens does so along its strain, too: of rank one (eq. 47).
      const Eigen::Matrix<double, 3, 4> root = std::sqrt(2 * mu) * (stiffening[t].along * rest.gradients);
      for (const BlockAddress& address : blocks_of(t)) {
        if (address.start[0] < 0) continue;
        for (int c = 0; c < 3; ++c) {
          double* const column = values.data() + address.start[c];
          for (int r = address.row != address.column ? 0 : c; r < 3; ++r) {
            column[r] += root(r, address.row) * root(c, address.column);
          }
        }
      }
      mu *= stiffening[t].ratio;
    }
    for (const BlockAddress& address : blocks_of(t)) {
      if (address.start[0] < 0) continue;
      const Eigen::Vector3d a = g.col(address.row);
      const Eigen::Vector3d b = g.col(address.column);
      const double diagonal = mu * a.dot(b);
      const bool below_diagonal = address.row != address.column;
      for (int c = 0; c < 3; ++c) {
        double* const column = values.data() + address.start[c];
        for (int r = below_diagonal ? 0 : c; r < 3; ++r) column[r] += lambda * a[r] * b[c] + mu * b[r] * a[c];
        column[c] += diagonal;
      }
    }
  }
  for (const SqueezedTet& tet : squeezed) {
    // V psi'' (dJ/dp)(dJ/dp)^T: positive semidefinite, of rank one.
    const TetRest& rest = model.tets[tet.tet];
    const Eigen::Matrix<double, 3, 4> g = tet.cofactor * rest.gradients;
    for (const BlockAddress& address : blocks_of(static_cast<std::size_t>(tet.tet))) {
      if (address.start[0] < 0) continue;
      const Eigen::Vector3d a = scale * rest.volume * tet.curvature * g.col(address.row);
      for (int c = 0; c < 3; ++c) {
        double* const column = values.data() + address.start[c];
        for (int r = address.row != address.column ? 0 : c; r < 3; ++r) column[r] += a[r] * g(c, address.column);
      }
    }
  }
}

void StiffnessPattern::assemble_quadratic(const TissueModel& model, std::span<const Eigen::Quaterniond> rotations,
                                          double scale, std::span<double> values,
                                          std::span<const SqueezedTet> squeezed,
                                          std::span<const Eigen::Matrix3d> cofactors,
                                          std::span<const PointStiffness> stiffening) const {
  using Gradients = Eigen::Matrix<double, 3, 10>;
  auto next_squeezed = squeezed.begin();
  for (std::size_t e = 0; e < model.quadratics.size(); ++e) {
    const QuadraticRest& rest = model.quadratics[e];
    const std::array<std::array<Lanes, 3>, 10> gradients = gradients_of(rest);
    // K_ab = sum over points of V mu (g_b g_a^T + (g_a . g_b) I), g = R grad N, and of the volume lambda/V c_a c_b^T,
    // c = sum V cof F grad N   (eq. 44).
    std::array<Gradients, 4> turned;
    std::array<double, 4> mu{};
    Gradients volume = Gradients::Zero();
    // Of a squeezed point V psi'' (dJ/dp)(dJ/dp)^T, of one that stiffens what it does along its strain (eq. 47).
    std::array<Gradients, 4 + kSqueezable> roots;
    std::size_t root_count = 0;
    std::array<Gradients, 4> in_plane;
    std::array<Eigen::Matrix3d, 4> planes;
    std::array<double, 4> sheets{};
    for (std::size_t p = 0; p < 4; ++p) {
      const auto lane = static_cast<Eigen::Index>(p);
      Gradients g;
      for (std::size_t a = 0; a < 10; ++a) {
        for (std::size_t i = 0; i < 3; ++i) {
          g(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(a)) = gradients[a][i][lane];
        }
      }
      turned[p] = rotations[4 * e + p].toRotationMatrix() * g;
      mu[p] = scale * rest.volume[lane] * rest.mu[lane];
      if (rest.layered) {
        const Eigen::Vector3d normal =
            rotations[4 * e + p].toRotationMatrix() *
            Eigen::Vector3d(rest.normal[0][lane], rest.normal[1][lane], rest.normal[2][lane]);
        planes[p] = Eigen::Matrix3d::Identity() - normal * normal.transpose();
        in_plane[p] = planes[p] * turned[p];
        sheets[p] = mu[p] * rest.sheets[lane];
      }
      if (!rest.linear && !stiffening.empty()) {
        const PointStiffness& stiff = stiffening[4 * e + p];
        if (rest.stiffening[lane] > 0) roots[root_count++] = std::sqrt(2 * mu[p]) * (stiff.along * g);
        mu[p] *= stiff.ratio;
      }
      volume += rest.volume[lane] * (cofactors.empty() ? turned[p] : Gradients(cofactors[4 * e + p] * g));
      if (next_squeezed == squeezed.end() ||
          next_squeezed->tet != kSqueezable * static_cast<int>(e) + static_cast<int>(p))
        continue;
      roots[root_count++] =
          std::sqrt(scale * rest.volume[lane] * next_squeezed->curvature) * (next_squeezed->cofactor * g);
      ++next_squeezed;
    }
    for (; next_squeezed != squeezed.end(); ++next_squeezed) {
      const int which = next_squeezed->tet - kSqueezable * static_cast<int>(e);
      if (which >= kSqueezable) break;
      const int t = kTetsOfRefined * static_cast<int>(e) + which - 4;
      const TetRest& tet = model.tets[t];
      const Eigen::Matrix<double, 3, 4> g =
          std::sqrt(scale * tet.volume * next_squeezed->curvature) * (next_squeezed->cofactor * tet.gradients);
      Gradients& root = roots[root_count++];
      root.setZero();
      const std::array<std::size_t, 4> places = places_of(model, t);
      for (std::size_t k = 0; k < places.size(); ++k)
        root.col(static_cast<Eigen::Index>(places[k])) = g.col(static_cast<Eigen::Index>(k));
    }
    const double lambda = scale * rest.lambda / rest.volume.sum();
    for (const BlockAddress& address : std::span(scatter_).subspan(kQuadraticPairs * e, kQuadraticPairs)) {
      if (address.start[0] < 0) continue;
      Eigen::Matrix3d block = lambda * volume.col(address.row) * volume.col(address.column).transpose();
      for (std::size_t p = 0; p < 4; ++p) {
        const Eigen::Vector3d a = mu[p] * turned[p].col(address.row);
        const Eigen::Vector3d b = turned[p].col(address.column);
        block += b * a.transpose();
        block.diagonal().array() += a.dot(b);
      }
      for (std::size_t p = 0; p < 4 && rest.layered; ++p) {
        // Of the layers the same in their plane, and what plane stress adds: V mu s (g_b g_a^T + (g_a . g_b) P +
        // 2 c g_a g_b^T), g = P R grad N   (eq. 52).
        const Eigen::Vector3d a = sheets[p] * in_plane[p].col(address.row);
        const Eigen::Vector3d b = in_plane[p].col(address.column);
        block += b * a.transpose() + 2 * rest.spread * a * b.transpose() + a.dot(b) * planes[p];
      }
      for (std::size_t k = 0; k < root_count; ++k) {
        block += roots[k].col(address.row) * roots[k].col(address.column).transpose();
      }
      const bool below_diagonal = address.row != address.column;
      for (int c = 0; c < 3; ++c) {
        double* const column = values.data() + address.start[c];
        for (int r = below_diagonal ? 0 : c; r < 3; ++r) column[r] += block(r, c);
      }
    }
  }
}

void StiffnessPattern::add_membrane(const TissueModel& model, double scale,
                                    std::span<const MembraneGradient> membrane, std::span<double> values) const {
  for (std::size_t t = 0; t < model.membrane.size(); ++t) {
    const MembraneTriangle& triangle = model.membrane[t];
    const MembraneStiffness stiffness(triangle, membrane.empty() ? triangle.frame : membrane[t]);
    for (const BlockAddress& address : std::span(membrane_scatter_).subspan(kTrianglePairs * t, kTrianglePairs)) {
      if (address.start[0] < 0) continue;
      const Eigen::Matrix3d block = scale * stiffness.block(address.row, address.column);
      for (int c = 0; c < 3; ++c) {
        double* const column = values.data() + address.start[c];
        for (int r = address.row != address.column ? 0 : c; r < 3; ++r) column[r] += block(r, c);
      }
    }
  }
}

}  // namespace stylet::physics
