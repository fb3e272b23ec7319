#include "haptic/feel.h"

#include <algorithm>

namespace stylet::haptic {
namespace {

constexpr double kSoft = 200;  // N/m, of the spring at most

}  // namespace

FeelModel::FeelModel(Feel feel, const DeviceLimits& limits)
    : feel_(feel),
      stiffness_(feel == Feel::kSpring ? std::min(kSoft, limits.max_stiffness_n_per_m / 2)
                                       : limits.max_stiffness_n_per_m),
      damping_(limits.max_damping_n_s_per_m / 4),
      force_(feel == Feel::kFriction ? limits.max_force_n / 4 : limits.max_force_n / 2) {}

Eigen::Vector3d FeelModel::friction(const Eigen::Vector3d& position, double most) {
  const Eigen::Vector3d stretched = position - anchor_;
  const double longest = most / stiffness_;
  if (stretched.norm() > longest) anchor_ = position - stretched.normalized() * longest;
  return -stiffness_ * (position - anchor_);
}

Eigen::Vector3d FeelModel::step(const Eigen::Vector3d& position, double dt_s) {
  if (!begun_) last_ = anchor_ = position;
  begun_ = true;
  const double depth = -kDepth - position.y();
  const double sinking = dt_s > 0 ? (last_.y() - position.y()) / dt_s : 0;
  last_ = position;
  switch (feel_) {
    case Feel::kSpring:
      return -stiffness_ * position;
    case Feel::kWall:
      if (depth <= 0) return {0, 0, 0};
      return {0, stiffness_ * depth + damping_ * std::max(0.0, sinking), 0};
    case Feel::kFriction:
      return friction(position, force_);
    case Feel::kPuncture:
      if (depth <= 0) {
        open_ = false;
        return {0, 0, 0};
      }
      if (!open_ && stiffness_ * depth < force_) return {0, stiffness_ * depth, 0};
      if (!open_) {
        open_ = true;
        ++punctures_;
        anchor_ = {0, position.y(), 0};
      }
      return friction({0, position.y(), 0}, force_ / 5);
  }
  return {0, 0, 0};
}

}  // namespace stylet::haptic
