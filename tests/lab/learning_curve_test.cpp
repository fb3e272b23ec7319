// Learning curves: a reference set of 16 attempts, refusals, and simulated people.
#include "engine/lab/statistics/learning_curve.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <span>
#include <utility>
#include <vector>

namespace stylet::lab::statistics {
namespace {

const std::vector<double> kAttempts{186.0, 144.5, 136.8, 127.7, 97.1, 97.4, 81.8, 88.9,
                                    74.2,  77.6,  61.9,  68.7,  70.0, 58.7, 65.6, 59.8};
constexpr MetricRange kTimes{0, 600};

TEST(LearningCurve, ReferenceFitsAreReproduced) {
  const CurveFit fit = fit_shape(CurveShape::exponential, kAttempts, kTimes);
  EXPECT_NEAR(fit.parameters[0], 58.5163, 5.1e-5);
  EXPECT_NEAR(fit.standard_error(0), 4.2770, 5.1e-5);
  EXPECT_NEAR(fit.parameters[1], 122.9065, 5.1e-5);
  EXPECT_NEAR(fit.standard_error(1), 5.6742, 5.1e-5);
  EXPECT_NEAR(fit.parameters[2], 4.1372, 5.1e-5);
  EXPECT_NEAR(fit.standard_error(2), 0.5170, 5.1e-5);
  EXPECT_NEAR(fit.residual_sd, 6.4753, 5.1e-5);
  EXPECT_NEAR(fit.aicc(), 68.090, 5.1e-4);
  const auto reached = attempts_to(fit, 70);
  ASSERT_TRUE(reached);
  EXPECT_NEAR(reached->value, 10.807, 5.1e-4);
  EXPECT_NEAR(reached->standard_error, 0.705, 5.1e-4);
  EXPECT_FALSE(attempts_to(fit, 50)) << "below the plateau";

  const CurveFit hyperbolic = fit_shape(CurveShape::hyperbolic, kAttempts, kTimes);
  EXPECT_NEAR(hyperbolic.parameters[0], 25.61, 5.1e-3);
  EXPECT_NEAR(hyperbolic.standard_error(0), 8.74, 5.1e-3);
  EXPECT_NEAR(hyperbolic.aicc(), 68.200, 5.1e-4);
  EXPECT_NEAR(fit_shape(CurveShape::power, kAttempts, kTimes).aicc(), 71.678, 5.1e-4);
  EXPECT_NEAR(fit_shape(CurveShape::line, kAttempts, kTimes).aicc(), 96.569, 5.1e-4);
  EXPECT_NEAR(fit_shape(CurveShape::constant, kAttempts, kTimes).aicc(), 119.259, 5.1e-4);
  // A plateau beside a power is not identified.
  const CurveFit power = fit_shape(CurveShape::power_above, kAttempts, {-1000, 600});
  EXPECT_NEAR(power.parameters[0], -196, 0.5);
  EXPECT_NEAR(power.standard_error(0), 237, 1);
}

TEST(LearningCurve, IsRefusedWhereTheDataDoNotCarryIt) {
  const auto first = [](std::size_t n) { return std::span(kAttempts).first(n); };
  EXPECT_FALSE(learning_curve(first(6), kTimes).exponential);
  EXPECT_FALSE(learning_curve(first(7), kTimes).exponential);
  EXPECT_FALSE(learning_curve(first(8), kTimes).exponential);
  EXPECT_TRUE(learning_curve(first(10), kTimes).exponential);
  EXPECT_TRUE(learning_curve(kAttempts, kTimes).exponential);
  // With six a = 68 +- 45; of the criteria the line's is lower with six and eight, not with ten.
  const CurveFit six = fit_shape(CurveShape::exponential, first(6), kTimes);
  EXPECT_NEAR(six.parameters[0], 68, 1);
  EXPECT_NEAR(six.standard_error(0), 45, 1);
  const auto aicc = [&](CurveShape shape, std::size_t n) { return fit_shape(shape, first(n), kTimes).aicc(); };
  EXPECT_NEAR(aicc(CurveShape::exponential, 6), 71.5, 0.06);
  EXPECT_NEAR(aicc(CurveShape::line, 6), 44.3, 0.06);
  EXPECT_NEAR(aicc(CurveShape::exponential, 8), 52.2, 0.06);
  EXPECT_NEAR(aicc(CurveShape::line, 8), 50.6, 0.06);
  EXPECT_NEAR(aicc(CurveShape::exponential, 10), 53.0, 0.06);
  EXPECT_NEAR(aicc(CurveShape::line, 10), 60.6, 0.06);
  // A plateau below what the metric can be.
  const LearningCurve bounded = learning_curve(kAttempts, {65, 600});
  EXPECT_FALSE(bounded.exponential);
  EXPECT_FALSE(bounded.refused.empty());
}

/// The normal distribution by the sum of twelve: the same on every machine.
double normal(std::mt19937_64& random) {
  double sum = -6;
  for (int i = 0; i < 12; ++i) sum += static_cast<double>(random() >> 11) * 0x1p-53;
  return sum;
}

TEST(LearningCurve, FindsThePlateauOfSimulatedLearnersAndNoneWhereNothingIsLearnt) {
  std::mt19937_64 random(4);
  constexpr int kPeople = 400;
  int fitted = 0;
  int covered = 0;
  int false_curves = 0;
  for (int i = 0; i < kPeople; ++i) {
    std::vector<double> learner;
    std::vector<double> steady;
    for (int n = 0; n < 30; ++n) {
      learner.push_back(60 + 120 * std::exp(-n / 5.0) + 8 * normal(random));
      steady.push_back(60 + 8 * normal(random));
    }
    const LearningCurve curve = learning_curve(learner, kTimes);
    if (curve.exponential) {
      ++fitted;
      covered += std::abs(curve.exponential->parameters[0] - 60) <= 2 * curve.exponential->standard_error(0) ? 1 : 0;
    }
    false_curves += learning_curve(steady, kTimes).exponential ? 1 : 0;
  }
  EXPECT_EQ(fitted, kPeople);
  EXPECT_NEAR(covered / double{kPeople}, 0.945, 0.035) << "of +-2 standard errors, with 27 degrees of freedom";
  EXPECT_LE(false_curves, kPeople * 3 / 20);
}

TEST(RunningMedian, IgnoresOneOddAttempt) {
  const std::vector<double> values{1, 2, 90, 4, 5, 6, 7};
  EXPECT_EQ(running_median(values), (std::vector<double>{1, 2, 4, 5, 6, 6, 7}));
}

TEST(ShrunkenMean, IsDrawnToTheGroupByTheShareOfItsVariance) {
  // w = between / (between + within / n): 1/2 here.
  EXPECT_DOUBLE_EQ(shrunken_mean(10, 4, 20, 1, 2), 15);
  EXPECT_NEAR(shrunken_mean(10, 1000000, 20, 1, 2), 10, 1e-4);
}

TEST(RetentionLoss, IsInStandardDeviationsOfTheLastFive) {
  const std::vector<double> before{100, 9, 10, 11, 10, 10};
  const std::vector<double> after{12, 14, 99};
  EXPECT_NEAR(*retention_loss(before, after), 3 / std::sqrt(0.5), 1e-12);
  EXPECT_FALSE(retention_loss(before, std::span(after).first(1)));
  EXPECT_FALSE(retention_loss(std::span(before).first(4), after));
}

// Tables of the distribution, two-sided 95 %.
TEST(LearningCurve, FewPointsWidenTheIntervalAsStudentsTable) {
  const std::pair<int, double> table[]{{1, 12.706}, {5, 2.571}, {7, 2.365}, {30, 2.042}, {120, 1.980}};
  for (const auto& [freedom, t] : table) {
    CurveFit fit;
    fit.parameters.setZero(3);
    fit.points = freedom + 3;
    EXPECT_NEAR(fit.standard_errors_of_95(), t, 5e-4) << freedom;
  }
}

}  // namespace
}  // namespace stylet::lab::statistics
