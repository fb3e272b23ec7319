// What a procedure came to, in numbers: Johnson et al. 2012's set for virtual liver biopsies, Perk Tutor's for
// needles under ultrasound, and what neither has. content/README.md, "Metrics", has the definitions with their
// sources.
//
//   Johnson et al., Br J Radiol 85 (2012) 555: the metrics that told consultants from trainees.
//   Perk Tutor: Ungi et al., IEEE TBME 59 (2012) 3316; Holden and Keri 2013-2015; its metric scripts are the
//   definitions. Differences are said where they are.
#pragma once

#include "engine/content/metric_table.h"
#include "engine/content/scene.h"
#include "engine/training/trace.h"

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::training {

struct Metric {
  std::string key;              ///< content/metric_table.h
  std::string title;            ///< for people
  std::string unit;             ///< "mm", "s", "deg", "N", "%", ...; empty: a count
  std::optional<double> value;  ///< in the unit; none: nothing there to measure it on (no target, no core fired)
  std::string definition;       ///< one line
  std::string source;
};

/// The samples of the procedure: from its beginning to the debrief, so that nobody is hurried while reading the
/// briefing. All of them where no course was followed.
std::span<const TraceSample> of_procedure(const Trace& trace);

/// Whether the needle is where the trainee wanted it: the procedure begins to do its work.
bool ends_approach(const recording::EventRecord& event);

/// Whether something was sampled or treated; where the exercise has nothing of the kind, whether the needle was in
/// tissue.
bool something_done(const Trace& trace, const content::Scene& scene);

/// The moment that the needle was brought to the target: that of the first event that ends_approach(), else of the
/// tip closest to a target while inserted, else the last one inserted. [samples] if it never was.
std::size_t arrival(const Trace& trace);

/// All metrics of the procedure (of_procedure()) in the order of procedures::metric_table(); those of kinds go by the
/// events.
/// The reference motion is the scenario's: the path of the tip of a needle that does not bend, of both hands, because
/// that is what the hands decided.
std::vector<Metric> measure(const Trace& trace, const content::Scene& scene);

/// The metric of a name in a list that has all of them.
Metric& find_metric(std::span<Metric> metrics, std::string_view key);
const Metric& find_metric(std::span<const Metric> metrics, std::string_view key);

/// A list of objects: key, title, unit, value (null where there is none), definition, source.
nlohmann::ordered_json to_json(std::span<const Metric> metrics);

// ---- the formulas, for motions of any origin
// ------------------------------------------------------------------------

/// Area swept by the needle between tip and entry, m^2: two triangles a step, (tip', entry', tip) and (entry', tip,
/// entry), where the needle is in tissue before and after it.
double swept_area(std::span<const TraceSample> samples);

/// Completed entries of the tip, with a hysteresis of kProbeAhead: in where the tip is so far behind the skin, out
/// again where nothing is so far ahead of it.
int punctures(std::span<const TraceSample> samples);

/// Spells in which a rate is above a threshold: each begins when it has been above for longer than `shortest`, and
/// ends when it has been below for longer than that, so that a falter does not make two of one.
/// @param rates  [times - 1] over the steps
int spells_above(std::span<const double> times, std::span<const double> rates, double threshold, double shortest);

/// sqrt(Int |jerk|^2 dt), m / s^2.5: third differences over four neighbouring points.
double jerk_cost(std::span<const double> times, std::span<const Eigen::Vector3d> points);

}  // namespace stylet::training
