#include "engine/debrief/still_moment.h"

#include "engine/training/flow.h"

#include <algorithm>
#include <optional>

namespace stylet::debrief {

namespace {

namespace flow_event = training::flow_event;

constexpr double kStep = 0.02;  // s, between the frames that are looked at
constexpr std::string_view kHeated = "at the end of the heating";
constexpr std::string_view kCored = "when the last core was taken";
constexpr std::string_view kClosest = "when the tip is closest to the target";

/// What the events tell; none: nothing was heated, no core taken.
std::optional<StillMoment> told(std::span<const recording::EventRecord> events, double from_s, double to_s) {
  std::optional<StillMoment> heated, cored;
  bool heating = false;
  for (const recording::EventRecord& event : events) {
    if (event.time_s > to_s) continue;
    if (event.name == flow_event::kAblationStarted) heating = true;
    if (event.name == flow_event::kAblationStopped) {
      heating = false;
      heated = StillMoment{event.time_s, kHeated};
    }
    if (event.name == flow_event::kBiopsyFired) cored = StillMoment{event.time_s, kCored};
  }
  if (heating) heated = StillMoment{to_s, kHeated};  // it goes on where the span or the recording ends
  if (heated && heated->time_s >= from_s) return heated;
  if (cored && cored->time_s >= from_s) return cored;
  return std::nullopt;
}

}  // namespace

StillMoment still_moment(std::span<const recording::EventRecord> events, const FrameHistory& frames, double from_s,
                         double to_s) {
  from_s = std::max(from_s, frames.begin_s());
  to_s = std::min(to_s, frames.end_s());
  if (const auto moment = told(events, from_s, to_s)) return *moment;
  StillMoment closest{.time_s = to_s, .words = kClosest};
  float least = std::numeric_limits<float>::infinity();
  state::FrameState frame = frames.make_frame();
  for (double time_s = from_s; time_s <= to_s; time_s += kStep) {
    if (!frames.sample(time_s, frame) || frame.target_distance > least) continue;
    least = frame.target_distance;
    closest.time_s = time_s;
  }
  return closest;
}

std::string_view still_words(std::span<const recording::EventRecord> events) {
  const auto moment = told(events, 0, std::numeric_limits<double>::infinity());
  return moment ? moment->words : kClosest;
}

}  // namespace stylet::debrief
