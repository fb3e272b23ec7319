// Where a film player stands: playing, paused, seeking, faster, slower. No window, no clock of its own.
#pragma once

#include <string>
#include <variant>

namespace stylet::debrief {

struct Pause {};  ///< and goes on
struct Seek {
  double by_s = 0;
};
struct SeekStart {};
struct SeekEnd {};
struct ChangeSpeed {
  double factor = 1;
};
using PlaybackCommand = std::variant<Pause, Seek, SeekStart, SeekEnd, ChangeSpeed>;

class Playback {
public:
  static constexpr double kSlowest = 1.0 / 16;
  static constexpr double kFastest = 16;

  /// @param speed  session time over real time
  Playback(double from_s, double to_s, double speed);

  /// Time and speed stay within their limits.
  void apply(const PlaybackCommand& command);
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
