// A core that was cut, as the session records it.
#pragma once

#include "engine/content/scene.h"
#include "engine/recording/event.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::procedures::biopsy {

/// Events (recording::EventRecord).
inline constexpr std::string_view kFiredEvent = "biopsy_fired";  ///< field: number of the core
inline constexpr std::string_view kCoreEvent = "core";           ///< fields: Core

/// A core, and when it was cut.
struct Core {
  double time_s = 0;
  std::uint64_t haptic_step = 0;       ///< whose needle it was
  double target_share = 0;             ///< of the targets' tissues
  std::vector<double> content{};       ///< share by tissue [Scene::tissues]
  std::vector<std::uint8_t> points{};  ///< where along it: core_points()
  double end_beyond = 0;  ///< stylet's tip behind the far side of the target, along the needle, m; negative: in it
};

/// Whether a tissue is one of a target [Scene::tissues].
std::vector<bool> target_tissues(const content::Scene& scene);

/// Shares of a part of the core that are there, largest first.
recording::EventRecord to_event(const Core& core, const content::Scene& scene);
/// Of the targets' tissues, %; none: the event is of another name.
std::optional<double> target_percent(const recording::EventRecord& event);
/// Core::end_beyond; none: the core holds nothing of a target, or its recording does not say.
std::optional<double> end_beyond(const recording::EventRecord& event);
/// "62.0 % target: tumour 62.0 %, liver 38.0 %"
std::string in_words(const recording::EventRecord& core);

}  // namespace stylet::procedures::biopsy
