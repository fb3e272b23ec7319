#include "engine/training/trace.h"

#include "engine/training/beam.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace stylet::training {
namespace {

constexpr double kSweep = 0.5e-3;  // m between the points at which the way of the tip is looked at
constexpr int kMostSweep = 40;     // of them in a step: 20 mm

/// The contact behind which all of the needle is in the patient; null: it is not in.
const physics::NeedleContact* entry_contact(const physics::NeedleState& needle) {
  const physics::NeedleContact* first = nullptr;
  const auto beams = [](const physics::NeedleContact& c) { return c.beam + c.beam_fraction; };
  for (int i = 0; i < needle.contact_count; ++i) {
    const physics::NeedleContact& contact = needle.contacts[i];
    if (first == nullptr || beams(contact) < beams(*first)) first = &contact;
  }
  return first;
}

double bend(const physics::NeedleState& needle) {
  const Eigen::Vector3d hub = needle.positions.col(0);
  const Eigen::Vector3d chord = needle.positions.col(needle.node_count - 1) - hub;
  const double length = chord.norm();
  if (!(length > 0)) return 0;
  double largest = 0;
  for (int i = 1; i + 1 < needle.node_count; ++i) {
    largest = std::max(largest, (needle.positions.col(i) - hub).cross(chord).norm() / length);
  }
  return largest;
}

}  // namespace

TraceRecorder::TraceRecorder(const content::Scene& scene, double duration_s)
    : scene_(scene),
      tissue_(scene),
      capacity_(std::min(static_cast<std::size_t>(std::min(duration_s, kLongest) * scene.rates.simulation_hz) + 100,
                         kMostSamples)),
      pressed_(std::make_unique<std::array<std::atomic<std::uint64_t>, kRemembered>>()) {
  for (const content::Target& target : scene.targets) targets_.push_back(tissue_.carrier(target.centre));
  trace_.samples.reserve(capacity_);
}

void TraceRecorder::haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState&) {
  const std::uint64_t entry = record.step << 32 | record.buttons;
  (*pressed_)[record.step % kRemembered].store(entry, std::memory_order_release);
}

std::uint32_t TraceRecorder::buttons_at(std::uint64_t haptic_step) {
  const std::uint64_t entry = (*pressed_)[haptic_step % kRemembered].load(std::memory_order_acquire);
  if (entry >> 32 == (haptic_step & 0xffffffffU)) buttons_ = static_cast<std::uint32_t>(entry);
  return buttons_;
}

void TraceRecorder::simulation_stepped(const recording::SimulationStepRecord& record,
                                       const physics::SimulationReport& report, const physics::TissueState& tissue,
                                       const physics::NeedleState& needle) {
  if (needle.node_count < 2) return;
  const auto last = static_cast<std::size_t>(needle.node_count) - 1;
  const Eigen::Vector3d tip = needle.positions.col(needle.node_count - 1);
  TraceSample sample{.time_s = record.time_s,
                     .tip = tip,
                     .tip_orientation = needle.orientations[last],
                     .hub = needle.positions.col(0),
                     .hub_orientation = needle.orientations.front(),
                     .entry = tip,
                     .bend = bend(needle),
                     .damage = needle.damage,
                     .tip_state = needle.tip,
                     .tip_body = needle.tip_body,
                     .force = needle.wrench.force,
                     .probe = record.probe,
                     .probe_area = report.probe.area,
                     .buttons = buttons_at(record.needle_step),
                     .inspiration = record.inspiration};
  if (const physics::NeedleContact* entry = entry_contact(needle)) {
    sample.entry = entry->position;
    sample.inserted = session::insertion_depth(scene_.needle, needle);
  }
  const Eigen::Quaterniond probe_from_patient = record.probe.orientation.conjugate();
  sample.probe_force = -(probe_from_patient * report.probe.wrench.force).z();
  sample.tip_in_probe = probe_from_patient * (tip - record.probe.position);
  sample.in_beam = length_in_beam(scene_.probe, record.probe, needle, sample.inserted);
  tissue_.update(tissue, record.time_s);
  look_at_tissue(sample);
  look_at_targets(sample);
  newest_ = sample;
  if (trace_.samples.size() < capacity_) {
    trace_.samples.push_back(sample);
  } else {
    ++trace_.dropped;
  }
}

void TraceRecorder::look_at_tissue(TraceSample& sample) {
  const content::TissuePlace place = tissue_.find(sample.tip);
  sample.tissue = place.tissue;
  sample.forbidden = place.forbidden;
  sample.crossed = place.forbidden;
  sample.near_tissue =
      tissue_.in_body(sample.tip + kProbeAhead * (sample.tip_orientation * Eigen::Vector3d::UnitZ()));
  if (!newest_ || scene_.forbidden.empty()) return;
  const Eigen::Vector3d way = newest_->tip - sample.tip;
  const int points = std::min(static_cast<int>(way.norm() / kSweep), kMostSweep);
  for (int i = 1; i < points; ++i) sample.crossed |= tissue_.find(sample.tip + way * i / points).forbidden;
}

void TraceRecorder::look_at_targets(TraceSample& sample) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    const Eigen::Vector3d centre = tissue_.carried(targets_[i], scene_.targets[i].centre);
    const double distance = (sample.tip - centre).norm();
    if (distance >= nearest) continue;
    nearest = distance;
    sample.target = static_cast<int>(i);
    sample.target_position = centre;
    sample.target_distance = distance;
  }
}

Trace TraceRecorder::take(std::vector<recording::EventRecord> events) {
  trace_.events = std::move(events);
  std::ranges::stable_sort(trace_.events, {}, &recording::EventRecord::time_s);
  return std::exchange(trace_, {});
}

}  // namespace stylet::training
