// The probe in someone's hand: at the keyboard, on the scene's own path and moved on the skin from there; or tracked
// elsewhere.
#pragma once

#include "engine/content/probe_placement.h"
#include "engine/content/scene.h"
#include "physics/messages/latest_value.h"

#include <array>
#include <atomic>
#include <variant>

namespace stylet::session {

/// Back to where it was at first.
struct ReleaseProbe {};
using ProbeCommand = std::variant<content::ProbeMove, ReleaseProbe>;

/// The window moves it in steps, a tracker says where it is; the simulation reads a smooth pose. They share atomics
/// and a latest-value slot, none waits for another. Where nobody moves it, it is where it was at first: exactly where
/// the scene has it, or so far from there as the start says.
class HeldProbe {
public:
  /// Keeps a reference to `scene`. @param start  of the probe from where the scene has it; there is skin
  explicit HeldProbe(const content::Scene& scene, const content::ProbeMove& start = {});

  /// Window thread, or that of a device which holds it: moves it further by so much, counted from its pose in the
  /// scene at `time_s`.
  /// @return false: there is no skin to move it to; it stays
  bool move(const content::ProbeMove& by, double time_s);
  /// Window thread. @return as move()
  bool apply(const ProbeCommand& command, double time_s);
  /// Window thread: back to where it was at first.
  void release();
  /// Window thread: from where the scene has it moved by so much.
  content::ProbeMove moved() const;

  /// Tracker's thread: it is there, and stays there until the next call, move() or release(). Pressed in deeper than
  /// kDeepest it is drawn back along its axis.
  /// @return false: that is inside the patient; it stays where it was
  bool follow(const physics::RigidPose& patient_from_probe);

  /// Any thread: from now on it keeps up with whoever moves it as with a tracked hand, because he feels it.
  void keep_up() { keeps_up_.store(true, std::memory_order_relaxed); }

  /// Simulation thread, times ascending: patient_from_probe, approaching the hand's over kTimeConstant.
  physics::RigidPose pose(double time_s);

  static constexpr double kTimeConstant = 0.12;      ///< s: a hand does not jump
  static constexpr double kTrackedConstant = 0.030;  ///< s: a tracked hand has moved already
  static constexpr double kDeepest = 0.030;          ///< of the face below the skin at rest, m

private:
  void store(const content::ProbeMove& goal);

  const content::Scene& scene_;
  content::ProbeMove start_;
  std::array<std::atomic<double>, 6> goal_{};
  physics::LatestValue<physics::RigidPose> tracked_;
  std::atomic<bool> is_tracked_{false};
  std::atomic<bool> keeps_up_{false};
  // Simulation thread's: probe in the scene from probe in the hand.
  Eigen::Vector3d offset_ = Eigen::Vector3d::Zero();
  Eigen::Quaterniond turn_ = Eigen::Quaterniond::Identity();
  double last_s_ = 0;
  bool at_rest_ = true;
};

}  // namespace stylet::session
