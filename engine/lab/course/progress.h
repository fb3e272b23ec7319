// Where a trainee stands in a course, by the outcomes of attempts; no store, no clock: who asks says what day it is.
#pragma once

#include "engine/lab/course/course.h"
#include "engine/lab/statistics/sequential.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::lab::course {

/// An attempt at one exercise, ended or broken off; those excluded are not among them.
struct Taken {
  std::int64_t day = 0;  ///< since 1970-01-01, local
  statistics::Outcome outcome = statistics::Outcome::fail;
};

enum class Standing : std::uint8_t {
  locked,      ///< a gate before it is not passed
  practising,  ///< no attempt of it counts yet
  graded,      ///< on the way to the gate
  competent,   ///< the gate is passed
  alarm,       ///< passed, then failures mounted up; the gate is to be passed again
};

/// What a graded attempt did to the chart: an LC-CUSUM to the gate, a CUSUM after it, after an alarm the first again.
struct ChartStep {
  bool after_gate = false;
  double sum = 0;
  bool signal = false;  ///< the gate is passed, or the alarm raised, with this attempt
};

struct ExerciseProgress {
  Standing standing = Standing::practising;
  int attempts = 0;                             ///< all
  int graded = 0;                               ///< those that count for the gate
  std::vector<ChartStep> chart{};               ///< of the graded ones
  std::optional<int> passed_gate{};             ///< number of the graded attempt that last passed it, from 1
  std::optional<std::int64_t> retention_day{};  ///< when the next retention test is due
  bool enough_today = false;
  bool after_pause = false;  ///< the last attempt is longer ago than the course's pause
};

/// @param attempts  of each exercise of the course, in order of time
/// A gate is passed with the first graded attempt whose sum is at the limit where the attempts since the chart began
/// lie on the exercise's number of days. The sum goes on beyond the horizon: the error that a gate promises is for
/// the horizon.
std::vector<ExerciseProgress> progress(const Course& course, std::span<const std::vector<Taken>> attempts,
                                       std::int64_t today);

/// Exercise that is due: an alarm, else a retention test, else the first open one that is not enough for today;
/// nothing: come again another day.
std::optional<std::size_t> due(std::span<const ExerciseProgress> progress, std::int64_t today);

/// Why an exercise comes next: "retention test". @param progress  of one that is due()
std::string_view why_due(const ExerciseProgress& progress);

/// "graded, sum 1.26 of 3.52 after 7 attempts", a sentence without its point.
std::string progress_words(const Exercise& exercise, const ExerciseProgress& progress);

}  // namespace stylet::lab::course
