#include "engine/procedures/ablation/outcome.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace stylet::procedures::ablation {
namespace {

constexpr const char* kHeated = "heated";
constexpr const char* kVolume = "volume";
constexpr const char* kTarget = "target_share";
constexpr const char* kMargin = "margin_share";
constexpr const char* kLeastMargin = "least_margin";

/// Version 1 is written as in_words() does: the number behind `name`, else the first one.
std::optional<double> from_version_1(std::string_view text, std::string_view name) {
  const std::size_t found = text.find(name);
  if (found == std::string_view::npos) return std::nullopt;
  text.remove_prefix(found + name.size());
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || !std::isfinite(number)) return std::nullopt;
  return number;
}

}  // namespace

recording::EventRecord to_event(const Outcome& outcome, const Situation& now) {
  return event_at(now, kAblatedEvent,
                  {{kHeated, outcome.heated_s, "s"},
                   {kVolume, outcome.volume, "m^3"},
                   {kTarget, outcome.coverage.tumour, "1"},
                   {kMargin, outcome.coverage.with_margin, "1"},
                   {kLeastMargin, outcome.coverage.least_margin, "m"}});
}

std::optional<double> heated_s(const recording::EventRecord& ablated) {
  if (const auto heated = ablated.number(kHeated)) return heated;
  return from_version_1(ablated.version_1_text(), "");
}

double coverage_percent(const recording::EventRecord& ablated) {
  if (const auto share = ablated.number(kMargin)) return 100 * *share;
  return from_version_1(ablated.version_1_text(), "margin ").value_or(0);
}

std::string in_words(const recording::EventRecord& ablated) {
  if (!ablated.version_1_text().empty()) return std::string(ablated.version_1_text());
  const auto number = [&](const char* field, double scale) { return scale * ablated.number(field).value_or(0); };
  return fmt::format("{:.0f} s, {:.2f} ml; target {:.2f} %, margin {:.2f} %, least margin {:.1f} mm",
                     number(kHeated, 1), number(kVolume, 1e6), number(kTarget, 100), number(kMargin, 100),
                     number(kLeastMargin, 1e3));
}

}  // namespace stylet::procedures::ablation
