#include "engine/app/course_standing.h"

#include "engine/lab/statistics/sequential.h"
#include "engine/lab/store/digest.h"

#include <algorithm>
#include <ctime>
#include <map>
#include <string>

namespace stylet::app {

namespace store = lab::store;

namespace {

bool meets(const lab::course::Bar& bar, const std::vector<store::MetricResult>& metrics) {
  const auto found = std::ranges::find(metrics, bar.metric, &store::MetricResult::metric);
  if (found == metrics.end() || !found->value) return false;  // not measured is not met
  return bar.at_most ? *found->value <= *bar.at_most : *found->value >= *bar.at_least;
}

}  // namespace

std::int64_t local_day(std::int64_t now_ms) {
  const std::time_t seconds = now_ms / 1000;
  std::tm local{};
  ::localtime_r(&seconds, &local);
  return (seconds + local.tm_gmtoff) / 86400;
}

std::vector<std::string> scenario_versions(const lab::course::Course& course) {
  std::vector<std::string> versions;
  versions.reserve(course.exercises.size());
  for (const lab::course::Exercise& exercise : course.exercises) {
    versions.push_back(store::sha256_of_file(exercise.scenario));
  }
  return versions;
}

CourseStanding standing_of(const lab::course::Course& course, std::span<const std::string> versions,
                           std::span<const store::AttemptRecord> attempts,
                           const std::map<std::string, std::vector<store::MetricResult>>& metrics,
                           std::int64_t today) {
  std::vector<std::vector<lab::course::Taken>> taken(course.exercises.size());
  CourseStanding standing{.at_earlier_versions = std::vector<int>(course.exercises.size(), 0)};
  standing.counted.resize(course.exercises.size());
  standing.passed.resize(course.exercises.size());
  for (std::size_t e = 0; e < course.exercises.size(); ++e) {
    const lab::course::Exercise& exercise = course.exercises[e];
    const std::string& version = versions[e];
    // A chart is of one scenario, as it is now, and of one device, the one in use: others are never joined to it.
    std::string stylus;
    for (const store::AttemptRecord& attempt : attempts) {
      if (attempt.counts() && attempt.scenario_sha256 == version) stylus = attempt.stylus;
    }
    for (const store::AttemptRecord& attempt : attempts) {
      if (!attempt.counts()) continue;
      if (attempt.scenario_sha256 != version || attempt.stylus != stylus) {
        const bool of_exercise = attempt.scenario_sha256 == version || attempt.scenario == exercise.scenario.stem();
        standing.at_earlier_versions[e] += of_exercise ? 1 : 0;
        continue;
      }
      const auto measured = metrics.find(attempt.id);
      const bool passed = attempt.succeeded() && std::ranges::all_of(exercise.bars, [&](const lab::course::Bar& bar) {
                            return measured != metrics.end() && meets(bar, measured->second);
                          });
      standing.counted[e].push_back(attempt);
      standing.passed[e].push_back(passed);
      taken[e].push_back({.day = attempt.local_day(),
                          .outcome = passed ? lab::statistics::Outcome::pass : lab::statistics::Outcome::fail});
    }
  }
  standing.exercises = lab::course::progress(course, taken, today);
  standing.due = lab::course::due(standing.exercises, today);
  return standing;
}

CourseStanding standing_of(store::Lab& lab, const store::Person& person, const lab::course::Course& course,
                           std::int64_t today) {
  return standing_of(course, scenario_versions(course), lab.attempts(person.id), lab.all_metrics(person.id), today);
}

}  // namespace stylet::app
