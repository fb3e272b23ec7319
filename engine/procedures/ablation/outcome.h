// What an ablation came to, as the session records it.
#pragma once

#include "engine/procedures/ablation/ablation.h"
#include "engine/procedures/interface/course.h"

#include <optional>
#include <string>
#include <string_view>

namespace stylet::procedures::ablation {

/// Events (recording::EventRecord).
inline constexpr std::string_view kStartedEvent = "ablation_started";
inline constexpr std::string_view kStoppedEvent = "ablation_stopped";  ///< field: heated, s
inline constexpr std::string_view kAblatedEvent = "ablated";           ///< fields: Outcome

/// Of all that was heated until then.
struct Outcome {
  double heated_s = 0;  ///< by the tissue's clock
  double volume = 0;    ///< destroyed, m^3
  AblationCoverage coverage;
};

recording::EventRecord to_event(const Outcome& outcome, const Situation& now);
/// Seconds heated, of an event kAblatedEvent; none: it does not say.
std::optional<double> heated_s(const recording::EventRecord& ablated);
/// Share of the target and its margin that is destroyed, %, of an event kAblatedEvent.
double coverage_percent(const recording::EventRecord& ablated);
/// "720 s, 7.53 ml; target 100.00 %, margin 95.12 %, least margin 3.2 mm"
std::string in_words(const recording::EventRecord& ablated);

}  // namespace stylet::procedures::ablation
