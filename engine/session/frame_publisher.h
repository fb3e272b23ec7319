// From the loops to the pictures: a FrameState every simulation step.
#pragma once

#include "engine/content/scene.h"
#include "engine/session/coupled_loops.h"
#include "engine/state/state_buffer.h"

#include <Eigen/Core>

#include <array>

namespace stylet::session {

/// Publishes what a simulation step leaves: the deformed bodies, the needle it was computed with, the probe, the
/// force, the distance from the tip to the first target, which moves with the tissue. Simulation thread.
class FramePublisher final : public StepListener {
public:
  explicit FramePublisher(const content::Scene& scene);

  void simulation_stepped(const SimulationStepRecord& record, const physics::SimulationReport&,
                          const physics::TissueState& tissue, const physics::NeedleState& needle) override;

  const state::StateBuffer& buffer() const { return buffer_; }
  /// Least distance from the tip to the target's centre so far, m; infinity before the first step or without a
  /// target.
  double closest_target_distance() const { return closest_; }
  /// The moment of it; the latest state where there is no target.
  const state::FrameState& closest_frame() const { return closest_frame_; }

private:
  const content::Scene& scene_;
  state::FrameState frame_;
  state::StateBuffer buffer_;
  int target_body_ = -1;  // -1: the target does not move
  std::array<int, 4> target_nodes_{};
  Eigen::Vector4d target_weights_ = Eigen::Vector4d::Zero();
  double closest_;
  state::FrameState closest_frame_;
};

/// The world at rest, with the needle straight from `hub`: sizes of all arrays, first picture.
state::FrameState rest_frame(const content::Scene& scene);

}  // namespace stylet::session
