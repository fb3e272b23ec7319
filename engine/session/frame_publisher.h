// From the loops to the pictures: a FrameState every simulation step.
#pragma once

#include "engine/content/scene.h"
#include "engine/session/coupled_loops.h"
#include "engine/state/state_buffer.h"

#include <Eigen/Core>

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

namespace stylet::session {

/// How the probe was held, over the simulation steps so far.
struct ProbeSummary {
  double mean_force = 0;  ///< along its axis, N
  double peak_force = 0;
  double mean_area = 0;  ///< of the skin that it touches, m^2
  double least_area = 0;
};

/// Publishes what a simulation step leaves: the deformed bodies, the needle it was computed with, the probe and how
/// it presses, the force, the targets, which move with the tissue. Simulation thread, where it says no other.
class FramePublisher final : public StepListener {
public:
  /// @param force_scale  of the needle's force that a stylus with force is given
  explicit FramePublisher(const content::Scene& scene, double force_scale = 1);

  void simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport& report,
                          const physics::TissueState& tissue, const physics::NeedleState& needle) override;

  /// Haptic thread.
  void force_sent(double time_s, std::uint64_t step, const haptic::GuardedWrench& out) override;

  const state::StateBuffer& buffer() const { return buffer_; }
  /// Least distance from the tip to a target's centre so far, m; infinity before the first step or without a
  /// target.
  double closest_target_distance() const { return closest_; }
  /// Zero before the first step.
  const ProbeSummary& probe() const { return probe_; }

private:
  /// What carries a target; body -1: it does not move.
  struct Carrier {
    int body = -1;
    std::array<int, 4> nodes{};
    Eigen::Vector4d weights = Eigen::Vector4d::Zero();
  };
  Carrier carrier_of(const Eigen::Vector3d& centre) const;
  void show_probe(const physics::RigidPose& pose, const physics::ProbeContact& contact);

  const content::Scene& scene_;
  state::FrameState frame_;
  state::StateBuffer buffer_;
  std::vector<Carrier> carriers_;  // [targets]
  double closest_;
  ProbeSummary probe_;
  double steps_ = 0;
  std::atomic<double> clipped_s_;  // session time when the stylus could last not give the force
};

/// The world at rest, with the needle straight from `hub`: sizes of all arrays, first picture.
state::FrameState rest_frame(const content::Scene& scene);

}  // namespace stylet::session
