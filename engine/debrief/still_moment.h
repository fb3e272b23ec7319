// The moment of a session that its stills show: what was done there is what one keeps a picture of.
#pragma once

#include "engine/debrief/frame_history.h"
#include "engine/recording/recording.h"

#include <limits>
#include <span>
#include <string_view>

namespace stylet::debrief {

struct StillMoment {
  double time_s = 0;         ///< of the session
  std::string_view words{};  ///< follow "the 3-D view": "at the end of the heating"
};

/// Within a span of the session: the end of the last heating, with the zone grown and the electrode in it; else the
/// last core fired; else the tip closest to the first target (without a target: the end).
/// @param events  of the recording
StillMoment still_moment(std::span<const recording::EventRecord> events, const FrameHistory& frames,
                         double from_s = 0, double to_s = std::numeric_limits<double>::infinity());

/// StillMoment::words of the whole session, for who has no frames of it.
std::string_view still_words(std::span<const recording::EventRecord> events);

}  // namespace stylet::debrief
