#include "engine/link/link_stylus.h"

#include <algorithm>
#include <cmath>

namespace stylet::link {
namespace {

/// `from` on its way to `to`.
physics::RigidPose approached(const physics::RigidPose& from, const physics::RigidPose& to, double share,
                              double farthest, double farthest_turn) {
  const Eigen::Vector3d way = to.position - from.position;
  const double distance = share * way.norm();
  const double turn = share * from.orientation.angularDistance(to.orientation);
  physics::RigidPose pose;
  pose.position = from.position + way * (distance > farthest ? share * farthest / distance : share);
  pose.orientation =
      from.orientation.slerp(turn > farthest_turn ? share * farthest_turn / turn : share, to.orientation)
          .normalized();
  return pose;
}

}  // namespace

LinkStylus::LinkStylus(const physics::RigidPose& start) : goal_(start), first_stage_(start), second_stage_(start) {}

void LinkStylus::follow(const physics::RigidPose& hub) {
  goal_.back() = hub;
  goal_.publish();
}

haptic::StylusSample LinkStylus::read(double now_s) {
  if (goal_.update()) {
    heard_s_ = now_s;
    heard_ = true;
  }
  const double dt = std::clamp(now_s - last_read_s_, 0.0, kStale);
  last_read_s_ = now_s;
  const double age_s = now_s - heard_s_;
  const bool valid = heard_ && age_s <= kStale;
  if (valid) {
    const double share = 1 - std::exp(-dt / kSmoothing);
    second_stage_ = approached(second_stage_, first_stage_, share, kFastest * dt, kFastestTurn * dt);
    first_stage_ = approached(first_stage_, goal_.front(), share, kFastest * dt, kFastestTurn * dt);
  }
  return {.time_s = now_s,
          .position = second_stage_.position,
          .orientation = second_stage_.orientation,
          .valid = valid,
          .age_s = heard_ ? age_s : 0};
}

}  // namespace stylet::link
