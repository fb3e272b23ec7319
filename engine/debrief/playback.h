// Where a film player stands: playing, paused, seeking, faster, slower. No window, no clock of its own.
#pragma once

#include "engine/view/window.h"

#include <string>

namespace stylet::debrief {

/// Keys: space pauses, arrows seek by 1 s (with Shift by a tenth), + and - double and halve the speed, Home and End
/// go to the ends.
class Playback {
public:
  static constexpr double kSlowest = 1.0 / 16;
  static constexpr double kFastest = 16;

  /// @param speed  session time over real time
  Playback(double from_s, double to_s, double speed);

  void press(const view::Input::Stroke& stroke);
  /// Real time passes. @param known_s  up to where the session is known yet: playing waits there
  void advance(double elapsed_s, double known_s);

  double time_s() const { return time_s_; }
  double speed() const { return speed_; }
  bool paused() const { return paused_; }
  /// "12.34 of 31.00 s, 0.5 x speed, paused".
  std::string caption() const;

private:
  double from_s_;
  double to_s_;
  double speed_;
  double time_s_;
  bool paused_ = false;
};

}  // namespace stylet::debrief
