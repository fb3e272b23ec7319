// A puncture as a session keeps it: written as an event by the haptic thread, read back from the recording.
#pragma once

#include "engine/content/scene.h"
#include "engine/recording/event.h"
#include "engine/recording/recording_writer.h"
#include "physics/messages/messages.h"

#include <optional>
#include <span>
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
  std::optional<double> energy_j{};  ///< released; not in the first recordings
};

/// @realtime no allocation
void add_puncture(recording::RecordingChannel& channel, double time_s, std::uint64_t step,
                  const content::Scene& scene, const physics::Puncture& puncture);

/// Nothing: the event is no puncture, or not written as one.
std::optional<PunctureEvent> puncture_of(const recording::EventRecord& event);
/// Those of a recording, in order.
std::vector<PunctureEvent> punctures(std::span<const recording::EventRecord> events);

}  // namespace stylet::session
