// Bars and agreement, against published tables.
#include "engine/lab/statistics/expert_level.h"
#include "engine/lab/statistics/agreement.h"
#include "engine/lab/statistics/learning_curve.h"
#include "engine/lab/statistics/normal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace stylet::lab::statistics {
namespace {

TEST(Agreement, IsThatOfShroutAndFleiss) {
  Eigen::MatrixXd scores(6, 4);
  scores << 9, 2, 5, 8,  //
      6, 1, 3, 2,        //
      8, 4, 6, 8,        //
      7, 1, 2, 6,        //
      10, 5, 6, 9,       //
      6, 2, 4, 7;
  const Icc icc = intraclass_correlation(scores);
  EXPECT_NEAR(icc.one_way, 0.1657, 5.1e-5);
  EXPECT_NEAR(icc.agreement, 0.2898, 5.1e-5);
  EXPECT_NEAR(icc.consistency, 0.7148, 5.1e-5);
  EXPECT_NEAR(icc.one_way_mean, 0.4428, 5.1e-5);
  EXPECT_NEAR(icc.agreement_mean, 0.6201, 5.1e-5);
  EXPECT_NEAR(icc.consistency_mean, 0.9093, 5.1e-5);
}

TEST(Agreement, OfTheMeanIsTheWeightOfAPersonsOwnMean) {
  // w = between^2 / (between^2 + within^2 / n) is ICC(1,k).
  Eigen::MatrixXd scores(3, 2);
  scores << 1, 3, 5, 7, 12, 8;
  const double within = ((scores.col(0) - scores.col(1)).array().square() / 2).mean();
  const Eigen::VectorXd means = scores.rowwise().mean();
  const double between = (means.array() - means.mean()).square().sum() / 2 - within / 2;
  const double shrunken = shrunken_mean(1, 2, 0, std::sqrt(between), std::sqrt(within));
  EXPECT_NEAR(shrunken, intraclass_correlation(scores).one_way_mean, 1e-12);
}

TEST(ExpertLevel, ContrastingGroupsCutWhereTheirDensitiesCross) {
  const auto groups = contrasting_groups({.mean = 48, .sd = 14}, {.mean = 81, .sd = 9});
  ASSERT_TRUE(groups);
  EXPECT_NEAR(groups->cut, 66.44, 5.1e-3);
  EXPECT_NEAR(groups->false_pass, 1 - normal_cdf((66.44 - 48) / 14), 1e-3);
  EXPECT_NEAR(groups->false_fail, normal_cdf((66.44 - 81) / 9), 1e-3);
  EXPECT_FALSE(contrasting_groups({.mean = 81, .sd = 9}, {.mean = 48, .sd = 14})) << "the lower one is the higher";
  EXPECT_FALSE(contrasting_groups({.mean = 48, .sd = 40}, {.mean = 50, .sd = 1})) << "no cut between the means";
}

TEST(ExpertLevel, FewExpertsGiveAVagueBar) {
  EXPECT_NEAR(lenient_bar_error(5), 0.837, 5.1e-4);
  EXPECT_NEAR(lenient_bar_error(10), 0.568, 5.1e-4);
  EXPECT_NEAR(lenient_bar_error(20), 0.394, 5.1e-4);
}

TEST(ExpertLevel, ToleranceFactorsAreTheTabledOnes) {
  EXPECT_NEAR(tolerance_factor(5), 3.407, 5.1e-4);
  EXPECT_NEAR(tolerance_factor(10), 2.355, 5.1e-4);
  EXPECT_NEAR(tolerance_factor(20), 1.926, 5.1e-4);
  EXPECT_NEAR(tolerance_factor(5, 0.95), 4.203, 8e-4);
  EXPECT_NEAR(tolerance_factor(10, 0.95), 2.911, 5.1e-4);
  EXPECT_NEAR(tolerance_factor(20, 0.95), 2.396, 5.1e-4);
}

TEST(ExpertLevel, OneOddExpertIsLeftOut) {
  const std::vector<double> means{10, 11, 9, 10, 10, 11, 9, 10, 30};
  EXPECT_NEAR(group_level(means).mean, 110.0 / 9, 1e-12);
  const GroupLevel trimmed = trimmed_level(means);
  EXPECT_EQ(trimmed.people, 8);
  EXPECT_NEAR(trimmed.mean, 10, 1e-12);
  EXPECT_NEAR(trimmed.sd, std::sqrt(4.0 / 7), 1e-12);
}

TEST(Normal, QuantileIsTheInverse) {
  EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 1e-14);
  EXPECT_NEAR(normal_quantile(0.5), 0, 1e-15);
  for (const double p : {1e-12, 1e-3, 0.2, 0.7, 0.9999}) EXPECT_NEAR(normal_cdf(normal_quantile(p)) / p, 1, 1e-12);
}

}  // namespace
}  // namespace stylet::lab::statistics
