// How much of the force goes out: it comes on small and rises, and fades as its inputs grow old.
#pragma once

namespace stylet::haptic {

struct ForceGainSettings {
  double rise_s = 0.5;         ///< from 0 to 1; 0: at once
  double engage_share = 0.06;  ///< of the greatest force: it comes on where no more is wanted
  double engage_wait_s = 1;    ///< or where more has been wanted for so long
  double slow_rise_s = 2;      ///< and then in this time
  double pose_fade_s = 0.005;  ///< ages, see DeviceLimits
  double pose_zero_s = 0.020;
  double patch_fade_s = 0.2;
  double patch_zero_s = 0.5;
};

/// What share of the force remains at an age: 1 up to `fade_s`, 0 from `zero_s` on. An age that is not a number is
/// old.
double share_at_age(double age_s, double fade_s, double zero_s);

/// The gain rises with its time and falls at once. At 0 the force is off, and must engage anew.
class ForceGain {
public:
  explicit ForceGain(const ForceGainSettings& settings) : settings_(settings) {}

  /// @param wanted  share of the device's greatest force that the environment asks for
  /// @param pose_age_s, patch_age_s  of what the force was computed from
  /// @realtime no allocation, O(1)
  double step(double wanted, double pose_age_s, double patch_age_s, double dt_s);
  /// The force is off.
  void drop();
  bool engaged() const { return engaged_; }
  double gain() const { return gain_; }

private:
  ForceGainSettings settings_;
  bool engaged_ = false;
  double rise_s_ = 0;
  double gain_ = 0;
  double waited_s_ = 0;
};

}  // namespace stylet::haptic
