#include "physics/tissue/inversion.h"

#include "physics/tissue/corotational.h"
#include "physics/tissue/lanes.h"
#include "physics/tissue/quadratic.h"

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>

namespace stylet::physics {
namespace {

constexpr double kStiffness = 1;  // kappa over (lambda + 2 mu) J0^2; engineering value
constexpr double kKept = 0.3;     // share of its volume that a tetrahedron keeps in one step
constexpr double kRounding = 1e-9;
constexpr int kBisections = 20;  // of the fraction

/// Volume along a straight way, c[0] + c[1] t + c[2] t^2 + c[3] t^3.
using Cubic = std::array<double, 4>;

double value(const Cubic& c, double t) {
  return c[0] + t * (c[1] + t * (c[2] + t * c[3]));
}

/// The largest t <= `limit` up to which the cubic, positive at 0, has no root.
double up_to_first_root(const Cubic& c, double limit) {
  const double lost = std::min(c[1], 0.0) + limit * (std::min(c[2], 0.0) + limit * std::min(c[3], 0.0));
  if (c[0] + limit * lost > 0) return limit;
  // Between its extremes the cubic is monotone.
  std::array<double, 3> ends{limit, limit, limit};
  const double discriminant = c[2] * c[2] - 3 * c[1] * c[3];
  if (discriminant >= 0) {
    const double q = -(c[2] + std::copysign(std::sqrt(discriminant), c[2]));
    if (c[3] != 0) ends[0] = q / (3 * c[3]);
    if (q != 0) ends[1] = c[1] / q;
    std::sort(ends.begin(), ends.begin() + 2);
  }
  double low = 0;
  for (const double end : ends) {
    if (!(end > low) || end > limit) continue;
    if (value(c, end) > 0) {
      low = end;
      continue;
    }
    double high = end;
    for (int i = 0; i < kBisections; ++i) {
      const double middle = 0.5 * (low + high);
      (value(c, middle) > 0 ? low : high) = middle;
    }
    return low;
  }
  return limit;
}

/// Edges of up to four tetrahedra from `first` on; of those beyond `end` the first one's.
LaneMatrix edges(const TissueModel& model, const Eigen::Matrix3Xd& positions, int first, int end) {
  LaneMatrix result;
  for (int lane = 0; lane < kLanes; ++lane) {
    const auto& n = model.mesh.tets[first + lane < end ? first + lane : first];
    for (std::size_t a = 0; a < 3; ++a) {
      const Eigen::Vector3d edge = positions.col(n[a + 1]) - positions.col(n[0]);
      for (std::size_t i = 0; i < 3; ++i) result[i][a][lane] = edge[static_cast<Eigen::Index>(i)];
    }
  }
  return result;
}

/// a : b
Lanes product(const LaneMatrix& a, const LaneMatrix& b) {
  Lanes sum = Lanes::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) sum += a[i][j] * b[i][j];
  }
  return sum;
}

}  // namespace

Eigen::Matrix3d cofactor(const Eigen::Matrix3d& f) {
  Eigen::Matrix3d result;
  result << f.col(1).cross(f.col(2)), f.col(2).cross(f.col(0)), f.col(0).cross(f.col(1));
  return result;
}

Barrier barrier(const TetRest& rest, double j) {
  if (!(j < kSqueezed) || !(j > 0)) return {};
  // psi = -kappa (x - 1)^2 ln x, x = J / J0   (eq. 40)
  const double kappa = kStiffness * kSqueezed * kSqueezed * (rest.lambda + 2 * rest.mu);
  const double x = j / kSqueezed;
  const double log = std::log(x);
  const double y = x - 1;
  return {.energy = -kappa * y * y * log,
          .slope = -kappa / kSqueezed * (2 * y * log + y * y / x),
          .curvature = -kappa / (kSqueezed * kSqueezed) * (2 * log + 4 * y / x - y * y / (x * x))};
}

void find_squeezed(const TissueModel& model, const Eigen::Matrix3Xd& positions, std::span<const double> rest_size,
                   std::vector<SqueezedTet>& found) {
  found.clear();
  if (model.is_quadratic()) {
    find_squeezed_quadratics(model, positions, rest_size, found);
    return;
  }
  for (int t = 0; t < model.tet_count(); ++t) {
    if (!rest_size.empty() && rest_size[t] != 1) continue;
    const Eigen::Matrix3d f = deformation_gradient(model, positions, t);
    const double curvature = barrier(model.tets[t], f.determinant()).curvature;
    if (curvature > 0) found.push_back({.tet = t, .curvature = curvature, .cofactor = cofactor(f)});
  }
}

double uninverted_fraction(const Eigen::Matrix3d& before, const Eigen::Matrix3d& change, double limit) {
  const double j = before.determinant();
  if (!(j > 0)) return limit;
  return up_to_first_root({(1 - kKept) * j, cofactor(before).cwiseProduct(change).sum(),
                           cofactor(change).cwiseProduct(before).sum(), change.determinant()},
                          limit);
}

double uninverted_fraction(const LaneMatrix& before, const LaneMatrix& change, double limit) {
  // Most cannot lose as much on any way as long: as in up_to_first_root().
  const Lanes lost = product(cofactors_of(before), change).min(0) +
                     limit * (product(cofactors_of(change), before).min(0) + limit * determinant(change).min(0));
  const Lanes left = (1 - kKept - kRounding) * determinant(before) + limit * lost;
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!(left[lane] > 0)) limit = uninverted_fraction(of_lane(before, lane), of_lane(change, lane), limit);
  }
  return limit;
}

double uninverted_fraction(const TissueModel& model, const Eigen::Matrix3Xd& before, const Eigen::Matrix3Xd& after,
                           Companion* companion) {
  std::vector<double> of_runs(model.runs.size(), 1);
  in_parts(companion, static_cast<int>(model.runs.size()), [&](int r) {
    const TetRun& run = model.runs[r];
    double& fraction = of_runs[r];
    if (model.is_quadratic()) fraction = uninverted_fraction_of_points(model, before, after, run);
    for (int t = run.begin; t < run.end; t += kLanes) {
      const LaneMatrix a = edges(model, before, t, run.end);
      fraction = uninverted_fraction(a, difference(edges(model, after, t, run.end), a), fraction);
    }
  });
  return *std::min_element(of_runs.begin(), of_runs.end());
}

}  // namespace stylet::physics
