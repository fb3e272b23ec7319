#include "engine/debrief/playback.h"

#include <fmt/format.h>

#include <algorithm>

namespace stylet::debrief {

namespace {
// GLFW's key codes; letters and signs are ASCII.
constexpr int kRight = 262, kLeft = 263, kHome = 268, kEnd = 269, kPadMinus = 333, kPadPlus = 334;
}  // namespace

Playback::Playback(double from_s, double to_s, double speed)
    : from_s_(from_s), to_s_(to_s), speed_(std::clamp(speed, kSlowest, kFastest)), time_s_(from_s) {}

void Playback::press(const view::Input::Stroke& stroke) {
  const double step_s = stroke.shift ? 0.1 : 1;
  switch (stroke.key) {
    case ' ':
      if (!stroke.repeated) paused_ = !paused_;
      break;
    case kRight:
      time_s_ += step_s;
      break;
    case kLeft:
      time_s_ -= step_s;
      break;
    case kHome:
      time_s_ = from_s_;
      break;
    case kEnd:
      time_s_ = to_s_;
      break;
    case '=':
    case '+':
    case kPadPlus:
      speed_ = std::min(2 * speed_, kFastest);
      break;
    case '-':
    case kPadMinus:
      speed_ = std::max(speed_ / 2, kSlowest);
      break;
    default:
      break;
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
