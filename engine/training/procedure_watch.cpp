#include "engine/training/procedure_watch.h"

#include "engine/content/segment.h"

#include <cmath>
#include <limits>

namespace stylet::training {
StepReader::StepReader(const content::Scene& scene)
    : scene_(scene), tissue_(scene), from_target_(scene.targets.size()), centers_(scene.targets.size()) {
  for (const content::Target& target : scene.targets) targets_.push_back(tissue_.carrier(target.centre));
}

procedures::Situation StepReader::situation() const {
  procedures::Situation now;
  now.target_distances.assign(scene_.targets.size(), std::numeric_limits<double>::infinity());
  return now;
}

procedures::Step StepReader::read(const recording::SimulationStepRecord& record,
                                  const physics::SimulationReport& report, const physics::TissueState& tissue,
                                  const physics::NeedleState& needle, procedures::Situation& now) {
  tissue_.update(tissue, record.time_s);
  procedures::Step step{.time_s = record.time_s,
                        .haptic_step = record.needle_step,
                        .tip = needle.positions.col(needle.node_count - 1),
                        .orientation = needle.orientations[needle.node_count - 1],
                        .in_tissue = needle.tip == physics::TipState::inside,
                        .at_tip = {},
                        .tissue = tissue_,
                        .cavities = std::span(report.cavities).first(report.cavity_count),
                        .cavity_shares = record.cavity_shares,
                        .targets = centers_};
  now.time_s = record.time_s;
  now.haptic_step = record.needle_step;
  now.in_tissue = step.in_tissue;
  now.depth = session::insertion_depth(scene_.needle, needle);
  now.off_plane = std::abs((record.probe.orientation.conjugate() * (step.tip - record.probe.position)).y());
  now.force = needle.wrench.force.norm();
  now.probe_lifted = scene_.probe.presses >= 0 && !(report.probe.area > 0);
  look_at_targets(now, step, record.time_s - last_s_);
  last_tip_ = step.tip;
  last_s_ = record.time_s;
  const bool works = scene_.exercise.plan && scene_.exercise.plan->working_length > 0;
  if (works || step.in_tissue) step.at_tip = tissue_.find(step.tip);
  return step;
}

void StepReader::look_at_targets(procedures::Situation& now, const procedures::Step& step, double elapsed_s) {
  const double works = scene_.exercise.plan ? scene_.exercise.plan->working_length : 0;
  const Eigen::Vector3d base = step.tip - works * (step.orientation * Eigen::Vector3d::UnitZ());
  // Slow or fast against the target that is nearest, which breathing moves; without one, in the room.
  Eigen::Vector3d moved = step.tip - last_tip_;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < scene_.targets.size(); ++i) {
    const content::Target& target = scene_.targets[i];
    const Eigen::Vector3d centre = tissue_.carried(targets_[i], target.centre);
    centers_[i] = centre;
    const double distance = content::distance_to_segment(centre, step.tip, base) - target.radius;
    now.target_distances[i] = distance;
    if (distance < nearest) {
      nearest = distance;
      moved = step.tip - centre - from_target_[i];
    }
    from_target_[i] = step.tip - centre;
  }
  now.speed = last_s_ >= 0 && elapsed_s > 0 ? moved.norm() / elapsed_s : std::numeric_limits<double>::infinity();
}

ProcedureWatch::ProcedureWatch(const content::Scene& scene, procedures::Procedure* procedure)
    : procedure_(procedure), reader_(scene), watched_([&] {
        return Watched{.now = reader_.situation(),
                       .observation = procedure != nullptr ? procedure->make_observation() : nullptr};
      }) {}

void ProcedureWatch::haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState&) {
  if ((record.buttons & ~buttons_ & 1U) != 0) presses_.fetch_add(1, std::memory_order_release);
  buttons_ = record.buttons;
}

void ProcedureWatch::simulation_stepped(const recording::SimulationStepRecord& record,
                                        const physics::SimulationReport& report, const physics::TissueState& tissue,
                                        const physics::NeedleState& needle) {
  if (needle.node_count < 2) return;
  Watched& watched = watched_.back();
  const procedures::Step step = reader_.read(record, report, tissue, needle, watched.now);
  watched.now.presses = presses_.load(std::memory_order_acquire);
  watched.now.observation = watched.observation.get();
  watched.tip_tissue = step.in_tissue ? step.at_tip.tissue : 0;
  if (procedure_ != nullptr) procedure_->observe(step, watched.observation.get());
  watched_.publish();
}

const Watched& ProcedureWatch::latest() {
  watched_.update();
  return watched_.front();
}

}  // namespace stylet::training
