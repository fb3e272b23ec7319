// When charts signal: published run lengths, reference tables, and simulated trainees.
#include "engine/lab/statistics/run_length.h"
#include "engine/lab/statistics/cell_chain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace stylet::lab::statistics {
namespace {

// Digits of the tables: half a unit of the last, and a little for their own rounding.
constexpr double kThree = 5.1e-4;
constexpr double kFour = 5.1e-5;

TEST(RunLength, OfLearningChartsIsTheReferenceTable) {
  const struct {
    FailureRates rates;
    double limit;
    int shortest;
    std::array<double, 4> true_discovery;  // within 20, 30, 50, 100
    std::array<double, 4> false_discovery;
    double mean_acceptable;
    double mean_unacceptable;
  } rows[]{
      {{.05, .15}, 2.0, 18, {.437, .712, .921, .998}, {.070, .162, .324, .609}, 28.4, 106.0},
      {{.05, .15}, 3.0, 27, {0, .288, .696, .963}, {0, .018, .071, .199}, 47.2, 361.5},
      {{.10, .20}, 1.25, 11, {.646, .845, .972, 1.000}, {.259, .423, .653, .903}, 20.3, 48.2},
      {{.10, .20}, 2.0, 17, {.217, .478, .801, .981}, {.036, .101, .234, .484}, 36.9, 143.2},
      {{.10, .20}, 3.0, 26, {0, .090, .441, .869}, {0, .005, .036, .128}, 63.8, 525.8},
      {{.10, .30}, 1.5, 6, {.972, .997, 1.000, 1.000}, {.544, .719, .893, .991}, 8.8, 25.0},
      {{.10, .30}, 2.0, 8, {.889, .975, .999, 1.000}, {.269, .414, .623, .875}, 12.8, 51.6},
      {{.10, .30}, 2.5, 10, {.739, .921, .992, 1.000}, {.122, .215, .371, .639}, 16.9, 98.8},
      {{.10, .30}, 3.0, 12, {.598, .846, .977, 1.000}, {.053, .107, .207, .411}, 21.2, 179.9},
      {{.15, .30}, 2.0, 11, {.555, .779, .949, .999}, {.106, .199, .360, .635}, 23.5, 99.8},
      {{.20, .40}, 2.0, 7, {.776, .926, .992, 1.000}, {.204, .326, .516, .788}, 15.5, 67.1},
      {{.20, .40}, 3.0, 11, {.421, .706, .928, .998}, {.032, .071, .148, .314}, 26.4, 244.5},
  };
  constexpr std::array kHorizons{20, 30, 50, 100};
  for (const auto& row : rows) {
    SCOPED_TRACE(testing::Message() << row.rates.acceptable << '/' << row.rates.unacceptable << " h " << row.limit);
    const Weights weights = learning_weights(row.rates);
    EXPECT_EQ(shortest_run(weights, row.limit), row.shortest);
    for (std::size_t i = 0; i < kHorizons.size(); ++i) {
      EXPECT_NEAR(signal_within({weights, row.rates.acceptable}, kHorizons[i], row.limit), row.true_discovery[i],
                  kThree);
      EXPECT_NEAR(signal_within({weights, row.rates.unacceptable}, kHorizons[i], row.limit), row.false_discovery[i],
                  kThree);
    }
    EXPECT_NEAR(mean_run_length({weights, row.rates.acceptable}, row.limit), row.mean_acceptable, .051);
    EXPECT_NEAR(mean_run_length({weights, row.rates.unacceptable}, row.limit), row.mean_unacceptable, .051);
  }
}

TEST(RunLength, LimitsOfGatesAreTheSmallestWithTheWantedError) {
  const struct {
    FailureRates rates;
    std::array<double, 3> limit;  // of 20, 30, 50 attempts
    std::array<double, 3> false_discovery;
    std::array<double, 3> true_discovery;
  } rows[]{
      {{.05, .20}, {2.75, 3.26, 3.92}, {.036, .050, .050}, {.481, .686, .841}},
      {{.10, .25}, {2.55, 2.92, 3.64}, {.045, .046, .049}, {.366, .565, .734}},
      {{.10, .30}, {3.02, 3.52, 4.09}, {.038, .041, .049}, {.562, .716, .906}},
      {{.15, .30}, {2.33, 2.81, 3.42}, {.045, .047, .050}, {.365, .499, .693}},
      {{.20, .40}, {2.76, 3.22, 3.85}, {.048, .047, .049}, {.523, .650, .825}},
      {{.20, .50}, {3.34, 3.84, 4.71}, {.048, .049, .047}, {.803, .910, .977}},
  };
  constexpr std::array kHorizons{20, 30, 50};
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < kHorizons.size(); ++i) {
      SCOPED_TRACE(testing::Message() << row.rates.acceptable << '/' << row.rates.unacceptable << ' '
                                      << kHorizons[i]);
      const Gate gate = learning_gate(row.rates, kHorizons[i], 0.05);
      EXPECT_NEAR(gate.limit, row.limit[i], 1e-9);
      EXPECT_NEAR(gate.false_discovery, row.false_discovery[i], kThree);
      EXPECT_NEAR(gate.true_discovery, row.true_discovery[i], kThree);
      EXPECT_LE(gate.false_discovery, 0.05);
      EXPECT_GT(signal_within({learning_weights(row.rates), row.rates.unacceptable}, kHorizons[i], gate.limit - 0.01),
                0.05);
    }
  }
}

