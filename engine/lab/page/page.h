// A course as an instructor sees it: HTML files that need nothing else, no network, no scripts.
#pragma once

#include "engine/lab/course/course.h"
#include "engine/lab/course/progress.h"
#include "engine/lab/store/lab.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace stylet::lab::page {

/// One trainee in a course.
struct TraineeView {
  store::Person person{};  ///< the name is shown where there is one: leave it out for pages by pseudonym
  std::vector<course::ExerciseProgress> exercises{};  ///< as those of the course
  std::vector<int> at_earlier_versions{};             ///< attempts that are on no chart; as the exercises
  std::optional<std::size_t> due{};                   ///< exercise
  std::vector<store::AttemptRecord> attempts{};       ///< all, in order of time
  /// Of each exercise those that count, in order: its practice, then the steps of its chart.
  std::vector<std::vector<store::AttemptRecord>> counted{};
  /// Of those whether they passed: the scenario's marks and the exercise's bars.
  std::vector<std::vector<bool>> passed{};
  std::map<std::string, std::vector<store::MetricResult>> metrics{};  ///< by attempt
  std::vector<store::Note> notes{};
  std::vector<store::Consent> consents{};       ///< the last word on each purpose
  std::optional<std::int64_t> kept_until_ms{};  ///< without another attempt; none: no time is set
};

/// Of a page that is served to somebody who is logged in: its forms.
struct PageActions {
  std::string instructor{};
  std::string token{};  ///< of each form
};

struct PageFacts {
  std::string build{};
  std::int64_t made_ms = 0;
  std::optional<PageActions> actions{};  ///< none: a file, read only
};

/// Charts of each exercise (its gate, alarms after it, the metric in focus with a fitted curve or why there is none)
/// and every attempt.
std::string trainee_page(const course::Course& course, const TraineeView& trainee, const PageFacts& facts);
/// Two attempts side by side: results, and every metric of either. @param a, b  indices into TraineeView::attempts
std::string compare_page(const TraineeView& trainee, std::size_t a, std::size_t b, const PageFacts& facts);
/// @param problem  why the last try let nobody in; empty: there was none
std::string login_page(const std::string& problem, const PageFacts& facts);
/// Who stands where, who is due, links to the pages PSEUDONYM.html beside it. Metrics and notes are not asked for.
std::string cohort_page(const course::Course& course, std::span<const TraineeView> trainees, const PageFacts& facts);

}  // namespace stylet::lab::page
