// Attempts for tests of the store.
#pragma once

#include "engine/lab/store/lab.h"

#include <fmt/format.h>

#include <string>

namespace stylet::lab::store::test {

inline AttemptStart start_of(const Person& person, const std::string& scenario = "liver_biopsy") {
  return {
      .trainee = person.id,
      .scenario = {.sha256 = std::string(64, scenario.front()), .name = scenario, .title = "A title", .text = "[]"},
      .build = "test",
      .stylus = "mouse",
      .loop_mode = "real time"};
}

inline AttemptEnd end_of(double total, bool passed, int metrics = 31) {
  AttemptEnd end{.total = total, .pass_mark = 70, .passed = passed, .state_hash = "00ff"};
  for (int i = 0; i < metrics; ++i)
    end.metrics.push_back({.metric = fmt::format("metric_{:02}", i), .value = total + i});
  return end;
}

}  // namespace stylet::lab::store::test
