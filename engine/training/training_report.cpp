#include "engine/training/training_report.h"

#include <fmt/format.h>

#include <utility>

namespace stylet::training {

TrainingReport assess(Trace trace, const content::Scene& scene) {
  TrainingReport report;
  report.trace = std::move(trace);
  report.metrics = measure(report.trace, scene);
  report.score = score(report.metrics, scene, something_done(report.trace, scene));
  return report;
}

nlohmann::ordered_json with_training(nlohmann::ordered_json session, const TrainingReport& report) {
  session["metrics"] = to_json(report.metrics);
  if (report.score) session["score"] = to_json(*report.score);
  if (report.trace.dropped > 0) session["samples_not_measured"] = report.trace.dropped;
  return session;
}

std::string in_words(const TrainingReport& report) {
  std::string text = summary(report.metrics, report.score);
  if (report.trace.dropped > 0 && !report.trace.samples.empty()) {
    text += fmt::format("  measured are the first {:.0f} minutes\n", report.trace.samples.back().time_s / 60);
  }
  return text;
}

}  // namespace stylet::training
