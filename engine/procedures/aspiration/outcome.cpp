#include "engine/procedures/aspiration/outcome.h"

#include <fmt/format.h>

namespace stylet::procedures::aspiration {
namespace {

constexpr const char* kDrawn = "drawn";
constexpr const char* kWrong = "blood";
constexpr const char* kAir = "air";
constexpr const char* kLeft = "left_share";
constexpr const char* kEntries = "wall_punctures";

}  // namespace

recording::EventRecord to_event(const Outcome& outcome, const Situation& now) {
  return event_at(now, kAspiratedEvent,
                  {{kDrawn, outcome.drawn, "m^3"},
                   {kWrong, outcome.wrong, "m^3"},
                   {kAir, outcome.air, "m^3"},
                   {kLeft, outcome.left_share, "1"},
                   {kEntries, outcome.entries}});
}

std::optional<Outcome> outcome_of(const recording::EventRecord& event) {
  if (event.name != kAspiratedEvent) return std::nullopt;
  const auto drawn = event.number(kDrawn), left = event.number(kLeft);
  if (!drawn || !left) return std::nullopt;
  return Outcome{.drawn = *drawn,
                 .wrong = event.number(kWrong).value_or(0),
                 .air = event.number(kAir).value_or(0),
                 .left_share = *left,
                 .entries = static_cast<std::int64_t>(event.number(kEntries).value_or(0))};
}

std::string in_words(const Outcome& outcome) {
  std::string words = fmt::format("{:.1f} ml drawn, {:.0f} % left", outcome.drawn * 1e6, 100 * outcome.left_share);
  if (outcome.wrong > 0) words += fmt::format("; {:.1f} ml of blood", outcome.wrong * 1e6);
  if (outcome.air > 0) words += fmt::format("; {:.1f} ml of air", outcome.air * 1e6);
  return words;
}

}  // namespace stylet::procedures::aspiration
