// Follows the hand's force and work through a session.
#pragma once

#include "engine/figures/force_trace.h"
#include "engine/session/coupled_loops.h"
#include "physics/loops/passivity_observer.h"

namespace stylet::session {

/// Adds every haptic step to a ForceTrace and shows it to a passivity observer. Haptic thread.
class ForceRecorder final : public StepListener {
public:
  /// @param duration_s  memory for so much session time is taken at once; what comes later is dropped and counted
  ForceRecorder(const content::Scene& scene, double duration_s)
      : needle_(scene.needle),
        trace_(static_cast<std::size_t>(duration_s * scene.rates.haptic_hz) + 1000),
        passivity_({.step_s = 1 / scene.rates.haptic_hz}) {}

  void haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState& needle) override {
    const Eigen::Vector3d axis = needle.orientations.front() * Eigen::Vector3d::UnitZ();
    trace_.add(record.time_s, needle.positions.col(0), axis, insertion_depth(needle_, needle), needle.wrench.force,
               needle.hand_work);
    passivity_.add(record.time_s, record.pose, needle);
  }

  const figures::ForceTrace& trace() const { return trace_; }
  const physics::PassivitySummary& passivity() const { return passivity_.summary(); }

private:
  content::Needle needle_;
  figures::ForceTrace trace_;
  physics::PassivityObserver passivity_;
};

}  // namespace stylet::session
