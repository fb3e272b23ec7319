// The puncture that has just happened, for whoever lets the trainee see, hear or feel it.
#pragma once

#include "engine/session/coupled_loops.h"
#include "physics/messages/latest_value.h"

#include <cstdint>
#include <optional>

namespace stylet::session {

/// The haptic thread writes, one other reads.
class PunctureWatch final : public StepListener {
public:
  /// @realtime
  void haptic_stepped(const recording::HapticStepRecord& /*record*/, const physics::NeedleState& needle) override {
    if (needle.puncture_count == written_) return;
    written_ = needle.puncture_count;
    newest_.back() = {needle.last_puncture, needle.puncture_count};
    newest_.publish();
  }

  /// Reader: the last one since it was asked before; none: there was none.
  std::optional<physics::Puncture> take() {
    newest_.update();
    const Counted& newest = newest_.front();
    if (newest.count == taken_) return std::nullopt;
    taken_ = newest.count;
    return newest.puncture;
  }

private:
  struct Counted {
    physics::Puncture puncture;
    std::uint32_t count = 0;
  };
  physics::LatestValue<Counted> newest_{Counted{}};
  std::uint32_t written_ = 0;  // haptic thread's
  std::uint32_t taken_ = 0;    // reader's
};

}  // namespace stylet::session
