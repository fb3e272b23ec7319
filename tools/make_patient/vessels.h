// Vessel trees: a few trunks placed by hand, the rest grown by rule.
#pragma once

#include "tools/make_patient/implicit.h"

#include <functional>
#include <vector>

namespace stylet::patient {

/// A piece of a vessel: a tapered capsule.
struct VesselSegment {
  Vector3 a;
  Vector3 b;
  double radius_a = 0;
  double radius_b = 0;
};

/// Positive where a vessel may be, in metres: how far the nearest forbidden thing is.
using Clearance = std::function<double(const Vector3& x, double radius)>;

/// A smooth curve through `knots`, radii interpolated, appended to the tree. The last tangent is returned.
Vector3 add_trunk(std::vector<VesselSegment>& tree, const std::vector<Vector3>& knots,
                  const std::vector<double>& radii);

struct GrowthRule {
  int orders = 4;              ///< bifurcations from the end of a trunk
  double larger_share = 0.83;  ///< radius of the larger daughter; the smaller by Murray: r0^3 = r1^3 + r2^3
  double larger_angle = 0.50;  ///< rad from the mother's direction
  double smaller_angle = 0.85;
  double length_per_radius = 8.5;  ///< of a branch
  double shortest = 9e-3;
  double longest = 28e-3;
  double margin = 2.2e-3;       ///< clearance wanted besides the radius
  double tip_radius = 0.35e-3;  ///< leaves taper to it: pointed ends
};

/// Grows the tree on from a trunk's end. Each bifurcation tries its plane in 12 positions and takes the one with the
/// most room; a branch without room is shortened, or ends. No randomness.
void grow(std::vector<VesselSegment>& tree, const Vector3& end, const Vector3& direction, double radius,
          const GrowthRule& rule, const Clearance& clearance);

/// Lateral branches at the inner knots of a trunk, thinner than it, each to the side with the most room.
void grow_sides(std::vector<VesselSegment>& tree, const std::vector<Vector3>& knots, const std::vector<double>& radii,
                const GrowthRule& rule, const Clearance& clearance);

/// Implicit surface of a tree: distance to the blended union of its segments, exact up to `reach` outside it and
/// constant beyond. Buckets keep evaluation cheap.
class VesselTree {
public:
  VesselTree(std::vector<VesselSegment> segments, double blend);
  double operator()(const Vector3& x) const;
  const Eigen::AlignedBox3d& bounds() const { return bounds_; }

private:
  std::vector<VesselSegment> segments_;
  double blend_;
  Eigen::AlignedBox3d bounds_;
  Eigen::Vector3i size_;
  std::vector<std::vector<int>> buckets_;
};

}  // namespace stylet::patient
