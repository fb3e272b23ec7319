#include "engine/lab/course/progress.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

namespace stylet::lab::course {

namespace {

using statistics::Outcome;

/// Graded attempts of one exercise become its chart.
void chart(const Exercise& exercise, std::span<const Taken> graded, ExerciseProgress& at) {
  const statistics::Weights learning = statistics::learning_weights(exercise.rates);
  const statistics::Weights monitoring = statistics::monitoring_weights(exercise.rates);
  bool after_gate = false;
  double sum = 0;
  int days = 0;  // since the chart began
  std::optional<std::int64_t> day;
  for (std::size_t i = 0; i < graded.size(); ++i) {
    days += graded[i].day != day ? 1 : 0;
    day = graded[i].day;
    sum = std::max(0.0, sum + (after_gate ? monitoring : learning).of(graded[i].outcome));
    ChartStep& step = at.chart.emplace_back(ChartStep{.after_gate = after_gate, .sum = sum});
    if (!after_gate) {
      step.signal = sum >= exercise.gate.limit - statistics::kSumTolerance && days >= exercise.days;
      if (step.signal) at.passed_gate = static_cast<int>(i) + 1;
    } else {
      step.signal = exercise.monitoring && sum >= exercise.monitoring->limit - statistics::kSumTolerance;
    }
    if (!step.signal) continue;
    after_gate = !after_gate;
    sum = 0;
    days = 0;
    day.reset();
  }
  at.standing = after_gate       ? Standing::competent
                : at.passed_gate ? Standing::alarm
                : graded.empty() ? Standing::practising
                                 : Standing::graded;
  if (!after_gate) return;
  const std::int64_t passed_day = graded[static_cast<std::size_t>(*at.passed_gate) - 1].day;
  for (const RetentionTest& test : exercise.retention) {
    const std::int64_t test_day = passed_day + test.after_days;
    if (std::ranges::count_if(graded, [&](const Taken& taken) { return taken.day >= test_day; }) >= test.attempts) {
      continue;
    }
    at.retention_day = test_day;
    break;
  }
}

}  // namespace

std::vector<ExerciseProgress> progress(const Course& course, std::span<const std::vector<Taken>> attempts,
                                       std::int64_t today) {
  std::vector<ExerciseProgress> all;
  for (std::size_t e = 0; e < course.exercises.size(); ++e) {
    const Exercise& exercise = course.exercises[e];
    const std::span<const Taken> taken(attempts[e]);
    ExerciseProgress& at = all.emplace_back();
    at.attempts = static_cast<int>(taken.size());
    const auto practice = std::min(taken.size(), static_cast<std::size_t>(exercise.practice));
    const std::span<const Taken> graded = taken.subspan(practice);
    at.graded = static_cast<int>(graded.size());
    chart(exercise, graded, at);
    const auto of_today = std::ranges::count(taken, today, &Taken::day);
    at.enough_today = course.spacing.attempts_a_day > 0 && of_today >= course.spacing.attempts_a_day;
    at.after_pause = !taken.empty() && today - taken.back().day > course.spacing.pause_days;
    const bool locked = std::ranges::any_of(exercise.after, [&](const std::string& name) {
      const auto found = std::ranges::find(course.exercises, name, &Exercise::name);
      const auto before = static_cast<std::size_t>(found - course.exercises.begin());
      return before >= all.size() || !all[before].passed_gate;  // what is not there nobody has passed
    });
    if (locked && !at.passed_gate) at.standing = Standing::locked;
  }
  return all;
}

std::optional<std::size_t> due(std::span<const ExerciseProgress> progress, std::int64_t today) {
  const auto first = [&](const auto& wanted) -> std::optional<std::size_t> {
    for (std::size_t e = 0; e < progress.size(); ++e) {
      if (!progress[e].enough_today && wanted(progress[e])) return e;
    }
    return std::nullopt;
  };
  if (const auto alarm = first([](const ExerciseProgress& p) { return p.standing == Standing::alarm; })) return alarm;
  if (const auto test =
          first([&](const ExerciseProgress& p) { return p.retention_day && *p.retention_day <= today; })) {
    return test;
  }
  return first(
      [](const ExerciseProgress& p) { return p.standing == Standing::practising || p.standing == Standing::graded; });
}

std::string_view why_due(const ExerciseProgress& progress) {
  switch (progress.standing) {
    case Standing::alarm:
      return "failures have mounted up";
    case Standing::competent:
      return "retention test";
    case Standing::graded:
      return "gate not passed yet";
    default:
      return "practice";
  }
}

std::string progress_words(const Exercise& exercise, const ExerciseProgress& progress) {
  switch (progress.standing) {
    case Standing::locked:
      return "locked until the gates before it are passed";
    case Standing::practising:
      return fmt::format("practice, {} of {} attempts before the first that is graded", progress.attempts,
                         exercise.practice);
    case Standing::graded:
      return fmt::format("graded, sum {:.2f} of {:.2f} after {} attempts{}", progress.chart.back().sum,
                         exercise.gate.limit, progress.graded,
                         progress.chart.back().sum >= exercise.gate.limit ? ", another day is missing" : "");
    case Standing::alarm:
      return fmt::format(
          "alarm: failures have mounted up since the gate was passed; sum {:.2f} of {:.2f} to pass it again",
          progress.chart.back().after_gate ? 0 : progress.chart.back().sum, exercise.gate.limit);
    default:
      return fmt::format("gate passed with graded attempt {}; a person decides", *progress.passed_gate);
  }
}

}  // namespace stylet::lab::course