TEST(RunLength, OfMonitoringChartsIsTheReferenceTable) {
  const struct {
    FailureRates rates;
    double limit;
    double mean_acceptable;
    double mean_unacceptable;
    std::array<double, 3> false_alarm;  // within 25, 50, 100
    std::array<double, 3> detected;     // within 10, 20, 30
  } rows[]{
      {{.10, .20}, 2.5, 341.4, 42.06, {.038, .106, .232}, {.056, .263, .449}},
      {{.10, .30}, 1.5, 45.1, 8.24, {.418, .675, .899}, {.742, .947, .989}},
      {{.10, .30}, 2.5, 141.4, 13.68, {.140, .284, .504}, {.484, .811, .933}},
      {{.10, .30}, 3.0, 238.7, 16.53, {.081, .174, .334}, {.378, .728, .886}},
      {{.20, .40}, 2.5, 162.5, 19.12, {.110, .242, .451}, {.280, .661, .843}},
  };
  for (const auto& row : rows) {
    SCOPED_TRACE(testing::Message() << row.rates.acceptable << '/' << row.rates.unacceptable << " h " << row.limit);
    const AttemptLaw good{monitoring_weights(row.rates), row.rates.acceptable};
    const AttemptLaw bad{monitoring_weights(row.rates), row.rates.unacceptable};
    EXPECT_NEAR(mean_run_length(good, row.limit), row.mean_acceptable, .051);
    EXPECT_NEAR(mean_run_length(bad, row.limit), row.mean_unacceptable, .0051);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(signal_within(good, 25 << i, row.limit), row.false_alarm[i], kThree);
      EXPECT_NEAR(signal_within(bad, 10 * (i + 1), row.limit), row.detected[i], kThree);
    }
  }
  const double limit = monitoring_limit({.10, .30}, 50, 0.20);
  EXPECT_LE(signal_within({monitoring_weights({.10, .30}), .10}, 50, limit), 0.20);
  EXPECT_GT(signal_within({monitoring_weights({.10, .30}), .10}, 50, limit - 0.01), 0.20);
}

TEST(RunLength, ALimitOnTheLatticeIsReachedByTheSumThatEqualsIt) {
  const Weights weights = learning_weights({.10, .30});
  EXPECT_NEAR(signal_within({weights, .10}, 14, 14 * weights.pass), std::pow(.9, 14), 1e-12);
  EXPECT_EQ(signal_within({weights, .10}, 13, 14 * weights.pass), 0);
  EXPECT_EQ(shortest_run(weights, 14 * weights.pass), 14);
}

