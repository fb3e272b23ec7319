// Where a trainee of the lab stands in a course.
#pragma once

#include "engine/lab/course/course.h"
#include "engine/lab/course/progress.h"
#include "engine/lab/store/lab.h"

#include <cstdint>
#include <optional>
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

/// By the attempts that count: broken off or cut off they failed, ended they pass where the scenario passes them and
/// every bar of the exercise is met.
/// @throws files::ContentError  a scenario of the course cannot be read
CourseStanding standing_of(lab::store::Lab& lab, const lab::store::Person& person, const lab::course::Course& course,
                           std::int64_t today);

}  // namespace stylet::app
