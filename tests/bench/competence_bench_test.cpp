// What `stylet bench competence` promises: every target is met, and simulated trainees are among them.
#include "tests/support/postgres_database.h"
#include "tools/bench/competence.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace stylet::bench {
namespace {

TEST(CompetenceBench, MeetsItsTargets) {
  const Report report = bench_competence({.quick = true});
  for (const Measurement& m : report.measurements) {  // but for milliseconds, which are the machine's
    EXPECT_TRUE(m.unit == "ms" || m.met != false) << m.name << ' ' << m.value << ", wanted " << m.target;
  }
  const auto count = [&](const std::string& prefix) {
    return std::ranges::count_if(
        report.measurements, [&](const Measurement& m) { return m.name.starts_with(prefix) && m.met.has_value(); });
  };
  EXPECT_EQ(count("run_length."), 30);
  EXPECT_GE(count("published."), 13);
  EXPECT_EQ(count("certified."), 4);
  EXPECT_GE(count("cohort."), 6);
  EXPECT_EQ(count("records."), 6);
  const bool left_out =
      std::ranges::any_of(report.measurements, [](const Measurement& m) { return m.name == "postgres.left_out"; });
  EXPECT_EQ(count("postgres."), left_out ? 0 : 3);
  if (support::test_postgres()) {
    EXPECT_FALSE(left_out);
  }
  EXPECT_EQ(count("outbox."), 3);
}

}  // namespace
}  // namespace stylet::bench
