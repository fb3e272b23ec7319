// Where a trainee of the lab stands in a course.
#pragma once

#include "engine/lab/course/course.h"
#include "engine/lab/course/progress.h"
#include "engine/lab/store/lab.h"

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace stylet::app {

struct CourseStanding {
  std::vector<lab::course::ExerciseProgress> exercises{};  ///< as those of the course
  /// Attempts at a scenario's file as it was before it changed: they are on no chart of today's. As the exercises.
  std::vector<int> at_earlier_versions{};
  std::optional<std::size_t> due{};  ///< exercise; none: another day
  /// The attempts that count, in order of time. As the exercises.
  std::vector<std::vector<lab::store::AttemptRecord>> counted{};
  /// Of those whether they passed, bars and all.
  std::vector<std::vector<bool>> passed{};
};

/// Days since 1970-01-01 here and now.
std::int64_t local_day(std::int64_t now_ms);

/// SHA-256 of the scenarios' files as they are now; as the course's exercises.
/// @throws files::ContentError  one cannot be read
std::vector<std::string> scenario_versions(const lab::course::Course& course);

/// By the attempts that count: broken off or cut off they failed, ended they pass where the scenario passes them and
/// every bar of the exercise is met.
/// @param versions  scenario_versions()
/// @param attempts  of one trainee, in order of time
/// @param metrics  by attempt, at least those that have a bar
CourseStanding standing_of(const lab::course::Course& course, std::span<const std::string> versions,
                           std::span<const lab::store::AttemptRecord> attempts,
                           const std::map<std::string, std::vector<lab::store::MetricResult>>& metrics,
                           std::int64_t today);
/// The same by what the lab has of the trainee. @throws files::ContentError
CourseStanding standing_of(lab::store::Lab& lab, const lab::store::Person& person, const lab::course::Course& course,
                           std::int64_t today);

}  // namespace stylet::app
