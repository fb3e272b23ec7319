// A puncture as a session keeps it: written as an event by the haptic thread, read back from the recording.
#pragma once

#include "engine/content/scene.h"
#include "engine/recording/recording.h"
#include "physics/messages/messages.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::session {

inline constexpr std::string_view kPunctureEvent = "puncture";

/// The needle broke through from one tissue into another.
struct PunctureEvent {
  double time_s = 0;
  std::string from{};  ///< tissues by name
  std::string to{};
  double force_n = 0;                ///< on the tip, along the shaft
  std::optional<double> energy_j{};  ///< released; not in recordings of earlier versions
};

/// Memory for the text of one event, so that the haptic thread takes none.
struct PunctureText {
  char text[recording::kMaxEventText];
};

/// Detail of the event, e.g. "fat > muscle, 0.8000 N (0.00123 J)".
/// @realtime no allocation
std::string_view puncture_detail(const content::Scene& scene, const physics::Puncture& puncture,
                                 PunctureText& memory);

/// The punctures of a recording, in order. Events that are not written as above are left out.
std::vector<PunctureEvent> punctures(const recording::Recording& recording);

}  // namespace stylet::session
