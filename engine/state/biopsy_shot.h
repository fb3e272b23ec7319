// A spring-loaded biopsy needle as it is fired: how far stylet and cannula stand out of its tip. Pure.
#pragma once

#include "engine/state/frame_state.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace stylet::state {

/// The stylet shoots out with its notch, the cannula follows and cuts off what has fallen into it, both stay out to
/// be seen and are drawn back as the gun is cocked. Slowed some ten times: each really takes 2 to 4 ms, less than a
/// picture. Nothing else of the session knows of it: the needle itself stays where the hand holds it.
struct ShotTimes {
  static constexpr double kShoots = 0.04;         ///< s that each of the two takes
  static constexpr double kCannulaFollows = 0.2;  ///< s after the stylet
  static constexpr double kStaysUntil = 0.6;
  static constexpr double kBackAt = 0.9;  ///< before the gun is cocked anew
};

namespace detail {
/// A spring pushes until the stop: at constant acceleration.
inline double shot(double since_s) {
  const double share = std::clamp(since_s / ShotTimes::kShoots, 0.0, 1.0);
  return share * share;
}
inline double drawn_back(double since_s) {
  const double share =
      std::clamp((since_s - ShotTimes::kStaysUntil) / (ShotTimes::kBackAt - ShotTimes::kStaysUntil), 0.0, 1.0);
  return share * share * (3 - 2 * share);
}
}  // namespace detail

/// Share of the throw that the stylet stands out, so many s after the shot: rises to 1, stays, falls to 0.
inline double stylet_out(double since_s) {
  return detail::shot(since_s) * (1 - detail::drawn_back(since_s));
}
/// The same of the cannula, never farther out than the stylet.
inline double cannula_out(double since_s) {
  return detail::shot(since_s - ShotTimes::kCannulaFollows) * (1 - detail::drawn_back(since_s));
}

/// What stands out of the needle's tip, m.
struct BiopsyShot {
  float stylet = 0;        ///< its point
  float cannula = 0;       ///< its end
  float notch_behind = 0;  ///< the notch's rear end behind the stylet's point: the throw
  float notch = 0;         ///< its length

  bool operator==(const BiopsyShot&) const = default;
};

/// At the time of a frame, of the core that was fired last; none: all is drawn back.
inline std::optional<BiopsyShot> shot_of(const FrameState& frame) {
  if (frame.cores.empty()) return std::nullopt;
  const CoreTrack& core = frame.cores.back();
  const double since_s = frame.time_s - core.fired_s;
  if (!(since_s > 0 && since_s < ShotTimes::kBackAt && core.throw_length > 0)) return std::nullopt;
  return BiopsyShot{.stylet = core.throw_length * static_cast<float>(stylet_out(since_s)),
                    .cannula = core.throw_length * static_cast<float>(cannula_out(since_s)),
                    .notch_behind = core.throw_length,
                    .notch = core.length()};
}

}  // namespace stylet::state
