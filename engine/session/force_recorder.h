// Follows the hand's force through a session.
#pragma once

#include "engine/figures/force_trace.h"
#include "engine/session/coupled_loops.h"

namespace stylet::session {

/// Adds every haptic step to a ForceTrace. Haptic thread.
class ForceRecorder final : public StepListener {
public:
  /// @param duration_s  memory for so much session time is taken at once; what comes later is dropped and counted
  ForceRecorder(const content::Scene& scene, double duration_s)
      : needle_(scene.needle), trace_(static_cast<std::size_t>(duration_s * scene.rates.haptic_hz) + 1000) {}

  void haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState& needle) override {
    const Eigen::Vector3d axis = needle.orientations.front() * Eigen::Vector3d::UnitZ();
    trace_.add(record.time_s, needle.positions.col(0), axis, insertion_depth(needle_, needle), needle.wrench.force,
               needle.hand_work);
  }

  const figures::ForceTrace& trace() const { return trace_; }

private:
  content::Needle needle_;
  figures::ForceTrace trace_;
};

}  // namespace stylet::session
