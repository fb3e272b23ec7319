// Sums of sequential tests, against worked examples and published weights.
#include "engine/lab/statistics/sequential.h"
#include "engine/lab/statistics/proportion.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace stylet::lab::statistics {
namespace {

/// "1101": pass, pass, fail, pass.
std::vector<Outcome> outcomes(const std::string& passes) {
  std::vector<Outcome> list;
  for (const char c : passes) list.push_back(c == '1' ? Outcome::pass : Outcome::fail);
  return list;
}

const std::string kPath = "1101110111111101111111111111";

TEST(LearningCusum, FollowsAWorkedPath) {
  const auto weights = learning_weights({.acceptable = 0.10, .unacceptable = 0.30});
  const auto chart = run_chart(weights, outcomes(kPath), 3.52, AfterSignal::go_on);
  const std::array first{.2513, .5026, 0.0, .2513, .5026, .7539, 0.0, .2513};
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_NEAR(chart[i].sum, first[i], 5e-5) << i;
  EXPECT_NEAR(chart[13].sum, 1.7592, 5e-5);
  EXPECT_NEAR(chart[14].sum, .6606, 5e-5);
  EXPECT_NEAR(chart[27].sum, 3.9277, 5e-5);
  EXPECT_EQ(first_signal(chart), 27);
  EXPECT_EQ(first_signal(run_chart(weights, outcomes(kPath), 2.0, AfterSignal::go_on)), 21);
  EXPECT_EQ(first_signal(run_chart(weights, outcomes(kPath), 2.5, AfterSignal::go_on)), 23);
  EXPECT_EQ(first_signal(run_chart(weights, outcomes(kPath), 4.0, AfterSignal::go_on)), std::nullopt);
}

TEST(MonitoringCusum, FollowsAWorkedPathAndBeginsAgainAfterAnAlarm) {
  const auto weights = monitoring_weights({.acceptable = 0.10, .unacceptable = 0.30});
  const auto chart = run_chart(weights, outcomes(kPath), 2.5, AfterSignal::restart);
  const std::array first{0.0, 0.0, 1.0986, .8473, .5960, .3447, 1.4433};
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_NEAR(chart[i].sum, first[i], 5e-5) << i;
  EXPECT_EQ(first_signal(chart), std::nullopt);
  // Two failures are ln 9 = 2.197, three ln 27 = 3.296.
  const auto alarmed = run_chart(weights, outcomes("000001"), 2.5, AfterSignal::restart);
  EXPECT_EQ(first_signal(alarmed), 3);
  EXPECT_NEAR(alarmed[3].sum, std::log(3.0), 1e-12);
  EXPECT_FALSE(alarmed[4].signal);
}

TEST(LearningCusum, ASumThatEqualsTheLimitSignalsHoweverItWasAddedUp) {
  const auto weights = learning_weights({.acceptable = 0.10, .unacceptable = 0.30});
  double limit = 0;
  for (int i = 0; i < 14; ++i) limit += weights.pass;  // another order of rounding than 14 w
  const auto chart = run_chart(weights, outcomes(std::string(14, '1')), 14 * weights.pass, AfterSignal::go_on);
  EXPECT_NEAR(limit, 14 * weights.pass, 1e-12);
  EXPECT_EQ(first_signal(chart), 14);
}

TEST(RiskAdjusted, WeightsAreThoseThatSteinerPublished) {
  // logit p = -3.68 + 0.077 Parsonnet score.
  const auto p = [](double score) { return 1 / (1 + std::exp(3.68 - 0.077 * score)); };
  const Weights low = monitoring_weights_by_risk(p(0), 2);
  const Weights high = monitoring_weights_by_risk(p(50), 2);
  EXPECT_NEAR(low.pass, -0.024, 6e-4);
  EXPECT_NEAR(low.fail, 0.669, 6e-4);
  EXPECT_NEAR(high.pass, -0.433, 6e-4);
  EXPECT_NEAR(high.fail, 0.260, 6e-4);
  const Weights better_low = monitoring_weights_by_risk(p(0), 0.5);
  const Weights better_high = monitoring_weights_by_risk(p(50), 0.5);
  EXPECT_NEAR(better_low.pass, 0.012, 6e-4);
  EXPECT_NEAR(better_low.fail, -0.681, 6e-4);
  EXPECT_NEAR(better_high.pass, 0.316, 6e-4);
  EXPECT_NEAR(better_high.fail, -0.377, 6e-4);
}

TEST(RiskAdjusted, OfOneRiskItIsTheOrdinaryChart) {
  const FailureRates rates{.acceptable = 0.10, .unacceptable = 0.30};
  EXPECT_NEAR(odds_ratio(rates), 27.0 / 7, 1e-12);
  EXPECT_NEAR(with_odds(0.10, odds_ratio(rates)), 0.30, 1e-12);
  const Weights plain = learning_weights(rates);
  const Weights by_risk = learning_weights_by_risk(0.10, odds_ratio(rates));
  EXPECT_NEAR(plain.pass, by_risk.pass, 1e-12);
  EXPECT_NEAR(plain.fail, by_risk.fail, 1e-12);
}

TEST(WaldLines, AreThoseOfTheUsualRates) {
  const struct {
    FailureRates rates;
    double slope;
    double distance;
  } rows[]{
      {{.10, .20}, .1452, 2.710}, {{.20, .40}, .2933, 2.240}, {{.05, .15}, .0919, 1.816}, {{.15, .30}, .2188, 2.476}};
  for (const auto& row : rows) {
    const WaldLines lines = wald_lines(row.rates, 0.1, 0.1);
    EXPECT_NEAR(lines.slope, row.slope, 5e-5);
    EXPECT_NEAR(lines.upper, row.distance, 5e-4);
    EXPECT_NEAR(lines.lower, row.distance, 5e-4);
  }
}

TEST(Sprt, BoundsAreThoseOfTheWantedErrors) {
  EXPECT_NEAR(sprt_bounds(0.05, 0.05).accept, 2.944, 5e-4);
  EXPECT_NEAR(sprt_bounds(0.05, 0.05).reject, -2.944, 5e-4);
  EXPECT_NEAR(sprt_bounds(0.05, 0.20).accept, 2.773, 5e-4);
  EXPECT_NEAR(sprt_bounds(0.05, 0.20).reject, -1.558, 5e-4);
  EXPECT_NEAR(sprt_bounds(0.01, 0.01).accept, 4.595, 5e-4);
}

TEST(SmoothedPassRate, ForgetsByItsWeight) {
  const auto rates = smoothed_pass_rate(outcomes("1001"), 0.2);
  EXPECT_DOUBLE_EQ(rates[0], 1);
  EXPECT_DOUBLE_EQ(rates[1], 0.8);
  EXPECT_DOUBLE_EQ(rates[2], 0.64);
  EXPECT_DOUBLE_EQ(rates[3], 0.2 + 0.8 * 0.64);
}

TEST(Proportion, IntervalsAndRunsAreThePublishedOnes) {
  const auto expect_interval = [](int passes, int n, double low, double high, double tolerance) {
    EXPECT_NEAR(wilson(passes, n).low, low, tolerance) << passes << " of " << n;
    EXPECT_NEAR(wilson(passes, n).high, high, tolerance) << passes << " of " << n;
  };
  expect_interval(9, 10, .596, .982, 5e-4);
  expect_interval(27, 30, .744, .965, 5e-4);
  expect_interval(10, 10, .7225, 1, 5e-5);
  EXPECT_NEAR(failure_bound(10), 0.259, 5e-4);
  EXPECT_NEAR(failure_bound(29), 0.098, 5e-4);
  EXPECT_NEAR(failure_bound(59), 0.0495, 5e-5);
}

TEST(InARow, IsNoGate) {
  const struct {
    int k;
    double pass_rate;
    std::array<double, 3> within;  // 10, 20, 30
  } rows[]{{2, .5, {.859, .983, .998}},
           {3, .5, {.508, .787, .908}},
           {5, .5, {.109, .250, .368}},
           {5, .9, {.886, .993, 1.0}}};
  for (const auto& row : rows) {
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(in_a_row_within(row.k, 10 * (i + 1), row.pass_rate), row.within[i], 5e-4) << row.k << ' ' << i;
    }
  }
  EXPECT_DOUBLE_EQ(in_a_row_within(1, 1, 0.3), 0.3);
  EXPECT_DOUBLE_EQ(in_a_row_within(3, 2, 0.3), 0);
}

}  // namespace
}  // namespace stylet::lab::statistics
