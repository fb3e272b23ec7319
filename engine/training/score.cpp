#include "engine/training/score.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace stylet::training {
namespace {

/// 1 at full, 0 at zero, linear between; a step where they are the same.
double share_of(const content::Criterion& criterion, double value) {
  if (criterion.full == criterion.zero) return value == criterion.full ? 1 : 0;
  return std::clamp((value - criterion.zero) / (criterion.full - criterion.zero), 0.0, 1.0);
}

std::string text(const std::optional<double>& value, const std::string& unit) {
  if (!value) return "not measured";
  if (unit.empty()) return fmt::format("{:.0f}", *value);
  return fmt::format("{:.1f} {}", *value, unit);
}

}  // namespace

std::optional<Score> score(std::span<const Metric> metrics, const content::Scene& scene, bool done) {
  if (scene.scoring.empty()) return std::nullopt;
  double weights = 0;
  for (const content::Criterion& criterion : scene.scoring) weights += criterion.weight;
  Score score;
  score.pass_mark = scene.pass_mark;
  score.done = done;
  for (const content::Criterion& criterion : scene.scoring) {
    const Metric& metric = find_metric(metrics, criterion.metric);
    ScoreLine& line = score.lines.emplace_back();
    line.criterion = criterion;
    line.value = metric.value;
    line.unit = metric.unit;
    line.title = metric.title;
    line.share = done && metric.value ? share_of(criterion, *metric.value) : 0;
    line.most = weights > 0 ? 100 * criterion.weight / weights : 0;
    line.points = line.share * line.most;
    line.failed = done && criterion.critical && line.share == 0;
    score.total += line.points;
    score.failed_critical |= line.failed;
  }
  score.passed = done && score.total >= score.pass_mark && !score.failed_critical;
  return score;
}

nlohmann::ordered_json to_json(const Score& score) {
  nlohmann::ordered_json json;
  json["total"] = score.total;
  json["pass_mark"] = score.pass_mark;
  json["done"] = score.done;
  json["passed"] = score.passed;
  json["failed_critical"] = score.failed_critical;
  json["criteria"] = nlohmann::ordered_json::array();
  for (const ScoreLine& line : score.lines) {
    nlohmann::ordered_json& entry = json["criteria"].emplace_back();
    entry["metric"] = line.criterion.metric;
    entry["value"] = line.value ? nlohmann::ordered_json(*line.value) : nlohmann::ordered_json();
    entry["unit"] = line.unit;
    entry["full"] = line.criterion.full;
    entry["zero"] = line.criterion.zero;
    entry["points"] = line.points;
    entry["most"] = line.most;
    entry["critical"] = line.criterion.critical;
    entry["failed"] = line.failed;
  }
  return json;
}

std::string summary(std::span<const Metric> metrics, const std::optional<Score>& score) {
  std::string out;
  if (!score) {
    for (const Metric& metric : metrics) {
      if (metric.value) out += fmt::format("  {:<40} {:>14}\n", metric.title, text(metric.value, metric.unit));
    }
    return out;
  }
  for (const ScoreLine& line : score->lines) {
    out += fmt::format("  {:<40} {:>14}  {:>5.1f} of {:.1f}{}\n", line.title, text(line.value, line.unit),
                       line.points, line.most, line.failed ? "  CRITICAL" : "");
  }
  const char* verdict = !score->done             ? "nothing was sampled or treated"
                        : score->passed          ? "passed"
                        : score->failed_critical ? "failed: critical"
                                                 : "failed";
  out += fmt::format("  {:<40} {:>14}  {:>5.1f} of 100, {} (pass mark {:.0f})\n", "score", "", score->total, verdict,
                     score->pass_mark);
  return out;
}

}  // namespace stylet::training
