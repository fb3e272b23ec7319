#include "engine/training/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>

namespace stylet::training {
namespace {

std::optional<double> number_of(std::string_view text) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || !std::isfinite(number)) return std::nullopt;
  return number;
}

}  // namespace

std::string in_words(const SamplingResult& result) {
  std::string text;
  for (std::size_t i = 0; i < result.cores.size(); ++i) {
    text += fmt::format("core {} at {:.1f} s: {:.0f} % target\n", i + 1, result.cores[i].time_s,
                        100 * result.tumour_shares[i]);
  }
  if (result.heated) {
    text += fmt::format(
        "ablation of {:.0f} s: {:.1f} ml; of the target {:.0f} %, with its margin {:.0f} %; least margin {:.1f} mm\n",
        result.heated_s, result.volume * 1e6, 100 * result.coverage.tumour, 100 * result.coverage.with_margin,
        1e3 * result.coverage.least_margin);
  }
  return text;
}

std::string core_detail(double target, const std::vector<double>& content, const content::Scene& scene) {
  std::vector<std::size_t> order(content.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return content[a] > content[b]; });
  std::string text = fmt::format("target {:.2f} %", 100 * target);
  const char* separator = ": ";
  for (const std::size_t t : order) {
    if (content[t] <= 0) break;
    text += fmt::format("{}{} {:.2f} %", separator, scene.tissues[t].name, 100 * content[t]);
    separator = ", ";
  }
  return text;
}

std::string ablation_detail(const SamplingResult& result) {
  return fmt::format("{:.0f} s, {:.2f} ml; target {:.2f} %, margin {:.2f} %, least margin {:.1f} mm", result.heated_s,
                     result.volume * 1e6, 100 * result.coverage.tumour, 100 * result.coverage.with_margin,
                     result.coverage.least_margin * 1e3);
}

std::optional<double> percent_in(std::string_view detail, std::string_view name) {
  const std::size_t found = detail.find(fmt::format("{} ", name));
  if (found == std::string_view::npos) return std::nullopt;
  return number_of(detail.substr(found + name.size() + 1));
}

std::optional<double> heated_in(std::string_view detail) {
  return number_of(detail);
}

}  // namespace stylet::training
