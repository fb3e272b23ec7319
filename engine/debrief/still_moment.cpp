#include "engine/debrief/still_moment.h"

#include "engine/procedures/kinds.h"

#include <algorithm>
#include <optional>

namespace stylet::debrief {

namespace {

constexpr double kStep = 0.02;  // s, between the frames that are looked at
constexpr std::string_view kClosest = "when the tip is closest to the target";

/// What the events tell last; none: nothing was done.
std::optional<StillMoment> find_moment(std::span<const recording::EventRecord> events, double from_s, double to_s) {
  std::optional<StillMoment> last;
  for (const procedures::Kind* kind : procedures::kinds()) {
    const auto still = kind->still(events, from_s, to_s);
    if (still && still->time_s >= from_s && (!last || still->time_s > last->time_s)) {
      last = StillMoment{still->time_s, still->words};
    }
  }
  return last;
}

}  // namespace

StillMoment still_moment(std::span<const recording::EventRecord> events, const FrameHistory& frames, double from_s,
                         double to_s) {
  from_s = std::max(from_s, frames.begin_s());
  to_s = std::min(to_s, frames.end_s());
  if (const auto moment = find_moment(events, from_s, to_s)) return *moment;
  StillMoment closest{.time_s = to_s, .words = kClosest};
  float least = std::numeric_limits<float>::infinity();
  state::FrameState frame = frames.make_frame();
  for (double time_s = from_s; time_s <= to_s; time_s += kStep) {
    if (!frames.sample(time_s, frame)) continue;
    const state::TargetState* target = frame.nearest_target();
    if (target != nullptr && target->distance > least) continue;
    if (target != nullptr) least = target->distance;
    closest.time_s = time_s;
  }
  return closest;
}

std::string_view still_words(std::span<const recording::EventRecord> events) {
  const auto moment = find_moment(events, 0, std::numeric_limits<double>::infinity());
  return moment ? moment->words : kClosest;
}

}  // namespace stylet::debrief
