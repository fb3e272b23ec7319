#include "engine/session/felt_skin.h"

#include <algorithm>

namespace stylet::session {

void FeltSkin::simulation_stepped(const recording::SimulationStepRecord& record,
                                  const physics::SimulationReport& report, const physics::TissueState& /*tissue*/,
                                  const physics::NeedleState& /*needle*/) {
  const physics::ProbeContact& found = report.probe;
  skin_.back() = {.known = true,
                  .time_s = record.time_s,
                  .position = record.probe.position,
                  .near = found.near,
                  .gap = found.gap,
                  .force = -found.wrench.force.dot(record.probe.orientation * Eigen::Vector3d::UnitZ()),
                  .stiffness = found.stiffness};
  skin_.publish();
}

const Skin& FeltSkin::newest() {
  skin_.update();
  return skin_.front();
}

SkinCoupling::Press SkinCoupling::press(double hand_depth, double hand_speed, const Skin& skin,
                                        double skin_depth) const {
  double depth = hand_depth;
  if (skin.known) {
    const bool touches = skin.stiffness > 0 && skin.force > 0;
    const double k = touches ? kMargin * skin.stiffness : kRigid * stiffness_;
    // Up to here the skin, as it is now, carries nothing.
    double free = touches ? skin_depth - skin.force / k : skin_depth + skin.gap;
    if (!skin.near) free = std::max(free, -kAbove);
    if (hand_depth > free) depth = (stiffness_ * hand_depth + k * free) / (stiffness_ + k);
  }
  depth = std::min(depth, deepest_);
  const double spring = stiffness_ * (hand_depth - depth);
  return {.depth = depth, .force = spring > 0 ? std::max(0.0, spring + damping_ * hand_speed) : 0};
}

}  // namespace stylet::session
