// A course: exercises in order, each with a gate that its trainees pass by data, and what follows the gate
// (content/README.md, "Course").
#pragma once

#include "engine/lab/statistics/run_length.h"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::lab::course {

/// What a graded attempt must reach in a metric besides the scenario's own pass mark.
struct Bar {
  std::string metric{};
  std::optional<double> at_most{};  ///< in the metric's unit; one of the two is there
  std::optional<double> at_least{};
  std::string method{};  ///< how it was found: "expert_mean"
  int people = 0;        ///< it was found from
};

/// Alarms after the gate: a CUSUM.
struct Monitoring {
  int attempts = 0;  ///< horizon of the false alarm's probability
  double false_alarm = 0;
  double limit = 0;  ///< exact, from the two
};

/// A test of what is left after a pause.
struct RetentionTest {
  int after_days = 0;  ///< since the gate was passed
  int attempts = 0;
};

struct Exercise {
  std::string name{};
  std::filesystem::path scenario{};
  std::vector<std::string> after{};  ///< names of earlier exercises whose gates come first
  std::string focus{};               ///< metric to look at first; empty: none
  int practice = 0;                  ///< attempts before the first that counts
  statistics::FailureRates rates{};
  statistics::Gate gate{};
  int days = 1;  ///< that the attempts of a gate lie on, at least
  std::optional<Monitoring> monitoring{};
  std::vector<RetentionTest> retention{};
  std::vector<Bar> bars{};
};

/// When it is time to stop for today, or to be careful after a pause.
struct Spacing {
  int attempts_a_day = 0;  ///< of an exercise, at most; 0: as many as wanted
  int pause_days = 30;     ///< a longer one is marked
};

struct Course {
  std::filesystem::path file{};
  std::string name{};
  std::string title{};
  Spacing spacing{};
  std::vector<Exercise> exercises{};
};

/// "gate within 30 attempts: limit 3.52, at least 15 of them; ..." one line.
std::string gate_words(const Exercise& exercise);

/// A course as a user names it: a file, or the name of one in content/courses.
/// @throws files::ContentError  there is none, with those there are
std::filesystem::path find_course(const std::string& path_or_name);

}  // namespace stylet::lab::course
