// One step of the hand: its pose into the haptic loop, the guarded force out to it.
#pragma once

#include "engine/session/coupled_loops.h"
#include "haptic/click.h"
#include "haptic/device.h"
#include "haptic/output_guard.h"

#include <Eigen/Core>

#include <atomic>
#include <cstdint>

namespace stylet::session {

/// Reads the device, steps the loop, scales the force, limits it by the device's data sheet and writes it. What the
/// schedule is like, threads or lockstep, is its caller's.
class StylusStep {
public:
  static constexpr double kPauseFade = 0.05;  ///< s; as soft as the rate limit of a stylus, shorter than a start

  /// @param loops, device  outlive this
  /// @param force_scale    of the needle's force that goes to the hand; the loops know nothing of it
  StylusStep(CoupledLoops& loops, haptic::Device& device, double force_scale = 1);

  /// @param time_s     session time
  /// @param elapsed_s  since the last call, by the clock
  /// @realtime
  const physics::NeedleState& step(double time_s, double elapsed_s, const physics::TissuePatch& patch);
  /// In place of step() while the session is paused: no loop steps, and the force fades to zero within kPauseFade.
  /// The next step() is that of a stylus that was plugged in again: the force engages anew.
  /// @param elapsed_s  since the last call of either, by the clock
  /// @realtime
  void hold(double time_s, double elapsed_s);
  /// The hand is to feel a click, which the next step() begins; a device that renders no force gives none, and while
  /// the session is paused it is left out. Any thread.
  void click() { clicks_.fetch_add(1, std::memory_order_release); }
  /// Zero force. The next step starts from there.
  void release() { device_.write(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()); }

  const haptic::GuardCounters& counters() const { return guard_.counters(); }

private:
  Eigen::Vector3d click_force(const haptic::StylusSample& sample, double needle_force, double elapsed_s);

  CoupledLoops& loops_;
  haptic::Device& device_;
  double most_force_;  // of the device, N
  bool renders_force_;
  double force_scale_;
  haptic::OutputGuard guard_;
  haptic::Click click_;
  std::atomic<std::uint32_t> clicks_{0};  // asked for
  std::uint32_t begun_ = 0;               // of them
  double refused_s_ = 0;                  // since when the physics has taken no pose
  double held_s_ = 0;                     // since when the session is paused
};

}  // namespace stylet::session
