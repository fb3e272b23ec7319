#include "physics/needle/plastic_bend.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::physics {
namespace {

using Eigen::Vector2d;

constexpr double kMomentRounding =
    1e-12;                       // of the moment: what a yielding end is beyond its strength by rounding alone
constexpr int kMostSweeps = 40;  // each gains a factor of four
constexpr double kTube = 0.16;   // fit to tubes of any wall

/// What the section carries: M(p), a half beam's path being p times its length.
double carried(const BendingStrength& strength, double path, double half) {
  const double scale = strength.curvature * half;
  const double x = 2 * path / (path + std::sqrt(path * (path + 4 * scale)) + 1e-300);
  return strength.first + (strength.full - strength.first) * x;
}

/// Path on which a moment of that size without yielding comes down to what the section carries, size - near (path -
/// before) = M(path): a quadratic in x.
double yielded_path(const BendingStrength& strength, double size, double near, double before, double half) {
  const double scale = strength.curvature * half;
  const double rise = strength.full - strength.first;
  const double over = size - strength.first + near * before;
  const double sum = rise + over;
  const double x = 2 * over / (sum + std::sqrt(sum * sum - 4 * over * (rise - near * scale)));
  return scale * x * x / (1 - x);
}

}  // namespace

BendingStrength tube_strength(double outer_diameter, double inner_diameter, double young_modulus,
                              double yield_strength) {
  if (!(yield_strength > 0)) return {};
  const double ro = 0.5 * outer_diameter;
  const double ri = 0.5 * inner_diameter;
  const double inertia = std::numbers::pi / 4 * (std::pow(ro, 4) - std::pow(ri, 4));
  const double first = yield_strength * inertia / ro;
  return {.first = first,
          .full = yield_strength * 4.0 / 3 * (std::pow(ro, 3) - std::pow(ri, 3)),
          .curvature = kTube * first / (young_modulus * inertia)};
}

void flow(const BendingStrength& strength, const std::array<Vector2d, 2>& rotations, double near, double far,
          double length, PlasticBend& bend) {
  bend.yields = {};
  if (!strength.limited()) return;
  const double half = 0.5 * length;
  const auto start = bend.turn;
  const auto path = bend.path;
  std::array<double, 2> flowed{};
  const auto moment = [&](std::size_t end, const Vector2d& own) {
    const std::size_t other = 1 - end;
    return Vector2d(near * (rotations[end] - own) + far * (rotations[other] - bend.turn[other]));
  };
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double change = 0;
    for (std::size_t end = 0; end < 2; ++end) {
      const Vector2d trial = moment(end, start[end]);
      const double size = trial.norm();
      double gamma = 0;
      if (size > (1 + kMomentRounding) * carried(strength, path[end], half)) {
        gamma = std::max(0.0, yielded_path(strength, size, near, path[end], half) - path[end]);
      }
      bend.yields[end] = gamma > 0;
      bend.turn[end] = gamma > 0 ? Vector2d(start[end] + gamma / size * trial) : start[end];
      change = std::max(change, std::abs(gamma - flowed[end]) * near);
      flowed[end] = gamma;
    }
    if (change <= kMomentRounding * strength.first) break;
  }
  for (std::size_t end = 0; end < 2; ++end) {
    if (!bend.yields[end]) continue;
    const Vector2d m = moment(end, bend.turn[end]);
    const double size = m.norm();
    bend.path[end] += flowed[end];
    bend.work += size * flowed[end];
    bend.direction[end] = m / size;
  }
}

Eigen::Matrix4d yielding_stiffness(const PlasticBend& bend, double near, double far) {
  Eigen::Matrix4d k = Eigen::Matrix4d::Zero();
  k.diagonal().setConstant(near);
  k.topRightCorner<2, 2>().diagonal().setConstant(far);
  k.bottomLeftCorner<2, 2>().diagonal().setConstant(far);
  // One direction after the other: the same as both at once.
  for (std::size_t end = 0; end < 2; ++end) {
    if (!bend.yields[end]) continue;
    Eigen::Vector4d n = Eigen::Vector4d::Zero();
    n.segment<2>(2 * static_cast<Eigen::Index>(end)) = bend.direction[end];
    const Eigen::Vector4d kn = k * n;
    k -= kn * kn.transpose() / (near + far + n.dot(kn));
  }
  return k;
}

}  // namespace stylet::physics
