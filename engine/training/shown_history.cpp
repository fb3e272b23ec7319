#include "engine/training/shown_history.h"

#include <algorithm>
#include <utility>

namespace stylet::training {

void ShownHistory::add(double time_s, const procedures::Procedure& procedure) {
  if (!shown_.empty() && time_s < shown_.back().time_s + kShortest) return;
  state::FrameState frame;
  procedure.show(frame);
  const auto held = [](const std::optional<state::SyringeState>& syringe) { return syringe ? syringe->held : -1; };
  if (!shown_.empty()) {
    const Shown& last = shown_.back();
    if (last.zone == frame.zone && last.cores.size() == frame.cores.size() &&
        last.cavity_shares == frame.cavity_shares && held(last.syringe) == held(frame.syringe)) {
      return;
    }
  }
  shown_.push_back({time_s, std::move(frame.zone), std::move(frame.cores), std::move(frame.cavity_shares),
                    std::move(frame.syringe)});
}

void ShownHistory::show_at(double time_s, state::FrameState& frame) const {
  const auto after = std::ranges::upper_bound(shown_, time_s, {}, &Shown::time_s);
  if (after == shown_.begin()) return;
  const Shown& shown = *(after - 1);
  frame.zone = shown.zone;
  // Kept at times that were looked at, they know better when they were cut.
  frame.cores.clear();
  for (const state::CoreTrack& core : shown_.back().cores) {
    if (core.fired_s <= time_s) frame.cores.push_back(core);
  }
  frame.cavity_shares = shown.cavity_shares;
  frame.syringe = shown.syringe;
}

}  // namespace stylet::training
