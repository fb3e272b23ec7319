// The high-rate loop: owns the needle, couples it to the tissue patch, gives the force to the hand (paper III, Fig.
// 1).
#pragma once

#include "physics/contact/bounded_solver.h"
#include "physics/contact/constraint_solver.h"
#include "physics/contact/delassus.h"
#include "physics/contact/needle_track.h"
#include "physics/contact/tissue_map.h"
#include "physics/contact/tissue_points.h"
#include "physics/loops/haptic_stage_clock.h"
#include "physics/messages/messages.h"
#include "physics/needle/needle.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace stylet::physics {

/// How contacts follow the needle between two simulation steps. In the paper's couplings the simulation loop lays
/// them.
enum class Coupling {
  paper_frozen,   ///< locations on the needle and directions as the simulation step laid them (Peterlik 2011)
  paper_updated,  ///< tissue points projected anew on the shaft and directions updated every haptic step (the paper)
  stylet,  ///< smooth shaft; contacts laid, cut and broken through in the haptic loop, which owns the needle's track
};

struct HapticLoopSettings {
  NeedleProperties needle;
  NeedleBase base;
  Coupling coupling = Coupling::paper_updated;
  NeedleTrackSettings track{};                 ///< `stylet` only
  std::shared_ptr<const TissueMap> tissues{};  ///< what resists the needle, `stylet` only; null: nothing does
  /// Compliance of every row as a fraction of mean(diag W_v). Contacts that share a tetrahedron and an edge of the
  /// needle make rows of W nearly dependent (condition 1e19 at 5 mm spacing on a coarse mesh, and forces of hundreds
  /// of newtons from rounding); this bounds them at a cost of 0.1 % of softness. 0 is the paper's exact system.
  /// `stylet` has it only in rows without sub-grid compliance.
  double relative_compliance = 1e-3;
  BoundedSolveLimits solve_limits{};  ///< of the bounded solve, `stylet` only: what a step may cost at most
  double max_base_translation =
      1e-3;                          ///< m a step; more is spread over the next steps (one Newton step must suffice)
  double max_base_rotation = 20e-3;  ///< rad a step
  double max_node_rotation = 0.2;    ///< rad a step; a longer Newton step is shortened to this
};

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
  auto delta_free() const { return delta_free_.head(delassus_.rows()); }  ///< [rows], m
  auto lambda() const { return lambda_.head(delassus_.rows()); }          ///< [rows], N
  Eigen::Matrix3Xd directions() const;                                    ///< [3 x rows], unit
  /// Laws of the rows, with the compliances C that they were solved with [rows]; `stylet` only.
  std::span<const ContactRow> laws() const { return {rows_.laws.data(), static_cast<std::size_t>(rows_.row_count)}; }
  /// Of the last step; `stylet` only.
  const BoundedSolveReport& solve_report() const { return solve_report_; }
  /// Has every further step timed by stage; null ends it. Costs some 20 ns a stage, and nothing when null.
  void time_stages(HapticStageClock* clock) { clock_ = clock; }

private:
  void mark(HapticStage stage) {
    if (clock_ != nullptr) clock_->mark(stage);
  }
  bool accept(const StylusPose& hub, double dt);
  bool synchronise(const TissuePatch& patch);
  bool free_motion(double dt);
  void project_contacts();
  void direct_contacts();
  bool solve_contacts();
  bool solve_bilateral();
  bool solve_bounded();
  bool correct();
  void feel();
  const NeedleState& keep(std::uint32_t reason);
  void publish(double dt, const TissuePatch& patch);
  void publish_shape();
  void publish_contacts();
  bool owns_track() const { return settings_.coupling == Coupling::stylet; }
  void publish_forces(const TissuePatch& patch);

  HapticLoopSettings settings_;
  Needle needle_;
  NeedleShape shape_;      // end of the last step
  NeedleShape predicted_;  // moved rigidly with the hub: where this step is linearised
  StylusPose hub_;         // reached by the base at the end of the last step
  StylusPose next_hub_;
  Eigen::Vector3d hub_translation_ = Eigen::Vector3d::Zero();  // of this step
  Eigen::Vector3d hub_rotation_ = Eigen::Vector3d::Zero();
  std::uint32_t flags_ = 0;

  TissuePoints tissue_;
  std::uint64_t loaded_epoch_ = 0;
  bool patch_fits_ = true;
  bool patch_finite_ = true;
  NeedleTrack track_;
  TrackRows rows_;  // contacts of this step
  Delassus delassus_;
  ConstraintSolver solver_;
  BoundedSolver bounded_;
  BoundedSolveReport solve_report_;
  Eigen::VectorXd delta_free_;   // [rows]
  Eigen::VectorXd lambda_;       // [rows]
  Eigen::VectorXd load_;         // [6 nodes] H_n^T lambda
  Eigen::VectorXd free_motion_;  // [6 nodes]
  Eigen::VectorXd motion_;       // [6 nodes]

  Eigen::Matrix3Xd node_forces_;    // [3 x nodes of a patch] H_v^T lambda
  std::vector<char> node_touched_;  // [nodes of a patch]

  NeedleState state_;
  HapticStageClock* clock_ = nullptr;
};

}  // namespace stylet::physics
