#include "haptic/safety/force_gain.h"

#include <algorithm>

namespace stylet::haptic {

double share_at_age(double age_s, double fade_s, double zero_s) {
  if (age_s <= fade_s) return 1;
  if (!(age_s < zero_s)) return 0;
  return (zero_s - age_s) / (zero_s - fade_s);
}

double ForceGain::step(double wanted, double pose_age_s, double patch_age_s, double dt_s) {
  const double fresh = std::min(share_at_age(pose_age_s, settings_.pose_fade_s, settings_.pose_zero_s),
                                share_at_age(patch_age_s, settings_.patch_fade_s, settings_.patch_zero_s));
  if (fresh <= 0) {
    drop();
    return 0;
  }
  if (!engaged_) {
    const bool is_small = wanted <= settings_.engage_share;
    waited_s_ += dt_s;
    // In tissue it may never be small by itself; a rise from zero that takes longer is as harmless.
    if (!is_small && waited_s_ <= settings_.engage_wait_s) return 0;
    engaged_ = true;
    rise_s_ = is_small ? settings_.rise_s : settings_.slow_rise_s;
  }
  const double risen = rise_s_ > 0 ? gain_ + dt_s / rise_s_ : 1;
  gain_ = std::min({risen, 1.0, fresh});
  return gain_;
}

void ForceGain::drop() {
  engaged_ = false;
  gain_ = 0;
  waited_s_ = 0;
}

}  // namespace stylet::haptic
