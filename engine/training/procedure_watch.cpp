#include "engine/training/procedure_watch.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::training {
namespace {

Watched sized_for(const content::Scene& scene) {
  Watched watched;
  watched.input.target_distances.assign(scene.targets.size(), std::numeric_limits<double>::infinity());
  watched.core.content.assign(scene.tissues.size(), 0.0);
  return watched;
}

}  // namespace

int nearest_target(const FlowInput& input) {
  const auto& distances = input.target_distances;
  const auto nearest = std::ranges::min_element(distances);
  return distances.empty() ? -1 : static_cast<int>(nearest - distances.begin());
}

ProcedureWatch::ProcedureWatch(const content::Scene& scene)
    : scene_(scene), tissue_(scene), from_target_(scene.targets.size()), watched_(sized_for(scene)) {
  for (const content::Target& target : scene.targets) targets_.push_back(tissue_.carrier(target.centre));
  core_ = sized_for(scene).core;
}

void ProcedureWatch::haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState&) {
  if ((record.buttons & ~buttons_ & 1U) != 0) presses_.fetch_add(1, std::memory_order_release);
  buttons_ = record.buttons;
}

void ProcedureWatch::simulation_stepped(const recording::SimulationStepRecord& record,
                                        const physics::SimulationReport& report, const physics::TissueState& tissue,
                                        const physics::NeedleState& needle) {
  if (needle.node_count < 2) return;
  tissue_.update(tissue, record.time_s);
  const Eigen::Vector3d tip = needle.positions.col(needle.node_count - 1);
  const Eigen::Quaterniond& orientation = needle.orientations[static_cast<std::size_t>(needle.node_count - 1)];
  const Eigen::Vector3d axis = orientation * Eigen::Vector3d::UnitZ();

  Watched& watched = watched_.back();
  FlowInput& input = watched.input;
  input.time_s = record.time_s;
  input.in_tissue = needle.tip == physics::TipState::inside;
  input.depth = session::insertion_depth(scene_.needle, needle);
  input.off_plane = std::abs((record.probe.orientation.conjugate() * (tip - record.probe.position)).y());
  input.force = needle.wrench.force.norm();
  input.probe_lifted = scene_.probe.presses >= 0 && !(report.probe.area > 0);
  input.presses = presses_.load(std::memory_order_acquire);
  look_at_targets(input, tip, axis, record.time_s - last_s_);
  last_tip_ = tip;
  last_s_ = record.time_s;
  watched.haptic_step = record.needle_step;

  const content::Sampling& sampling = scene_.exercise.sampling;
  const bool ablates = sampling.kind == content::SamplingKind::ablation;
  const TissuePlace at_tip = ablates || input.in_tissue ? tissue_.find(tip) : TissuePlace{};
  watched.tip_tissue = input.in_tissue ? at_tip.tissue : 0;
  if (ablates) {
    watched.electrode = {.tip = at_tip.rest,
                         .base = tissue_.find(tip - sampling.ablation.exposed * axis).rest,
                         .radius = scene_.needle.outer_diameter / 2};
    watched.electrode_body = at_tip.body;
  }
  if (const std::uint32_t wanted = wanted_cores_.load(std::memory_order_acquire); wanted != cores_) {
    const content::BiopsyGun& gun = sampling.gun;
    cores_ = wanted;
    core_.time_s = record.time_s;
    core_.haptic_step = record.needle_step;
    core_.content = core_content(
        tissue_, scene_.tissues.size(), tip, orientation,
        {.throw_length = gun.throw_length, .dead_length = gun.throw_length - gun.notch, .bore = gun.bore});
  }
  watched.cores = cores_;
  watched.core = core_;
  watched_.publish();
}

void ProcedureWatch::look_at_targets(FlowInput& input, const Eigen::Vector3d& tip, const Eigen::Vector3d& axis,
                                     double elapsed_s) {
  const bool heats = scene_.exercise.sampling.kind == content::SamplingKind::ablation;
  const double bare = heats ? scene_.exercise.sampling.ablation.exposed : 0;
  // Slow or fast against the target that is nearest, which breathing moves; without one, in the room.
  Eigen::Vector3d moved = tip - last_tip_;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < scene_.targets.size(); ++i) {
    const content::Target& target = scene_.targets[i];
    const Eigen::Vector3d centre = tissue_.carried(targets_[i], target.centre);
    const double distance = distance_to_segment(centre, tip, tip - bare * axis) - target.radius;
    input.target_distances[i] = distance;
    if (distance < nearest) {
      nearest = distance;
      moved = tip - centre - from_target_[i];
    }
    from_target_[i] = tip - centre;
  }
  input.speed = last_s_ >= 0 && elapsed_s > 0 ? moved.norm() / elapsed_s : std::numeric_limits<double>::infinity();
}

const Watched& ProcedureWatch::latest() {
  watched_.update();
  return watched_.front();
}

}  // namespace stylet::training
