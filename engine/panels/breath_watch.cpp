#include "engine/panels/breath_watch.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>

namespace stylet::panels {

using State = session::HeldBreath::State;

void BreathWatch::ask() {
  const bool hold = breathes();
  let_go_ = !hold;
  breath_.ask(hold);
}

void BreathWatch::look(session::LiveSession& live) {
  for (std::uint32_t presses = breath_.take_presses(); presses > 0; --presses) ask();
  const State state = breath_.state();
  if (state == seen_) return;
  if (seen_ == State::held && !let_go_) gave_up_s_ = live.time_s();
  seen_ = state;
  let_go_ = false;
  const char* name = state == State::held            ? "breath_held"
                     : state == State::breathing_out ? "breath_out"
                                                     : "breathing";
  live.add_event({.time_s = live.time_s(), .name = name});
}

std::string BreathWatch::in_words(double time_s) const {
  switch (seen_) {
    case State::breathing_out:
      return "The patient breathes out and will hold";
    case State::held:
      return fmt::format("Breath held: {:.0f} s left", std::ceil(breath_.left_s()));
    case State::breathing:
      break;
  }
  return time_s - gave_up_s_ < kSaid ? "The patient had to breathe again" : "";
}

}  // namespace stylet::panels
