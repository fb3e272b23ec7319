#include "engine/session/held_breath.h"

#include "engine/content/breathing.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stylet::session {

HeldBreath::HeldBreath(content::Breathing breathing, std::uint32_t buttons)
    : breathing_(std::move(breathing)), buttons_(buttons) {
  breathing_.holds.clear();
}

bool HeldBreath::breathes() const {
  return breathing_.amplitude > 0 && !breathing_.drawn_once;
}

void HeldBreath::ask(bool hold) {
  asked_.store(hold && breathes(), std::memory_order_relaxed);
}

HeldBreath::State HeldBreath::state() const {
  if (!asked_.load(std::memory_order_relaxed)) return State::breathing;
  return held_.load(std::memory_order_relaxed) ? State::held : State::breathing_out;
}

void HeldBreath::haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState&) {
  const bool pressed = (record.buttons & buttons_) != 0;
  if (pressed && !pressed_) presses_.fetch_add(1, std::memory_order_relaxed);
  pressed_ = pressed;
}

std::optional<double> HeldBreath::inspiration(double time_s) {
  const double step_s = std::max(time_s - last_s_, 0.0);
  last_s_ = time_s;
  const bool asked = asked_.load(std::memory_order_relaxed);
  if (holding_) {
    const bool over = time_s - since_s_ >= kLongest;
    if (asked && !over) {
      lost_s_ += step_s;
    } else {
      holding_ = false;
      if (over) asked_.store(false, std::memory_order_relaxed);
    }
  } else if (asked) {
    // Breaths are whole at end-expiration: the first step behind it is where it is held.
    const double now = content::breaths(breathing_, time_s - lost_s_);
    const double before = content::breaths(breathing_, time_s - step_s - lost_s_);
    if (std::floor(now) > std::floor(before)) {
      holding_ = true;
      since_s_ = time_s;
    }
  }
  held_.store(holding_, std::memory_order_relaxed);
  left_s_.store(holding_ ? kLongest - (time_s - since_s_) : kLongest, std::memory_order_relaxed);
  return content::inspiration(breathing_, time_s - lost_s_);
}

}  // namespace stylet::session
