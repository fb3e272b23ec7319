// Metrics and score of a session, for its results and for the terminal.
#pragma once

#include "engine/training/metrics.h"
#include "engine/training/score.h"

#include <nlohmann/json.hpp>

#include <optional>
#include <string>
#include <vector>

namespace stylet::training {

struct TrainingReport {
  Trace trace;
  std::vector<Metric> metrics;
  std::optional<Score> score;  ///< not set: the scenario scores nothing
};

/// Measures and scores.
TrainingReport assess(Trace trace, const content::Scene& scene);

/// The object of session.json (engine/session/session_report.h) with "metrics" and, where there is one, "score".
nlohmann::ordered_json with_training(nlohmann::ordered_json session, const TrainingReport& report);

/// Lines for the terminal.
std::string in_words(const TrainingReport& report);

}  // namespace stylet::training
