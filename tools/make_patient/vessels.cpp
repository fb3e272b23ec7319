#include "tools/make_patient/vessels.h"

#include <cmath>
#include <limits>
#include <numbers>

namespace stylet::patient {
namespace {

constexpr double kBucket = 6.0_mm;
constexpr double kReach = 3.0_mm;

double distance(const VesselSegment& s, const Vector3& x) {
  return round_cone(x, s.a, s.b, s.radius_a, s.radius_b);
}

// Quadratic Bezier from `start`, leaving along `direction`, to `end`.
void add_branch(std::vector<VesselSegment>& tree, const Vector3& start, const Vector3& direction, const Vector3& end,
                double radius_start, double radius_end) {
  constexpr int kPieces = 4;
  const Vector3 control = start + direction * (0.45 * (end - start).norm());
  const auto at = [&](double t) {
    return Vector3((1 - t) * (1 - t) * start + 2 * t * (1 - t) * control + t * t * end);
  };
  for (int i = 0; i < kPieces; ++i) {
    const double t0 = static_cast<double>(i) / kPieces;
    const double t1 = static_cast<double>(i + 1) / kPieces;
    tree.push_back({at(t0), at(t1), radius_start + t0 * (radius_end - radius_start),
                    radius_start + t1 * (radius_end - radius_start)});
  }
}

// Room along a branch: outside of the forbidden, and away from the tree except near the branch's own root.
double room(const std::vector<VesselSegment>& tree, const Vector3& start, const Vector3& end, double radius,
            const Clearance& clearance) {
  double least = std::numeric_limits<double>::infinity();
  for (const double t : {0.35, 0.6, 0.8, 1.0, 1.15}) {
    const Vector3 x = start + t * (end - start);
    least = std::min(least, clearance(x, radius));
    const double own = t * (end - start).norm() * 0.6;
    for (const VesselSegment& s : tree)
      least = std::min(least, std::max(distance(s, x) - radius, 0.0) / own * 8.0_mm);
  }
  return least;
}

void grow_order(std::vector<VesselSegment>& tree, const Vector3& end, const Vector3& direction, double radius,
                int order, const GrowthRule& rule, const Clearance& clearance) {
  const double larger = radius * rule.larger_share;
  const double smaller = std::cbrt(radius * radius * radius - larger * larger * larger);
  struct Daughter {
    double radius;
    double angle;
  };
  const Vector3 across = direction.unitOrthogonal();
  const Vector3 third = direction.cross(across);
  const auto tip = [&](const Daughter& d, double azimuth, double length) {
    const Vector3 radial = std::cos(azimuth) * across + std::sin(azimuth) * third;
    return Vector3(end + length * (std::cos(d.angle) * direction + std::sin(d.angle) * radial));
  };
  const Daughter first{larger, rule.larger_angle};
  const Daughter second{smaller, -rule.smaller_angle};
  const auto length_of = [&](const Daughter& d) {
    return std::clamp(rule.length_per_radius * d.radius, rule.shortest, rule.longest);
  };
  double best_room = -std::numeric_limits<double>::infinity();
  double azimuth = 0;
  for (int i = 0; i < 12; ++i) {
    const double candidate = 2 * std::numbers::pi * i / 12;
    const double score =
        std::min(room(tree, end, tip(first, candidate, length_of(first)), larger, clearance),
                 1.2 * room(tree, end, tip(second, candidate, length_of(second)), smaller, clearance));
    if (score > best_room + 1e-9) {
      best_room = score;
      azimuth = candidate;
    }
  }
  struct Grown {
    Vector3 end;
    Vector3 direction;
    double radius;
    bool alive;
  };
  std::array<Grown, 2> grown{};
  const std::array<Daughter, 2> daughters{first, second};
  const bool leaves = order + 1 >= rule.orders;
  const std::size_t before = tree.size();
  for (int d = 0; d < 2; ++d) {
    double length = length_of(daughters[d]) * (leaves ? 1.15 : 1.0);
    Vector3 target = tip(daughters[d], azimuth, length);
    bool fits = false;
    for (int shorter = 0; shorter < 4 && !fits; ++shorter) {
      fits = clearance(target, daughters[d].radius) > rule.margin &&
             clearance((end + target) / 2, daughters[d].radius) > rule.margin / 2;
      if (!fits) {
        length *= 0.75;
        target = tip(daughters[d], azimuth, length);
      }
    }
    grown[d] = {target, (target - end).normalized(), daughters[d].radius, fits && length > 0.5 * rule.shortest};
    if (!grown[d].alive) continue;
    const bool last = leaves || fits == false;
    // The first piece leaves along the mother, so the fork is a curve and not a corner.
    add_branch(tree, end, direction, target, std::min(daughters[d].radius * 1.08, radius),
               last ? rule.tip_radius : daughters[d].radius * 0.94);
  }
  if (leaves) return;
  if (tree.size() == before) {  // no room at all: a pointed end
    add_branch(tree, end, direction, end + direction * rule.shortest * 0.6, radius, rule.tip_radius);
    return;
  }
  for (const Grown& g : grown) {
    if (g.alive) grow_order(tree, g.end, g.direction, g.radius * 0.94, order + 1, rule, clearance);
  }
}

}  // namespace

Vector3 add_trunk(std::vector<VesselSegment>& tree, const std::vector<Vector3>& knots,
                  const std::vector<double>& radii) {
  constexpr int kPieces = 6;
  const int last = static_cast<int>(knots.size()) - 1;
  const auto at = [&](int i) { return knots[std::clamp(i, 0, last)]; };
  Vector3 tangent = Vector3::UnitY();
  for (int k = 0; k < last; ++k) {  // Catmull-Rom
    const Vector3 m0 = (at(k + 1) - at(k - 1)) / 2;
    const Vector3 m1 = (at(k + 2) - at(k)) / 2;
    Vector3 previous = knots[k];
    for (int i = 1; i <= kPieces; ++i) {
      const double t = static_cast<double>(i) / kPieces;
      const double t2 = t * t;
      const double t3 = t2 * t;
      const Vector3 x = (2 * t3 - 3 * t2 + 1) * knots[k] + (t3 - 2 * t2 + t) * m0 + (3 * t2 - 2 * t3) * knots[k + 1] +
                        (t3 - t2) * m1;
      const double from = radii[k] + (t - 1.0 / kPieces) * (radii[k + 1] - radii[k]);
      const double to = radii[k] + t * (radii[k + 1] - radii[k]);
      tree.push_back({previous, x, from, to});
      tangent = (x - previous).normalized();
      previous = x;
    }
  }
  return tangent;
}

void grow(std::vector<VesselSegment>& tree, const Vector3& end, const Vector3& direction, double radius,
          const GrowthRule& rule, const Clearance& clearance) {
  grow_order(tree, end, direction.normalized(), radius, 0, rule, clearance);
}

void grow_sides(std::vector<VesselSegment>& tree, const std::vector<Vector3>& knots, const std::vector<double>& radii,
                const GrowthRule& rule, const Clearance& clearance) {
  for (std::size_t k = 1; k + 1 < knots.size(); ++k) {
    const double radius = 0.55 * radii[k];
    const Vector3 along = (knots[k + 1] - knots[k - 1]).normalized();
    const Vector3 across = along.unitOrthogonal();
    const Vector3 third = along.cross(across);
    const double length = std::clamp(rule.length_per_radius * radius, rule.shortest, rule.longest);
    double best_room = rule.margin;
    Vector3 best = Vector3::Zero();
    for (int i = 0; i < 12; ++i) {
      const double azimuth = 2 * std::numbers::pi * i / 12;
      const Vector3 direction =
          std::cos(1.1) * along + std::sin(1.1) * (std::cos(azimuth) * across + std::sin(azimuth) * third);
      const double free = room(tree, knots[k], knots[k] + length * direction, radius, clearance);
      if (free > best_room + 1e-9) {
        best_room = free;
        best = direction;
      }
    }
    if (best.isZero()) continue;
    const Vector3 end = knots[k] + length * best;
    add_branch(tree, knots[k], (along + best).normalized(), end, radius, 0.95 * radius);
    GrowthRule fewer = rule;
    fewer.orders = rule.orders - 1;
    grow(tree, end, best, 0.95 * radius, fewer, clearance);
  }
}

VesselTree::VesselTree(std::vector<VesselSegment> segments, double blend)
    : segments_(std::move(segments)), blend_(blend) {
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const VesselSegment& s : segments_) {
    const double radius = std::max(s.radius_a, s.radius_b) + kReach;
    Eigen::AlignedBox3d box(s.a.cwiseMin(s.b), s.a.cwiseMax(s.b));
    box.extend(Vector3(box.min() - Vector3::Constant(radius)));
    box.extend(Vector3(box.max() + Vector3::Constant(radius)));
    boxes.push_back(box);
    bounds_.extend(box);
  }
  size_ = (bounds_.sizes() / kBucket).array().ceil().cast<int>().max(1);
  buckets_.resize(size_.prod());
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    const Eigen::Vector3i low = ((boxes[s].min() - bounds_.min()) / kBucket).cast<int>();
    const Eigen::Vector3i high = ((boxes[s].max() - bounds_.min()) / kBucket)
                                     .cast<int>()
                                     .cwiseMin(Eigen::Vector3i(size_ - Eigen::Vector3i::Ones()));
    for (int k = low.z(); k <= high.z(); ++k) {
      for (int j = low.y(); j <= high.y(); ++j) {
        for (int i = low.x(); i <= high.x(); ++i) {
          buckets_[i + size_.x() * (j + size_.y() * k)].push_back(static_cast<int>(s));
        }
      }
    }
  }
}

double VesselTree::operator()(const Vector3& x) const {
  double nearest = kReach;
  if (!bounds_.contains(x)) return nearest;
  const Eigen::Vector3i cell =
      ((x - bounds_.min()) / kBucket).cast<int>().cwiseMin(Eigen::Vector3i(size_ - Eigen::Vector3i::Ones()));
  for (const int s : buckets_[cell.x() + size_.x() * (cell.y() + size_.y() * cell.z())]) {
    nearest = smooth_min(nearest, distance(segments_[s], x), blend_);
  }
  return nearest;
}

}  // namespace stylet::patient