TEST(RunLength, ALearnersEarlyFailuresDelayTheSignalLittle) {
  const Weights weights = learning_weights({.10, .30});
  std::vector<AttemptLaw> attempts;
  for (int t = 1; t <= 60; ++t) attempts.push_back({weights, 0.05 + 0.55 * std::exp(-(t - 1) / 8.0)});
  const struct {
    double limit;
    int median;
    double by_30;
  } rows[]{{2, 20, .914}, {2.5, 24, .799}, {3, 27, .658}, {3.37, 30, .535}};
  for (const auto& row : rows) {
    const auto by = signal_by(attempts, row.limit);
    EXPECT_EQ(std::ranges::lower_bound(by, 0.5) - by.begin() + 1, row.median) << row.limit;
    EXPECT_NEAR(by[29], row.by_30, kThree) << row.limit;
  }
}

TEST(RunLength, OneChartSpansScenariosOfUnequalDifficulty) {
  const double ratio = 27.0 / 7;
  constexpr std::array kRisks{.05, .10, .20};
  std::vector<AttemptLaw> acceptable;
  std::vector<AttemptLaw> unacceptable;
  for (int t = 0; t < 30; ++t) {
    const double p = kRisks[static_cast<std::size_t>(t) % 3];
    acceptable.push_back({learning_weights_by_risk(p, ratio), p});
    unacceptable.push_back({learning_weights_by_risk(p, ratio), with_odds(p, ratio)});
  }
  const struct {
    double limit;
    double true_discovery;
    double false_discovery;
  } rows[]{{2.5, .9284, .2175}, {3.0, .8419, .0913}, {3.5, .7564, .0473}};
  for (const auto& row : rows) {
    EXPECT_NEAR(signal_by(acceptable, row.limit).back(), row.true_discovery, kFour);
    EXPECT_NEAR(signal_by(unacceptable, row.limit).back(), row.false_discovery, kFour);
  }
}

TEST(RunLength, OfBernoulliChartsIsThePublishedOne) {
  // Tests of CRAN's cusum: 0.038 and 0.026 by 10,000 simulated runs.
  EXPECT_NEAR(signal_within({monitoring_weights_by_risk(0.05, 2), 0.05}, 100, 2.96), 0.03724, 5.1e-6);
  EXPECT_NEAR(signal_within({monitoring_weights_by_risk(0.10, 0.5), 0.10}, 100, 2.96), 0.02628, 5.1e-6);
  const AttemptLaw law{monitoring_weights_by_risk(0.10, 2), 0.10};
  EXPECT_NEAR(signal_within(law, 10, 1.41227), 0.0511, kFour);
  EXPECT_NEAR(signal_within(law, 10, 1.41229), 0.0415, kFour);
}

TEST(CellChain, RunLengthsOfNormalChartsAreThePublishedOnes) {
  // Brook and Evans 1972: 117.59, 3.75; Lucas and Crosier 1982, two-sided: 168, 8.38.
  EXPECT_NEAR(normal_cusum_run_length(0.5, 3, 0), 117.596, 0.01);
  EXPECT_NEAR(normal_cusum_run_length(0.5, 3, 1.5), 3.749, 0.001);
  const auto two_sided = [](double shift) {
    return 1 / (1 / normal_cusum_run_length(0.5, 4, shift) + 1 / normal_cusum_run_length(0.5, 4, -shift));
  };
  EXPECT_NEAR(two_sided(0), 167.68, 0.02);
  EXPECT_NEAR(two_sided(1), 8.383, 0.002);
  // Lucas and Saccucci 1990 at shifts 0, 0.5, 1, 2: 500 88.8 17.5 3.63; 500 29.3 12.6 5.99. Crowder 1987.
  const struct {
    double weight;
    double width;
    double shift;
    double length;
  } rows[]{{.5, 3.071, 0, 499.9},  {.5, 3.071, .5, 88.80},  {.5, 3.071, 1, 17.48},  {.5, 3.071, 2, 3.63},
           {.03, 2.437, 0, 499.9}, {.03, 2.437, .5, 29.32}, {.03, 2.437, 1, 12.60}, {.03, 2.437, 2, 5.99},
           {.5, 2, 0, 26.45},      {.5, 2, .5, 11.89},      {.5, 2, 1, 4.91}};
  for (const auto& row : rows) {
    EXPECT_NEAR(normal_ewma_run_length(row.weight, row.width, row.shift) / row.length, 1, 1e-3) << row.length;
  }
}

