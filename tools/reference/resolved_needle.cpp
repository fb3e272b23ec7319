#include "tools/reference/resolved_needle.h"

#include <Eigen/CholmodSupport>
#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/SparseCore>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace stylet::reference {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr int kElementNodes = 27;
constexpr double kTouch = 1e-9;  // relative: what counts as on a face
using ElementMatrix = Eigen::Matrix<double, 3 * kElementNodes, 3 * kElementNodes>;
using ElementNodes = std::array<int, kElementNodes>;  // index i + 3 (j + 3 k)

struct RingMesh {
  std::vector<Vector3d> nodes;  // relative to the axis: x along it
  std::vector<ElementNodes> elements;
  std::vector<int> on_needle;  // nodes of the needle's wall, or of the punch
};

// Element boundaries and the midpoints between them.
std::vector<double> with_midpoints(const std::vector<double>& boundaries) {
  std::vector<double> all;
  for (std::size_t i = 0; i + 1 < boundaries.size(); ++i) {
    all.push_back(boundaries[i]);
    all.push_back(0.5 * (boundaries[i] + boundaries[i + 1]));
  }
  all.push_back(boundaries.back());
  return all;
}

bool has_end(NeedleMotion motion) {
  return motion == NeedleMotion::indentation || motion == NeedleMotion::tip;
}

double end_of_needle(const ResolvedCube& cube, NeedleMotion motion) {
  if (motion == NeedleMotion::indentation) return 0;
  return motion == NeedleMotion::tip ? 0.5 * cube.edge : cube.edge;
}

// Layers along the needle: geometric from its end, if it has one in the cube; else finer at the free faces.
std::vector<double> layers(const ResolvedCube& cube, NeedleMotion motion, int count) {
  std::vector<double> x;
  if (!has_end(motion)) {
    for (int i = 0; i <= count; ++i) x.push_back(0.5 * cube.edge * (1 - std::cos(std::numbers::pi * i / count)));
    return with_midpoints(x);
  }
  const double end = end_of_needle(cube, motion);
  const double length = cube.edge - end;
  const double first = 2 * cube.needle_radius / count;
  const double growth = std::pow(length / first, 1.0 / count);
  if (end > 0) {
    for (int i = count; i >= 0; --i) x.push_back(end - first * std::pow(growth, i));
  }
  x.push_back(end);
  for (int i = 0; i <= count; ++i) x.push_back(end + first * std::pow(growth, i));
  return with_midpoints(x);
}

// Radial stations: s <= 1 is the radius over the needle's, 1 + t the fraction t of the way to the wall on a
// logarithmic scale.
std::vector<double> stations(NeedleMotion motion, int rings) {
  std::vector<double> s;
  if (has_end(motion)) {  // the edge of a flat end is singular: finer on both sides
    const int core = std::max(2, rings / 3);
    for (int i = 0; i < core; ++i) s.push_back(std::sin(0.5 * std::numbers::pi * i / core));
  }
  for (int i = 0; i <= rings; ++i) {
    const double t = static_cast<double>(i) / rings;
    s.push_back(1 + (has_end(motion) ? std::pow(t, 1.5) : t));
  }
  return s;
}

double radius(double station, double needle_radius, double wall) {
  return station <= 1 ? station * needle_radius : needle_radius * std::pow(wall / needle_radius, station - 1);
}

