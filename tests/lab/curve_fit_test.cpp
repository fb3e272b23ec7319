// Least squares against certified values (NIST Statistical Reference Datasets, nonlinear).
#include "engine/lab/statistics/curve_fit.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

namespace stylet::lab::statistics {
namespace {

/// y = b1 (1 - exp(-b2 x))
double rise(double x, const Eigen::VectorXd& p, Eigen::VectorXd& gradient) {
  const double e = std::exp(-p[1] * x);
  gradient[0] = 1 - e;
  gradient[1] = p[0] * x * e;
  return p[0] * gradient[0];
}

struct Certified {
  std::vector<double> x;
  std::vector<double> y;
  std::vector<std::array<double, 2>> starts;
  std::array<double, 2> parameters;
  std::array<double, 2> errors;
  double residual_sd;
};

// From NIST's first start (1, 1) the way down leads to b2 without end; learning curves begin in several places.
const Certified kBoxBod{{1, 2, 3, 5, 7, 10},           {109, 149, 149, 191, 213, 224}, {{100, .75}},
                        {213.80940889, 0.54723748542}, {12.354515176, 0.10455993237},  17.088072423};
const Certified kMisra1a{
    {77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0},
    {10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78},
    {{500, 1e-4}, {250, 5e-4}},
    {238.94212918, 5.5015643181e-4},
    {2.7070075241, 7.2668688436e-6},
    0.10187876330};

TEST(CurveFit, HasTheCertifiedDigits) {
  for (const Certified& set : {kBoxBod, kMisra1a}) {
    for (const auto& start : set.starts) {
      const std::array<CurveParameter, 2> parameters{{{start[0]}, {start[1]}}};
      const CurveFit fit = fit_curve(rise, set.x, set.y, parameters);
      EXPECT_TRUE(fit.converged);
      for (int i = 0; i < 2; ++i) {  // eleven digits are certified
        EXPECT_NEAR(fit.parameters[i] / set.parameters[i], 1, 2e-10);
        EXPECT_NEAR(fit.standard_error(i) / set.errors[i], 1, 2e-9);
      }
      EXPECT_NEAR(fit.residual_sd / set.residual_sd, 1, 2e-10);
    }
  }
}

TEST(CurveFit, StaysWithinItsBoundsAndSaysSo) {
  const std::array<CurveParameter, 2> parameters{{{150, 0, 200}, {0.5, 0, 10}}};
  const CurveFit fit = fit_curve(rise, kBoxBod.x, kBoxBod.y, parameters);
  EXPECT_EQ(fit.parameters[0], 200);
  EXPECT_TRUE(fit.at_bound[0]);
  EXPECT_FALSE(fit.at_bound[1]);
  // What is left is the best along the bound: the residuals are square to the other parameter's column.
  Eigen::VectorXd gradient(2);
  double slope = 0;
  for (std::size_t i = 0; i < kBoxBod.x.size(); ++i) {
    const double residual = kBoxBod.y[i] - rise(kBoxBod.x[i], fit.parameters, gradient);
    slope += residual * gradient[1];
  }
  EXPECT_NEAR(slope, 0, 1e-3);
}

}  // namespace
}  // namespace stylet::lab::statistics