/// P(failure probability >= a and pass) and P(... and failure) where logit p = -3.6798 + 0.0768 71 s, s of a
/// Beta(1, 3) distribution: integrated down from the riskiest.
class RiskMix {
public:
  RiskMix() {
    for (int i = kSteps - 1; i >= 0; --i) {
      const double s = (i + 0.5) / kSteps;
      const double share = 3 * (1 - s) * (1 - s) / kSteps;
      passes_[static_cast<std::size_t>(i)] = passes_[static_cast<std::size_t>(i) + 1] + share * (1 - risk(s));
      failures_[static_cast<std::size_t>(i)] = failures_[static_cast<std::size_t>(i) + 1] + share * risk(s);
    }
  }
  double passes_above(double a) const { return at(passes_, a); }
  double failures_above(double a) const { return at(failures_, a); }

private:
  static constexpr int kSteps = 20000;
  static double risk(double s) { return 1 / (1 + std::exp(3.6798 - 0.0768 * 71 * s)); }
  static double at(const std::vector<double>& tail, double a) {
    if (a <= risk(0)) return tail.front();
    if (a >= risk(1)) return 0;
    const double place = (std::log(a / (1 - a)) + 3.6798) / (0.0768 * 71) * kSteps;
    const auto i = std::min(static_cast<std::size_t>(place), std::size_t{kSteps - 1});
    return tail[i] + (tail[i + 1] - tail[i]) * (place - static_cast<double>(i));
  }
  std::vector<double> passes_ = std::vector<double>(kSteps + 1, 0);
  std::vector<double> failures_ = passes_;
};

TEST(CellChain, OfMixedRisksIsThePublishedOneToAPercent) {
  // Limit 4.5: doubled odds 4474.7 by a chain of 600 cells, 4485.2 and 4561.9 by integrations; halved odds 5658.9
  // (tests of R's vlad). W = y ln R - ln(1 + (R - 1) p), so W <= w where p is beyond a bound.
  const RiskMix mix;
  const auto doubled = [&](double from, double to) {
    const double w = to - from;
    return mix.passes_above(std::exp(-w) - 1) + mix.failures_above(2 * std::exp(-w) - 1);
  };
  const double worse =
      mean_run_length({.low = 0, .high = 4.5, .barrier = true, .cells = 600, .start = 0, .at_most = doubled});
  EXPECT_NEAR(worse / 4474.7, 1, 0.01);
  const auto halved = [&](double from, double to) {
    const double w = to - from;
    const double all_passes = mix.passes_above(0);
    const double all_failures = mix.failures_above(0);
    return all_passes - mix.passes_above(2 * (1 - std::exp(-w))) + all_failures -
           mix.failures_above(2 - std::exp(-w));
  };
  const double better =
      mean_run_length({.low = 0, .high = 4.5, .barrier = true, .cells = 600, .start = 0, .at_most = halved});
  EXPECT_NEAR(better / 5658.9, 1, 0.01);
}

TEST(RunLength, SimulatedTraineesAgree) {
  // 20,000 trainees: their mean is within three standard errors; the run length's SD is about its mean.
  std::mt19937_64 random(27);
  const auto fails = [&](double p) { return static_cast<double>(random() >> 11) * 0x1p-53 < p; };
  const Weights weights = learning_weights({.10, .30});
  constexpr int kTrainees = 20000;
  int passed = 0;
  double sum = 0;
  for (int i = 0; i < kTrainees; ++i) {
    double chart = 0;
    int t = 0;
    while (chart < 3.52 - 1e-9) {
      chart = std::max(0.0, chart + (fails(.10) ? weights.fail : weights.pass));
      ++t;
    }
    sum += t;
    passed += t <= 30 ? 1 : 0;
  }
  const AttemptLaw law{weights, .10};
  const double mean = mean_run_length(law, 3.52);
  EXPECT_NEAR(sum / kTrainees, mean, 3 * mean / std::sqrt(kTrainees));
  const double share = signal_within(law, 30, 3.52);
  EXPECT_NEAR(passed / double{kTrainees}, share, 3 * std::sqrt(share * (1 - share) / kTrainees));
}

}  // namespace
}  // namespace stylet::lab::statistics
