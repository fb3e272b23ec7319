// The probe in the hand of someone at the keyboard: on the scene's own path, moved on the skin from there.
#pragma once

#include "engine/content/probe_placement.h"
#include "engine/content/scene.h"

#include <array>
#include <atomic>

namespace stylet::session {

/// The window moves it in steps; the simulation reads a smooth pose. They share six atomics, neither waits for the
/// other. Where nobody moves it, it is exactly where the scene has it.
class HeldProbe {
public:
  /// Keeps a reference to `scene`.
  explicit HeldProbe(const content::Scene& scene);

  /// Window thread: moves it further by so much, counted from its pose in the scene at `time_s`.
  /// @return false: there is no skin to move it to; it stays
  bool move(const content::ProbeMove& by, double time_s);
  /// Window thread: back to where the scene has it.
  void release();
  /// Window thread: moved from there by so much.
  content::ProbeMove moved() const;

  /// Simulation thread, times ascending: patient_from_probe, approaching the hand's over kTimeConstant.
  physics::RigidPose pose(double time_s);

  static constexpr double kTimeConstant = 0.12;  ///< s: a hand does not jump

private:
  const content::Scene& scene_;
  std::array<std::atomic<double>, 6> goal_{};
  // Simulation thread's: probe in the scene from probe in the hand.
  Eigen::Vector3d offset_ = Eigen::Vector3d::Zero();
  Eigen::Quaterniond turn_ = Eigen::Quaterniond::Identity();
  double last_s_ = 0;
  bool at_rest_ = true;
};

}  // namespace stylet::session
