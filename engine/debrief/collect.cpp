#include "engine/debrief/collect.h"

#include "engine/debrief/outline.h"
#include "engine/picture/png_bytes.h"
#include "engine/procedures/kinds.h"
#include "engine/session/puncture_event.h"
#include "engine/session/recorder.h"
#include "engine/session/replay.h"
#include "engine/stills/pictures.h"
#include "engine/training/flow.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

namespace stylet::debrief {

namespace {

using recording::EventRecord;
using training::Trace;
using training::TraceSample;

constexpr std::size_t kPathPoints = 3000;
constexpr std::size_t kMostPictures = 8;
constexpr double kSameMoment = 0.15;  // s

PathPoint point_of(const TraceSample& s) {
  const Eigen::Vector3d axis = s.hub_orientation * Eigen::Vector3d::UnitZ();
  const double along = s.force.dot(axis);
  return {.time_s = s.time_s,
          .tip = s.tip,
          .tissue = s.tissue,
          .inserted = s.inserted,
          .force = s.force.norm(),
          .axial = -along,
          .lateral = (s.force - along * axis).norm(),
          .target_distance = s.target_distance};
}

constexpr std::array<float, 3> kAir{0.32F, 0.42F, 0.48F};  // seen on light and dark pages

/// The names of tissues for people: "bright_target" as "bright target".
std::string spaced(std::string text) {
  std::ranges::replace(text, '_', ' ');
  return text;
}

/// "biopsy_fired" as a title: "Biopsy fired".
std::string words(std::string_view name) {
  std::string text = spaced(std::string(name));
  if (!text.empty() && text.front() >= 'a' && text.front() <= 'z') {
    text.front() = static_cast<char>(text.front() - 'a' + 'A');
  }
  return text;
}

/// What its kind tells of an event, if it is one of a procedure.
template <typename Tell>
std::optional<procedures::DebriefEntry> described_by_a_kind(const Tell& tell) {
  for (const procedures::Kind* kind : procedures::kinds()) {
    if (auto entry = tell(*kind)) return entry;
  }
  return std::nullopt;
}

std::optional<procedures::DebriefEntry> step_of(const EventRecord& event) {
  return described_by_a_kind([&](const procedures::Kind& kind) { return kind.describe_step(event); });
}

std::optional<procedures::DebriefEntry> result_of(const EventRecord& event) {
  return described_by_a_kind([&](const procedures::Kind& kind) { return kind.describe_result(event); });
}

std::string text_of(const EventRecord& event, std::string_view field) {
  return std::string(event.version_1_text().empty() ? event.text(field) : event.version_1_text());
}

/// @param sampling  what the stage of sampling is called in this session
DebriefEvent event_of(const EventRecord& event, std::string_view sampling) {
  if (const std::string_view stage = training::stage_of(event); !stage.empty()) {
    const bool samples = stage == training::stage_name(training::Stage::sampling);
    return {event.time_s, EventKind::stage, samples ? std::string(sampling) : words(stage), ""};
  }
  if (auto step = step_of(event)) return {event.time_s, EventKind::sample, step->title, step->detail};
  if (auto result = result_of(event)) return {event.time_s, EventKind::note, result->title, spaced(result->detail)};
  if (event.name == session::Recorder::kSafetyEvent) {
    return {event.time_s, EventKind::safety, "Force limited", words(text_of(event, session::Recorder::kSafetyLimit))};
  }
  if (event.name == training::flow_event::kRefused && event.version_1_text().empty()) {
    return {event.time_s, EventKind::note, words(event.name),
            spaced(fmt::format("{}: {}", event.text("action"), event.text("reason")))};
  }
  return {event.time_s, EventKind::note, words(event.name), spaced(recording::fields_in_words(event))};
}

/// Of the kind of procedure that the events are of.
std::string_view sampling_title(const std::vector<EventRecord>& events) {
  for (const procedures::Kind* kind : procedures::kinds()) {
    if (std::ranges::find(events, kind->approach_event(), &EventRecord::name) != events.end()) {
      return kind->sampling_title();
    }
  }
  return "Sampling";
}

/// Tissue inside the boundary of the body that holds the first target; -1: there is none.
int tissue_around_target(const content::Scene& scene) {
  int body = -1;
  for (const content::Surface& s : scene.surfaces) {
    if (s.role == content::SurfaceRole::target && body < 0) body = s.body;
  }
  for (const content::Surface& s : scene.surfaces) {
    if (body >= 0 && s.role == content::SurfaceRole::boundary && s.body == body) return s.tissue;
  }
  return -1;
}

const TraceSample* sample_at(const Trace& trace, double time_s) {
  if (trace.samples.empty()) return nullptr;
  const auto later = std::ranges::lower_bound(trace.samples, time_s, {}, &TraceSample::time_s);
  return later == trace.samples.end() ? &trace.samples.back() : &*later;
}

double arrival_s(const Trace& trace) {
  const std::size_t index = training::arrival(trace);
  if (index < trace.samples.size()) return trace.samples[index].time_s;
  return trace.samples.empty() ? 0 : trace.samples.back().time_s;
}

void add_scores(DebriefData& data, const training::Score& score) {
  data.score = score_of(score);
  for (const training::ScoreLine& line : score.lines) {
    const auto metric = std::ranges::find(data.metrics, line.criterion.metric, &DebriefMetric::key);
    if (metric == data.metrics.end()) continue;
    metric->points = line.points;
    metric->most_points = line.most;
    metric->full = line.criterion.full;
    metric->zero = line.criterion.zero;
    metric->critical = line.criterion.critical;
    metric->failed = line.failed;
  }
}

}  // namespace

DebriefScore score_of(const training::Score& score) {
  return {.total = score.total,
          .pass_mark = score.pass_mark,
          .done = score.done,
          .passed = score.passed,
          .failed_critical = score.failed_critical};
}

std::vector<PathPoint> path_of(const Trace& trace) {
  std::vector<PathPoint> path;
  const std::size_t spell = trace.samples.size() / kPathPoints + 1;
  for (std::size_t i = 0; i < trace.samples.size(); i += spell) {
    const auto first = trace.samples.begin() + static_cast<std::ptrdiff_t>(i);
    const auto end = trace.samples.begin() + static_cast<std::ptrdiff_t>(std::min(i + spell, trace.samples.size()));
    const auto strongest = std::max_element(first, end, [](const TraceSample& a, const TraceSample& b) {
      return a.force.squaredNorm() < b.force.squaredNorm();
    });
    path.push_back(point_of(*strongest));
  }
  return path;
}

bool is_result(const EventRecord& event) {
  return result_of(event).has_value();
}

std::vector<DebriefEvent> events_of(const std::vector<EventRecord>& events) {
  std::vector<DebriefEvent> out;
  const bool punctured =
      std::ranges::any_of(events, [](const EventRecord& e) { return e.name == session::kPunctureEvent; });
  const std::string_view sampling = sampling_title(events);
  for (const EventRecord& event : events) {
    if (event.name == "buttons") continue;
    if (punctured && (event.name == "entered" || event.name == "left")) continue;  // said better by the punctures
    if (event.name != session::kPunctureEvent) {
      out.push_back(event_of(event, sampling));
      continue;
    }
    if (const auto p = session::puncture_of(event)) {
      out.push_back({p->time_s, EventKind::puncture, fmt::format("Into {}", spaced(p->to)),
                     fmt::format("from {}, {:.2f} N", spaced(p->from), p->force_n)});
    }
  }
  std::ranges::stable_sort(out, {}, &DebriefEvent::time_s);
  return out;
}

std::vector<KeyMoment> key_moments(const content::Scene& scene, const recording::Recording& recording,
                                   const Trace& trace) {
  std::vector<KeyMoment> moments;
  const std::vector<session::PunctureEvent> punctures = session::punctures(recording.events);
  if (!punctures.empty()) {
    const session::PunctureEvent& first = punctures.front();
    moments.push_back(
        {first.time_s, first.to == "skin" ? "Skin puncture" : fmt::format("Into {}", spaced(first.to))});
  }
  if (const int tissue = tissue_around_target(scene); tissue >= 0) {
    const std::string& organ = scene.tissues[tissue].name;
    const auto into = std::ranges::find(punctures, organ, &session::PunctureEvent::to);
    if (into != punctures.end() && into != punctures.begin())
      moments.push_back({into->time_s, fmt::format("Capsule: into {}", spaced(organ))});
  }
  for (const EventRecord& event : recording.events) {
    if (const auto step = step_of(event)) moments.push_back({event.time_s, step->title});
  }
  if (!scene.targets.empty()) {
    const double at_s = arrival_s(trace);
    const bool there =
        std::ranges::any_of(moments, [&](const KeyMoment& m) { return std::abs(m.time_s - at_s) < kSameMoment; });
    const bool arrived = training::arrival(trace) < trace.samples.size();
    if (!there && !trace.samples.empty()) moments.push_back({at_s, arrived ? "Closest to the target" : "At the end"});
  }
  std::ranges::stable_sort(moments, {}, &KeyMoment::time_s);
  if (moments.size() > kMostPictures) moments.resize(kMostPictures);
  return moments;
}

DebriefData collect(const content::Scene& scene, const recording::Recording& recording, Footage& footage,
                    const std::vector<training::Metric>& metrics, const std::optional<Expert>& expert) {
  const Trace& trace = footage.trace();
  const session::RecordedSettings settings = session::recorded_settings(recording);
  DebriefData data{.title = scene.title.empty() ? scene.name : scene.title,
                   .scenario = scene.name,
                   .build = recording.header.build,
                   .stylus = settings.device,
                   .mode = settings.mode,
                   .force_scale = settings.force_scale,
                   .duration_s = footage.duration_s(),
                   .cut_off = !recording.complete(),
                   .start_seed = settings.start_seed};
  for (const training::Metric& metric : metrics) {
    DebriefMetric& shown = data.metrics.emplace_back(DebriefMetric{.key = metric.key,
                                                                   .title = metric.title,
                                                                   .unit = metric.unit,
                                                                   .value = metric.value,
                                                                   .definition = metric.definition,
                                                                   .source = metric.source});
    if (!expert) continue;
    const auto theirs = std::ranges::find(expert->metrics, metric.key, &training::Metric::key);
    if (theirs != expert->metrics.end()) shown.expert = theirs->value;
  }
  if (const auto score = training::score(metrics, scene, training::something_done(trace, scene)))
    add_scores(data, *score);
  data.events = events_of(recording.events);
  for (const content::Tissue& tissue : scene.tissues) {
    data.tissues.push_back({tissue.name, {tissue.colour[0], tissue.colour[1], tissue.colour[2]}});
  }
  data.tissues.front().colour = kAir;  // "outside"
  data.path = path_of(trace);
  if (expert) {
    data.expert = expert->name;
    data.expert_path = expert->path;
  }
  data.arrival_s = arrival_s(trace);
  state::FrameState moment = footage.frames().make_frame();
  footage.frames().sample(data.arrival_s, moment);
  for (const Eigen::Vector3f& node : moment.needle_positions) data.shaft.push_back(node.cast<double>());
  for (const content::Target& target : scene.targets) {
    data.targets.push_back({.name = target.name, .centre = target.centre, .radius = target.radius});
  }
  for (std::size_t t = 0; t < data.targets.size(); ++t) {
    data.targets[t].centre = moment.targets[t].centre.cast<double>();
  }
  const Eigen::Vector3d around = data.targets.empty()
                                     ? data.shaft.empty() ? Eigen::Vector3d::Zero().eval() : data.shaft.back()
                                     : data.targets.front().centre;
  data.outlines = outlines_of(scene, moment, around);
  if (footage.frame_at(footage.frames().end_s(), moment)) data.cores = moment.cores;
  data.eye = scene.camera.eye;
  data.up = scene.camera.up;
  return data;
}

namespace {
constexpr stills::PictureSettings kMomentPanes{
    .view_width = 64, .view_height = 64, .ultrasound_width = 560, .ultrasound_height = 420};
}

KeyMomentPictures::KeyMomentPictures(const content::Scene& scene, gpu::Device& device,
                                     const recording::Recording& recording, Footage& footage)
    : scene_(scene),
      footage_(footage),
      pictures_(device, scene, kMomentPanes),
      moments_(key_moments(scene, recording, footage.trace())),
      frame_(footage.frames().make_frame()) {}

double KeyMomentPictures::share() const {
  return moments_.empty() ? 1 : static_cast<double>(next_) / static_cast<double>(moments_.size());
}

bool KeyMomentPictures::draw_next() {
  if (next_ == moments_.size()) return false;
  const KeyMoment& moment = moments_[next_];
  if (footage_.frame_at(moment.time_s, frame_)) {
    const picture::Picture image = pictures_.draw(frame_, scene_.camera).ultrasound;
    std::vector<std::uint8_t> grey;
    for (std::size_t i = 0; i < image.rgba.size(); i += 4) grey.push_back(image.rgba[i + 1]);
    std::string caption = pictures_.note();
    if (const TraceSample* at = sample_at(footage_.trace(), moment.time_s); at != nullptr && caption.empty()) {
      caption = fmt::format("{:.0f} mm deep; tip {:.1f} mm from the image plane", at->inserted * 1e3,
                            std::abs(at->tip_in_probe.y()) * 1e3);
      if (at->target >= 0) caption += fmt::format(", {:.1f} mm from the target's centre", at->target_distance * 1e3);
    }
    drawn_.push_back({.time_s = moment.time_s,
                      .title = moment.title,
                      .caption = caption,
                      .png = picture::png_bytes(image.width, image.height, std::span<const std::uint8_t>(grey))});
  }
  ++next_;
  return true;
}

}  // namespace stylet::debrief
