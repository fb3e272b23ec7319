// The high-rate loop: owns the needle, couples it to the tissue patch, gives the force to the hand (paper III, Fig.
// 1).
#pragma once

#include "physics/contact/bounded_solver.h"
#include "physics/contact/delassus.h"
#include "physics/loops/haptic_loop_settings.h"
#include "physics/loops/haptic_stage_clock.h"
#include "physics/loops/needle_coupling.h"
#include "physics/messages/messages.h"
#include "physics/needle/needle.h"

#include <Eigen/Core>

#include <cstdint>
#include <span>
#include <vector>

namespace stylet::physics {

/// The haptic loop. One instance a needle; used by one thread at a time.
class HapticLoop {
public:
  /// Straight, stress-free needle with its hub at `initial_hub_pose`. All memory is taken here.
  /// Throws std::invalid_argument (one line) if a setting is out of range.
  HapticLoop(const HapticLoopSettings& settings, const StylusPose& initial_hub_pose);

  /// One step: quasi-static needle and isolated tissue, coupled exactly at the linearisation of the step.
  /// A patch with epoch 0 or no body means "no tissue". The returned state is valid until the next call.
  /// Whatever the inputs, the state stays finite; what was refused or limited is in its flags (NeedleFlag). A patch
  /// that is not finite holds the state, flagged, until the next one comes.
  /// @param hub  pose asked for by the stylus
  /// @param dt   duration of the step, s
  /// @realtime   no allocation, lock or exception; O(beams rows^2 + rows^3)
  const NeedleState& step(const StylusPose& hub, double dt, const TissuePatch& patch);

  const NeedleState& state() const { return state_; }
  const HapticLoopSettings& settings() const { return settings_; }

  // For benches and experiments: the contact system of the last step, (W + c I) lambda = -delta_free.
  const Delassus& delassus() const { return delassus_; }
  auto delta_free() const { return system_.delta_free.head(delassus_.rows()); }  ///< [rows], m
  auto lambda() const { return system_.lambda.head(delassus_.rows()); }          ///< [rows], N
  Eigen::Matrix3Xd directions() const;                                           ///< [3 x rows], unit
  /// Laws of the rows, with the compliances C that they were solved with [rows]; `stylet` only.
  std::span<const ContactRow> laws() const {
    return {system_.rows.laws.data(), static_cast<std::size_t>(system_.rows.row_count)};
  }
  /// Has every further step timed by stage; null ends it. Costs some 20 ns a stage, and nothing when null.
  void time_stages(HapticStageClock* clock) { clock_ = clock; }

private:
  void mark(HapticStage stage) {
    if (clock_ != nullptr) clock_->mark(stage);
  }
  bool accept(const StylusPose& hub, double dt);
  bool synchronise(const TissuePatch& patch);
  bool free_motion(double dt);
  bool correct();
  void feel();
  const NeedleState& keep(std::uint32_t reason);
  void publish(double dt, const TissuePatch& patch);
  void publish_shape();
  void publish_forces(const TissuePatch& patch);
  void add_lacked(const NodeForce& force);

  HapticLoopSettings settings_;
  Needle needle_;
  NeedleShape shape_;      // end of the last step
  NeedleShape predicted_;  // moved rigidly with the hub: where this step is linearised
  StylusPose hub_;         // reached by the base at the end of the last step
  StylusPose next_hub_;
  Eigen::Vector3d hub_translation_ = Eigen::Vector3d::Zero();  // of this step
  Eigen::Vector3d hub_rotation_ = Eigen::Vector3d::Zero();
  std::uint32_t flags_ = 0;

  OwnedCoupling coupling_;
  ContactSystem system_;
  std::uint64_t loaded_epoch_ = 0;
  std::uint32_t patch_flags_ = 0;  // NeedleFlag bits of every step with it
  bool patch_finite_ = true;
  Delassus delassus_;
  Eigen::VectorXd load_;         // [6 nodes] H_n^T lambda
  Eigen::VectorXd free_motion_;  // [6 nodes]
  Eigen::VectorXd motion_;       // [6 nodes]

  Eigen::Matrix3Xd node_forces_;    // [3 x nodes of a patch] H_v^T lambda
  std::vector<char> node_touched_;  // [nodes of a patch]
  std::vector<NodeForce> lacked_;   // [lacked_count_] on nodes of a body that the patch lacks
  int lacked_count_ = 0;

  NeedleState state_;
  HapticStageClock* clock_ = nullptr;
};

}  // namespace stylet::physics
