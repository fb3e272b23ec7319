#include "engine/procedures/aspiration/draining_replay.h"

#include "engine/procedures/aspiration/plan.h"

#include <algorithm>

namespace stylet::procedures::aspiration {

void DrainingReplay::observe(const Step& step, const Situation&) {
  Moment now{.time_s = step.time_s,
             .shares = {},
             .syringe = {.capacity = static_cast<float>(plan_of(scene_.exercise).syringe.capacity)}};
  double drawn = 0;
  for (std::size_t c = 0; c < scene_.cavities.size() && c < step.cavity_shares.size(); ++c) {
    drawn += (1 - step.cavity_shares[c]) * scene_.cavities[c].volume;
    now.shares.push_back(static_cast<float>(step.cavity_shares[c]));
  }
  now.syringe.held = static_cast<float>(drawn);
  const std::lock_guard lock(mutex_);
  moments_.push_back(std::move(now));
}

void DrainingReplay::show_at(double time_s, state::FrameState& frame) {
  const std::lock_guard lock(mutex_);
  const auto after = std::ranges::upper_bound(moments_, time_s, {}, &Moment::time_s);
  if (after == moments_.begin()) return;
  frame.cavity_shares = std::prev(after)->shares;
  frame.syringe = std::prev(after)->syringe;
}

}  // namespace stylet::procedures::aspiration
