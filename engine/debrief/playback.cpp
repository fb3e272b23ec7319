#include "engine/debrief/playback.h"

#include <fmt/format.h>

#include <algorithm>

namespace stylet::debrief {

Playback::Playback(double from_s, double to_s, double speed)
    : from_s_(from_s), to_s_(to_s), speed_(std::clamp(speed, kSlowest, kFastest)), time_s_(from_s) {}

void Playback::apply(const PlaybackCommand& command) {
  if (std::holds_alternative<Pause>(command)) paused_ = !paused_;
  if (const auto* seek = std::get_if<Seek>(&command)) time_s_ += seek->by_s;
  if (std::holds_alternative<SeekStart>(command)) time_s_ = from_s_;
  if (std::holds_alternative<SeekEnd>(command)) time_s_ = to_s_;
  if (const auto* change = std::get_if<ChangeSpeed>(&command)) {
    speed_ = std::clamp(speed_ * change->factor, kSlowest, kFastest);
  }
  time_s_ = std::clamp(time_s_, from_s_, to_s_);
}

void Playback::advance(double elapsed_s, double known_s) {
  if (!paused_) time_s_ += speed_ * elapsed_s;
  time_s_ = std::clamp(std::min(time_s_, known_s), from_s_, to_s_);
}

std::string Playback::caption() const {
  return fmt::format("{:.2f} of {:.2f} s, {:g} x speed{}", time_s_, to_s_, speed_, paused_ ? ", paused" : "");
}

}  // namespace stylet::debrief
