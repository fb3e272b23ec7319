// Follows a scene's first target through the simulation steps of its second body.
#pragma once

#include "engine/session/coupled_loops.h"

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace stylet::tests {

/// Where the target is: the mean of the liver's nodes around it, after every simulation step.
class TargetWatch : public session::StepListener {
public:
  explicit TargetWatch(const content::Scene& scene) {
    const std::vector<Eigen::Vector3d>& nodes = scene.bodies[kLiver].mesh.nodes;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      if ((nodes[n] - scene.targets[0].centre).norm() < 0.015) near_.push_back(static_cast<Eigen::Index>(n));
    }
  }

  void simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport& report,
                          const physics::TissueState& tissue, const physics::NeedleState&) override {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Eigen::Index n : near_) mean += tissue.positions[kLiver].col(n) / static_cast<double>(near_.size());
    times_.push_back(record.time_s);
    places_.push_back(mean);
    overlap = std::max(overlap, report.organs.deepest);
    flags |= report.flags;
  }

  /// Largest distance from where it was first, m.
  double largest() const { return largest_from(-std::numeric_limits<double>::infinity()); }
  /// Largest distance from where it was at a time, since then, m.
  double largest_from(double time_s) const {
    const auto first =
        static_cast<std::size_t>(std::lower_bound(times_.begin(), times_.end(), time_s - 1e-9) - times_.begin());
    double largest = 0;
    for (std::size_t i = first; i < places_.size(); ++i) {
      largest = std::max(largest, (places_[i] - places_[first]).norm());
    }
    return largest;
  }

  double overlap = 0;  ///< deepest of two bodies, m
  std::uint32_t flags = 0;

private:
  static constexpr std::size_t kLiver = 1;
  std::vector<Eigen::Index> near_;
  std::vector<double> times_;
  std::vector<Eigen::Vector3d> places_;
};

}  // namespace stylet::tests
