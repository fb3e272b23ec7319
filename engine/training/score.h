// Points for what the metrics say, as the scenario wants them (content/README.md, "Scoring").
#pragma once

#include "engine/content/scene.h"
#include "engine/training/metrics.h"

#include <nlohmann/json_fwd.hpp>

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace stylet::training {

/// One criterion of the scenario and what came of it.
struct ScoreLine {
  content::Criterion criterion;
  std::optional<double> value;  ///< of its metric, in the metric's unit
  std::string unit;
  std::string title;
  double share = 0;     ///< 1 at `full`, 0 at `zero`, linear between; 0 without a value or a procedure
  double points = 0;    ///< 100 weight share / sum of the weights
  double most = 0;      ///< points at share 1
  bool failed = false;  ///< critical, and no share; of a procedure that was done
};

struct Score {
  std::vector<ScoreLine> lines;  ///< as Scene::scoring
  double total = 0;              ///< of 100
  double pass_mark = 0;
  bool done = false;  ///< something was sampled or treated: there is something to give points for
  bool failed_critical = false;
  bool passed = false;  ///< done, total >= pass_mark, no critical failure
};

/// A criterion with nothing to measure gives nothing, and without a procedure that was done there is nothing to
/// measure: who leaves the needle alone has harmed nobody, and shown nothing.
/// @param done  something_done()
/// @return nothing where the scenario scores nothing
std::optional<Score> score(std::span<const Metric> metrics, const content::Scene& scene, bool done);

/// total, pass_mark, done, passed, failed_critical, lines.
nlohmann::ordered_json to_json(const Score& score);

/// Some lines for the terminal: the scored metrics with their points and the total; without a score the metrics that
/// have a value.
std::string summary(std::span<const Metric> metrics, const std::optional<Score>& score);

}  // namespace stylet::training
