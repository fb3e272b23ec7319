// Events as tests name them: "stage procedure", "biopsy_fired 1", "refused fire: the tip is not in tissue".
#pragma once

#include "engine/recording/event.h"

#include <fmt/format.h>

#include <string>

namespace stylet::tests {

inline std::string event_words(const recording::EventRecord& event) {
  if (event.name == "refused") return fmt::format("refused {}: {}", event.text("action"), event.text("reason"));
  std::string words = event.name;
  for (const recording::Field& field : event.fields) {
    words += ' ';
    if (const auto* number = std::get_if<double>(&field.value)) {
      words += fmt::format("{:.0f} {}", *number, field.unit);
    } else if (const auto* count = std::get_if<std::int64_t>(&field.value)) {
      words += std::to_string(*count);
    } else {
      words += std::get<std::string>(field.value);
    }
  }
  return words;
}

/// As recordings of version 1 have it: one text.
inline recording::EventRecord version_1_event(double time_s, std::uint64_t step, std::string name, std::string text) {
  recording::EventRecord event{.time_s = time_s, .step = step, .name = std::move(name)};
  if (!text.empty()) event.fields = {{std::string(recording::EventRecord::kVersion1Field), std::move(text)}};
  return event;
}

}  // namespace stylet::tests
