// Where a trainee stands: gates by data, on several days, alarms, tests after pauses.
#include "engine/lab/course/progress.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace stylet::lab::course {
namespace {

using statistics::Outcome;

/// Two exercises, the second behind the first.
Course small_course() {
  Course course{.spacing = {.attempts_a_day = 20, .pause_days = 30}};
  Exercise first{.name = "first", .practice = 2, .days = 2};
  first.gate = {.limit = 2.0, .horizon = 30};
  first.monitoring = Monitoring{.attempts = 50, .false_alarm = 0.2, .limit = 2.5};
  first.retention = {{.after_days = 28, .attempts = 2}};
  Exercise second{.name = "second", .after = {"first"}};
  second.gate = {.limit = 2.0, .horizon = 30};
  course.exercises = {first, second};
  return course;
}

/// "110": pass, pass, fail, on one day.
void take(std::vector<Taken>& taken, std::int64_t day, const std::string& passes) {
  for (const char c : passes) taken.push_back({.day = day, .outcome = c == '1' ? Outcome::pass : Outcome::fail});
}

TEST(Progress, AGateTakesItsSumAndItsDays) {
  const Course course = small_course();
  std::vector<std::vector<Taken>> attempts(2);
  EXPECT_EQ(progress(course, attempts, 100)[0].standing, Standing::practising);
  EXPECT_EQ(progress(course, attempts, 100)[1].standing, Standing::locked);
  take(attempts[0], 100, "00");  // practice: does not count
  EXPECT_EQ(progress(course, attempts, 100)[0].standing, Standing::practising);
  take(attempts[0], 100, "1111111");  // 0.2513 each
  EXPECT_EQ(progress(course, attempts, 100)[0].standing, Standing::graded);
  take(attempts[0], 100, "1");  // 2.01: the sum is there, the second day is not
  auto at = progress(course, attempts, 100)[0];
  EXPECT_EQ(at.standing, Standing::graded);
  EXPECT_NE(progress_words(course.exercises[0], at).find("another day"), std::string::npos);
  take(attempts[0], 101, "1");
  const auto all = progress(course, attempts, 101);
  EXPECT_EQ(all[0].standing, Standing::competent);
  EXPECT_EQ(all[0].passed_gate, 9);
  EXPECT_EQ(all[1].standing, Standing::practising);
  EXPECT_EQ(all[0].retention_day, 129);
}

TEST(Progress, SaysWhyAnExerciseComesNext) {
  const Course course = small_course();
  std::vector<std::vector<Taken>> attempts(2);
  const auto why = [&](std::int64_t today) {
    const auto all = progress(course, attempts, today);
    const auto next = due(all, today);
    return next ? course.exercises[*next].name + ": " + std::string(why_due(all[*next])) : "nothing";
  };
  EXPECT_EQ(why(100), "first: practice");
  take(attempts[0], 100, "00111111");
  EXPECT_EQ(why(100), "first: gate not passed yet");
  take(attempts[0], 101, "1111");
  EXPECT_EQ(why(101), "second: practice");
  EXPECT_EQ(why(129), "first: retention test");
  take(attempts[0], 130, "000");
  EXPECT_EQ(why(130), "first: failures have mounted up");
}

TEST(Progress, FailuresAfterTheGateRaiseAnAlarmThatTheGateEnds) {
  const Course course = small_course();
  std::vector<std::vector<Taken>> attempts(2);
  take(attempts[0], 100, "111111");
  take(attempts[0], 101, "1111");
  ASSERT_EQ(progress(course, attempts, 101)[0].standing, Standing::competent);
  take(attempts[0], 102, "00");
  EXPECT_EQ(progress(course, attempts, 102)[0].standing, Standing::competent);
  take(attempts[0], 102, "0");  // 3 ln 3 = 3.3 >= 2.5
  auto at = progress(course, attempts, 102)[0];
  EXPECT_EQ(at.standing, Standing::alarm);
  EXPECT_FALSE(at.retention_day);
  EXPECT_EQ(due(progress(course, attempts, 102), 102), 0u);
  take(attempts[0], 102, "1");  // one pass does not end it
  EXPECT_EQ(progress(course, attempts, 102)[0].standing, Standing::alarm);
  take(attempts[0], 103, "1111111");
  EXPECT_EQ(progress(course, attempts, 103)[0].standing, Standing::competent);
  EXPECT_EQ(progress(course, attempts, 103)[1].standing, Standing::practising) << "not locked again";
}

TEST(Progress, WhatIsDueIsTheAlarmThenTheTestThenTheFirstOpenExercise) {
  const Course course = small_course();
  std::vector<std::vector<Taken>> attempts(2);
  EXPECT_EQ(due(progress(course, attempts, 100), 100), 0u);
  take(attempts[0], 100, "111111");
  take(attempts[0], 101, "1111");
  EXPECT_EQ(due(progress(course, attempts, 101), 101), 1u);
  EXPECT_EQ(due(progress(course, attempts, 129), 129), 0u) << "the test after 28 days";
  EXPECT_FALSE(progress(course, attempts, 131)[0].after_pause);
  EXPECT_TRUE(progress(course, attempts, 132)[0].after_pause);
  take(attempts[0], 129, "11");
  EXPECT_EQ(due(progress(course, attempts, 129), 129), 1u);
  take(attempts[1], 129, std::string(20, '0'));
  EXPECT_EQ(due(progress(course, attempts, 129), 129), std::nullopt) << "enough for today";
  EXPECT_EQ(due(progress(course, attempts, 130), 130), 1u);
}

}  // namespace
}  // namespace stylet::lab::course
