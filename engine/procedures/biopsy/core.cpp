#include "engine/procedures/biopsy/core.h"

#include "engine/content/voxel.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace stylet::procedures::biopsy {
namespace {

constexpr std::string_view kTargetShare = "target_share";
constexpr std::string_view kEndBeyond = "end_beyond";
constexpr std::string_view kShareOf = "share of ";

/// Version 1: "target 62.00 %: tumour 62.00 %, liver 38.00 %".
double from_version_1(std::string_view text) {
  constexpr std::string_view kBefore = "target ";
  const std::size_t found = text.find(kBefore);
  if (found == std::string_view::npos) return 0;
  double percent = 0;
  const char* begin = text.data() + found + kBefore.size();
  const auto [end, error] = std::from_chars(begin, text.data() + text.size(), percent);
  return error == std::errc{} && std::isfinite(percent) ? percent : 0;
}

}  // namespace

std::vector<bool> target_tissues(const content::Scene& scene) {
  std::vector<bool> tissues(scene.tissues.size(), false);
  for (const content::Target& target : scene.targets) {
    const std::ptrdiff_t voxel = content::voxel_at(scene.labels, target.centre);
    if (voxel >= 0) tissues[scene.labels.labels[static_cast<std::size_t>(voxel)]] = true;
  }
  return tissues;
}

recording::EventRecord to_event(const Core& core, const content::Scene& scene) {
  std::vector<std::size_t> order(core.content.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return core.content[a] > core.content[b]; });
  recording::EventRecord event{.time_s = core.time_s,
                               .step = core.haptic_step,
                               .name = std::string(kCoreEvent),
                               .fields = {{std::string(kTargetShare), core.target_share, "1"}}};
  if (core.target_share > 0) event.fields.push_back({std::string(kEndBeyond), core.end_beyond, "m"});
  for (const std::size_t t : order) {
    if (core.content[t] <= 0) break;
    event.fields.push_back({std::string(kShareOf) + scene.tissues[t].name, core.content[t], "1"});
  }
  return event;
}

std::optional<double> target_percent(const recording::EventRecord& event) {
  if (event.name != kCoreEvent) return std::nullopt;
  if (const auto share = event.number(kTargetShare)) return 100 * *share;
  return from_version_1(event.version_1_text());
}

std::optional<double> end_beyond(const recording::EventRecord& event) {
  return event.name == kCoreEvent ? event.number(kEndBeyond) : std::nullopt;
}

std::string in_words(const recording::EventRecord& core) {
  if (!core.version_1_text().empty()) return std::string(core.version_1_text());
  std::string words = fmt::format("target {:.2f} %", target_percent(core).value_or(0));
  const char* separator = ": ";
  for (const recording::Field& field : core.fields) {
    if (!field.name.starts_with(kShareOf)) continue;
    const auto share = core.number(field.name);
    words += fmt::format("{}{} {:.2f} %", separator, field.name.substr(kShareOf.size()), 100 * share.value_or(0));
    separator = ", ";
  }
  if (const auto beyond = end_beyond(core); beyond && *beyond > 0) {
    words += fmt::format("; the stylet came out {:.1f} mm behind the target", 1e3 * *beyond);
  }
  return words;
}

}  // namespace stylet::procedures::biopsy
