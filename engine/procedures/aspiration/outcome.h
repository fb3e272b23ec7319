// What an aspiration came to, as the session records it.
#pragma once

#include "engine/procedures/interface/course.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace stylet::procedures::aspiration {

/// Events (recording::EventRecord).
inline constexpr std::string_view kStartedEvent = "aspiration_started";
inline constexpr std::string_view kStoppedEvent = "aspiration_stopped";
inline constexpr std::string_view kAspiratedEvent = "aspirated";  ///< fields: Outcome

/// Of all that was drawn until then.
struct Outcome {
  double drawn = 0;          ///< fluid of cysts, m^3
  double wrong = 0;          ///< what else came into the syringe: blood, m^3
  double air = 0;            ///< m^3
  double left_share = 1;     ///< of the cysts' volume
  std::int64_t entries = 0;  ///< times that the opening came into a cyst
};

recording::EventRecord to_event(const Outcome& outcome, const Situation& now);
/// None: the event is of another name, or does not say.
std::optional<Outcome> outcome_of(const recording::EventRecord& event);
/// "38.2 ml drawn, 17 % left; 0.0 ml of blood"
std::string in_words(const Outcome& outcome);

}  // namespace stylet::procedures::aspiration
