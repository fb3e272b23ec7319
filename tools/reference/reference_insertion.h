// Reference insertion R1 (content/reference/): the experiment, and a lockstep run of the two loops through it.
#pragma once

#include "physics/loops/haptic_loop.h"
#include "physics/loops/simulation_loop.h"

#include <Eigen/Core>

#include <array>
#include <filesystem>
#include <memory>
#include <vector>

namespace stylet::reference {

/// See content/reference/README.md. SI.
struct ReferenceInsertion {
  double cube_edge = 0;
  int nodes_per_edge = 0;
  physics::ElasticMaterial material;
  physics::NeedleProperties needle;
  Eigen::Vector3d tip_start = Eigen::Vector3d::Zero();
  std::vector<std::array<double, 2>> axial_speed;
  double lateral_amplitude = 0;
  double lateral_start = 0;
  double lateral_end = 1;
  double contact_spacing = 0;
  double haptic_hz = 0;
  double simulation_hz = 0;
  double duration = 0;
  double held_height = 1e-9;  ///< nodes no higher than this are held, m

  /// Pose of the base at a time.
  physics::StylusPose base(double time_s) const;
  physics::SimulationBody body() const;
  int haptic_steps_per_simulation_step() const;
};

/// @throws files::ContentError  the first thing wrong with the file, as one line
ReferenceInsertion read_reference_insertion(const std::filesystem::path& path);

/// How a run of a reference insertion is set up.
struct ReferenceRun {
  physics::Coupling coupling = physics::Coupling::paper_updated;
  double relative_compliance = 0;                       ///< of the constraint rows; 0: the paper's exact system
  physics::NeedleTrackSettings track{};                 ///< coupling `stylet`; its spacing is the insertion's
  std::shared_ptr<const physics::TissueMap> tissues{};  ///< coupling `stylet`; null: nothing resists the needle
  double roll_deg = 0;                                  ///< of the needle about its axis
  int latency_steps = 0;                                ///< simulation steps between a patch's making and its use
  int worker_period = 1;  ///< the worker runs after every so many simulation steps; 0: never
};

/// The two loops in lockstep: one simulation step, then its haptic steps.
class ReferenceExperiment {
public:
  ReferenceExperiment(const ReferenceInsertion& insertion, const ReferenceRun& run);

  /// One simulation step and its haptic steps.
  void advance();
  /// The two kinds of step by themselves, for those who time or watch them.
  void simulation_step();
  /// Appends to forces().
  void haptic_step();
  const ReferenceInsertion& insertion() const { return insertion_; }
  double time_s() const;
  /// Force on the hand at every haptic step, N.
  const std::vector<Eigen::Vector3d>& forces() const { return forces_; }
  const physics::NeedleState& needle() const { return haptic_->state(); }
  const physics::TissuePatch& patch() const { return patches_.front(); }
  /// The patch that the haptic steps consume: patch(), or an older one where there is latency.
  const physics::TissuePatch& patch_in_use() const { return patches_.back(); }
  physics::HapticLoop& haptic() { return *haptic_; }
  physics::SimulationLoop& simulation() { return *simulation_; }
  const physics::SimulationReport& report() const { return report_; }
  /// Contacts and rows seen at most; NeedleFlag and PatchFlag bits ever seen.
  int most_contacts() const { return most_contacts_; }
  std::uint32_t needle_flags() const { return needle_flags_; }

private:
  physics::StylusPose base() const;

  ReferenceInsertion insertion_;
  ReferenceRun run_;
  std::unique_ptr<physics::SimulationLoop> simulation_;
  std::unique_ptr<physics::HapticLoop> haptic_;
  std::vector<physics::TissuePatch> patches_;  // newest first
  physics::SimulationReport report_;
  std::vector<Eigen::Vector3d> forces_;
  std::uint64_t haptic_step_ = 0;
  std::uint64_t simulation_step_ = 0;
  int most_contacts_ = 0;
  std::uint32_t needle_flags_ = 0;
};

/// max |F(k+1) - F(k)| of a component, N a sample.
double jump(const std::vector<Eigen::Vector3d>& forces, int axis);
/// The largest step of a component that is not its slope, N: max |F(k+1) - F(k) - (F(k) - F(k-1) + F(k+2) -
/// F(k+1))/2|, what is left between two samples once either side is extrapolated in a straight line to half way
/// between them. A step by J gives J at any slope, a smooth force O(dt^3).
double discontinuity(const std::vector<Eigen::Vector3d>& forces, int axis);
/// RMS of F(k+1) - 2 F(k) + F(k-1) of a component, N.
double roughness(const std::vector<Eigen::Vector3d>& forces, int axis);

}  // namespace stylet::reference