RingMesh ring_mesh(const ResolvedCube& cube, NeedleMotion motion, const Resolution& resolution) {
  const std::vector<double> x = layers(cube, motion, resolution.layers);
  const std::vector<double> s = stations(motion, resolution.rings);
  const int rays = 2 * resolution.sectors;
  const int rings = 2 * static_cast<int>(s.size()) - 1;
  const int sheets = static_cast<int>(x.size());
  const double end = end_of_needle(cube, motion);
  RingMesh mesh;
  std::vector<int> index(static_cast<std::size_t>(rings) * static_cast<std::size_t>(rays * sheets));
  const auto at = [&](int ring, int ray, int sheet) -> int& {
    return index[ring + rings * (ray % rays + rays * sheet)];
  };
  for (int sheet = 0; sheet < sheets; ++sheet) {
    for (int ray = 0; ray < rays; ++ray) {
      const double angle = 2 * std::numbers::pi * ray / rays;
      const double c = std::cos(angle), sn = std::sin(angle);
      const double wall = 0.5 * cube.edge / std::max(std::abs(c), std::abs(sn));
      for (int ring = 0; ring < rings; ++ring) {
        const std::size_t low = static_cast<std::size_t>(ring / 2);
        double rho = radius(s[low], cube.needle_radius, wall);
        if (ring % 2 == 1) rho = 0.5 * (rho + radius(s[low + 1], cube.needle_radius, wall));
        if (rho == 0 && ray > 0) {  // the axis is one node a sheet
          at(ring, ray, sheet) = at(ring, 0, sheet);
          continue;
        }
        at(ring, ray, sheet) = static_cast<int>(mesh.nodes.size());
        if (rho < cube.needle_radius * (1 + kTouch) && x[sheet] < end + kTouch * cube.edge) {
          mesh.on_needle.push_back(at(ring, ray, sheet));
        }
        mesh.nodes.emplace_back(x[sheet], rho * c, rho * sn);
      }
    }
  }
  for (int sheet = 0; sheet + 2 < sheets; sheet += 2) {
    for (int ray = 0; ray < rays; ray += 2) {
      for (int ring = 0; ring + 2 < rings; ring += 2) {
        const bool within = s[ring / 2] < 1;
        if (within && x[sheet] < end * (1 - kTouch)) continue;  // steel
        ElementNodes element{};
        for (int k = 0; k < 3; ++k)
          for (int j = 0; j < 3; ++j)
            for (int i = 0; i < 3; ++i) element[i + 3 * (j + 3 * k)] = at(ring + i, ray + j, sheet + k);
        mesh.elements.push_back(element);
      }
    }
  }
  return mesh;
}

// Gradients of the 27 shape functions in the element's own coordinates at a quadrature point, and its weight.
struct Quadrature {
  Eigen::Matrix<double, 3, kElementNodes> gradients;
  double weight = 0;
};

std::vector<Quadrature> quadrature() {
  const double g = std::sqrt(0.6);
  const std::array<double, 3> points{-g, 0, g};
  const std::array<double, 3> weights{5.0 / 9, 8.0 / 9, 5.0 / 9};
  const auto shape = [](double t) { return Vector3d(0.5 * t * (t - 1), 1 - t * t, 0.5 * t * (t + 1)); };
  const auto slope = [](double t) { return Vector3d(t - 0.5, -2 * t, t + 0.5); };
  std::vector<Quadrature> all;
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t b = 0; b < 3; ++b)
      for (std::size_t a = 0; a < 3; ++a) {
        Quadrature q;
        q.weight = weights[a] * weights[b] * weights[c];
        const Vector3d na = shape(points[a]), nb = shape(points[b]), nc = shape(points[c]);
        const Vector3d da = slope(points[a]), db = slope(points[b]), dc = slope(points[c]);
        for (int k = 0; k < 3; ++k)
          for (int j = 0; j < 3; ++j)
            for (int i = 0; i < 3; ++i)
              q.gradients.col(i + 3 * (j + 3 * k)) << da[i] * nb[j] * nc[k], na[i] * db[j] * nc[k],
                  na[i] * nb[j] * dc[k];
        all.push_back(q);
      }
  return all;
}

ElementMatrix element_stiffness(const RingMesh& mesh, const ElementNodes& element, double lambda, double mu) {
  static const std::vector<Quadrature> kPoints = quadrature();
  Eigen::Matrix<double, 3, kElementNodes> x;
  for (int a = 0; a < kElementNodes; ++a) {
    x.col(a) = mesh.nodes[element[a]];
  }
  // With g_a the gradient of a node's shape function, k_ab is the integral of
  // lambda g_a g_b^T + mu g_b g_a^T + mu (g_a . g_b) I: all of it in the integral of g_a g_b^T.
  Eigen::Matrix<double, 3 * kElementNodes, 27> gradients;  // a column a point, with the root of its weight
  for (std::size_t p = 0; p < kPoints.size(); ++p) {
    const Quadrature& q = kPoints[p];
    const Matrix3d jacobian = x * q.gradients.transpose();
    const Eigen::Matrix<double, 3, kElementNodes> g = jacobian.transpose().inverse() * q.gradients;
    gradients.col(static_cast<Eigen::Index>(p)) =
        std::sqrt(q.weight * std::abs(jacobian.determinant())) * g.reshaped();
  }
  ElementMatrix k = gradients * gradients.transpose();
  for (int b = 0; b < kElementNodes; ++b) {
    for (int a = 0; a < kElementNodes; ++a) {
      const Matrix3d s = k.block<3, 3>(3 * a, 3 * b);
      k.block<3, 3>(3 * a, 3 * b) = lambda * s + mu * s.transpose() + mu * s.trace() * Matrix3d::Identity();
    }
  }
  return k;
}

