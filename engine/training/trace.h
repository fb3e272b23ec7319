// A procedure as the metrics see it: one sample of hand, needle, tissue and probe for every simulation step.
#pragma once

#include "engine/content/tissue_locator.h"
#include "engine/recording/recording.h"
#include "engine/session/coupled_loops.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace stylet::training {

/// Patient frame, SI. All of one simulation step: the needle that it consumed, the tissue that it left.
struct TraceSample {
  double time_s = 0;
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();
  Eigen::Quaterniond tip_orientation =
      Eigen::Quaterniond::Identity();  ///< +Z along the needle, +X the bevel's normal
  Eigen::Vector3d hub = Eigen::Vector3d::Zero();
  Eigen::Quaterniond hub_orientation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d entry =
      Eigen::Vector3d::Zero();     ///< the hole in the skin, as the tissue carries it; not inserted: tip
  double inserted = 0;             ///< arc length of needle behind the skin, m
  double bend = 0;                 ///< largest distance of the shaft from the straight line between hub and tip, m
  physics::NeedleDamage damage{};  ///< since the start
  physics::TipState tip_state = physics::TipState::outside;
  int tip_body = -1;            ///< deformable body that the tip is in
  bool near_tissue = false;     ///< a body is kProbeAhead ahead of the tip
  int tissue = 0;               ///< at the tip: index into Scene::tissues
  std::uint32_t forbidden = 0;  ///< bit i: the tip is in Scene::forbidden[i]
  std::uint32_t crossed = 0;    ///< the same of all that the tip went through since the sample before
  Eigen::Vector3d force = Eigen::Vector3d::Zero();            ///< on the hand, N
  int target = -1;                                            ///< the nearest one; -1: the scene has none
  Eigen::Vector3d target_position = Eigen::Vector3d::Zero();  ///< its centre, as the tissue carries it
  double target_distance = 0;                                 ///< from the tip to there, m
  physics::RigidPose probe{};
  double probe_force = 0;  ///< that presses it on the skin, along its axis, N
  double probe_area = 0;   ///< of the skin that it touches, m^2; 0 where no body is pressed (Probe::presses)
  Eigen::Vector3d tip_in_probe = Eigen::Vector3d::Zero();  ///< probe frame: |y| is the distance from the image plane
  double in_beam = 0;  ///< arc length of inserted needle that the beam sees (beam.h), m
  std::uint32_t buttons = 0;
  double inspiration = 0;  ///< of the patient, share of a full one
};

/// A point this far ahead of the tip tells whether it is clear of the tissue, m.
inline constexpr double kProbeAhead = 1e-3;

struct Trace {
  std::vector<TraceSample> samples{};            ///< times ascending
  std::vector<recording::EventRecord> events{};  ///< of the session, times ascending
  std::size_t dropped = 0;                       ///< samples beyond the memory taken at load
};

/// Fills a Trace, live and in replay alike: the samples are a function of the steps and what they consumed, so a
/// recording's are those of its session, bit for bit. Simulation thread; of haptic steps it takes the buttons alone.
/// Memory for the whole duration, at most kLongest and kMostSamples (40 MB), is taken at construction; later samples
/// are dropped and counted.
class TraceRecorder final : public session::StepListener {
public:
  static constexpr double kLongest = 1800;  ///< s
  static constexpr std::size_t kMostSamples = 100'000;

  /// Keeps a reference to `scene`. @param duration_s  of the session; infinite: kLongest
  TraceRecorder(const content::Scene& scene, double duration_s);

  void haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState& needle) override;
  void simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport& report,
                          const physics::TissueState& tissue, const physics::NeedleState& needle) override;

  /// Simulation thread, or when the loops stand still.
  const Trace& trace() const { return trace_; }
  /// The sample of the last step, also where the memory is used up; null: there is none yet.
  const TraceSample* newest() const { return newest_ ? &*newest_ : nullptr; }
  /// The trace with the events of the session's recording, once the loops stand still; the recorder is then empty.
  Trace take(std::vector<recording::EventRecord> events);
  /// Of the last sample, for whoever follows a procedure while it runs (after this in the list of listeners).
  content::TissueLocator& tissue() { return tissue_; }

private:
  void look_at_tissue(TraceSample& sample);
  void look_at_targets(TraceSample& sample) const;
  std::uint32_t buttons_at(std::uint64_t haptic_step);

  const content::Scene& scene_;
  content::TissueLocator tissue_;
  std::vector<content::TissueLocator::Carrier> targets_;  // [Scene::targets]
  Trace trace_;
  std::optional<TraceSample> newest_;
  std::size_t capacity_;
  // Buttons by haptic step, written by its thread: a simulation step wants those of the step that it consumed. Each
  // is the lower half of the step number, then the buttons; kRemembered steps are 1 s at the fastest rate.
  static constexpr std::size_t kRemembered = 4096;
  std::unique_ptr<std::array<std::atomic<std::uint64_t>, kRemembered>> pressed_;
  std::uint32_t buttons_ = 0;
};

}  // namespace stylet::training