// Which DOFs are prescribed, and to what: 1 along the motion.
struct Prescribed {
  std::vector<char> held;  // [3 nodes]
  Eigen::VectorXd value;   // [3 nodes]
};

Prescribed prescribe(const ResolvedCube& cube, const RingMesh& mesh, NeedleMotion motion) {
  const std::size_t dofs = 3 * mesh.nodes.size();
  Prescribed p{std::vector<char>(dofs, 0), Eigen::VectorXd::Zero(static_cast<Eigen::Index>(dofs))};
  const auto hold = [&](int node, int axis, double value) {
    p.held[3 * node + axis] = 1;
    p.value[3 * node + axis] = value;
  };
  const double end = end_of_needle(cube, motion);
  for (const int node : mesh.on_needle) {
    const Vector3d& x = mesh.nodes[node];
    const bool on_wall = std::hypot(x.y(), x.z()) > cube.needle_radius * (1 - kTouch);
    const bool on_end = x.x() > end - kTouch * cube.edge;
    if (motion != NeedleMotion::indentation && (on_wall || !on_end)) {
      hold(node, 1, motion == NeedleMotion::lateral ? 1 : 0);
      hold(node, 2, 0);
    }
    // Nodes inside the steel belong to no element: held so that the system is regular.
    if (motion == NeedleMotion::axial || (has_end(motion) && (on_end || !on_wall))) hold(node, 0, 1);
  }
  const double wall = 0.5 * cube.edge * (1 - kTouch);
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    const Vector3d& x = mesh.nodes[n];
    const bool on_wall = std::max(std::abs(x.y()), std::abs(x.z())) > wall;
    if (!(cube.support == Support::walls ? on_wall : x.z() < -wall)) continue;
    for (int axis = 0; axis < 3; ++axis) hold(static_cast<int>(n), axis, 0);
  }
  return p;
}

}  // namespace

double resolved_stiffness(const ResolvedCube& cube, NeedleMotion motion, const Resolution& resolution) {
  const RingMesh mesh = ring_mesh(cube, motion, resolution);
  const Prescribed prescribed = prescribe(cube, mesh, motion);
  std::vector<int> free(prescribed.held.size(), -1);
  int free_count = 0;
  for (std::size_t d = 0; d < free.size(); ++d) {
    if (!prescribed.held[d]) free[d] = free_count++;
  }
  const double e = cube.material.young_modulus, nu = cube.material.poisson_ratio;
  const double lambda = e * nu / ((1 + nu) * (1 - 2 * nu)), mu = e / (2 * (1 + nu));

  // With u = 1 on the needle, the force is the energy product u^T K u = u_p^T K_pp u_p + u_p^T K_pf u_f, and
  // K_ff u_f = -K_fp u_p.
  std::vector<Eigen::Triplet<double>> triplets;
  Eigen::VectorXd load = Eigen::VectorXd::Zero(free_count);
  double energy = 0;
  for (const ElementNodes& element : mesh.elements) {
    const ElementMatrix k = element_stiffness(mesh, element, lambda, mu);
    const auto dof = [&](int local) { return 3 * element[local / 3] + local % 3; };
    for (int j = 0; j < k.cols(); ++j) {
      const double value = prescribed.value[dof(j)];
      const int column = free[dof(j)];
      for (int i = 0; i < k.rows(); ++i) {
        const int row = free[dof(i)];
        if (row >= 0 && column >= row) triplets.emplace_back(column, row, k(j, i));
        if (row >= 0 && column < 0) load[row] -= k(i, j) * value;
        if (row < 0 && column < 0) energy += k(i, j) * value * prescribed.value[dof(i)];
      }
    }
  }
  Eigen::SparseMatrix<double> stiffness(free_count, free_count);
  stiffness.setFromTriplets(triplets.begin(), triplets.end());
  triplets = {};
  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>> factor(stiffness);
  if (factor.info() != Eigen::Success) throw std::runtime_error("resolved needle: stiffness cannot be factorised");
  return energy - load.dot(factor.solve(load));
}

}  // namespace stylet::reference
