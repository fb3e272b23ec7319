// Whether groups differ: published areas and exact tests by counting arrangements.
#include "engine/lab/statistics/group_comparison.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace stylet::lab::statistics {
namespace {

TEST(Auc, ErrorsOfSmallStudiesAreThoseOfHanleyAndMcNeil) {
  const struct {
    double auc;
    double error;
    double separation;
  } rows[]{{.91, .080, 1.90}, {.86, .097, 1.53}, {.73, .124, .87}, {.61, .135, .40}};
  for (const auto& row : rows) {
    EXPECT_NEAR(auc_standard_error(row.auc, 7, 15), row.error, 5.1e-4) << row.auc;
    EXPECT_NEAR(separation(row.auc), row.separation, 5.1e-3) << row.auc;
  }
}

TEST(MannWhitney, IsExactInSmallGroups) {
  const std::vector<double> first{1.1, 2.2, 5.5};
  const std::vector<double> second{3.3, 4.4, 6.6, 7.7};
  const MannWhitney test = mann_whitney(first, second);
  EXPECT_EQ(test.u, 2);  // 5.5 over 3.3 and 4.4
  EXPECT_NEAR(test.auc, 2.0 / 12, 1e-12);
  // Every choice of 3 of the 7 ranks as the first group's.
  int as_small = 0;
  int all = 0;
  for (int a = 1; a <= 7; ++a) {
    for (int b = a + 1; b <= 7; ++b) {
      for (int c = b + 1; c <= 7; ++c) {
        ++all;
        as_small += a + b + c - 6 <= 2 ? 1 : 0;
      }
    }
  }
  EXPECT_NEAR(test.p, 2.0 * as_small / all, 1e-12);
  EXPECT_NEAR(mann_whitney(second, first).p, test.p, 1e-12);
  EXPECT_NEAR(mann_whitney(second, first).auc, 1 - test.auc, 1e-12);
}

TEST(MannWhitney, CountsTiesHalfAndApproximates) {
  const std::vector<double> same{1, 2, 2, 3};
  EXPECT_NEAR(mann_whitney(same, same).auc, 0.5, 1e-12);
  EXPECT_NEAR(mann_whitney(same, same).p, 1, 1e-12);
  const std::vector<double> flat{2, 2, 2};
  EXPECT_EQ(mann_whitney(flat, flat).p, 1) << "nothing differs at all";
  // Against drawing the groups' members anew.
  std::vector<double> all{1, 1, 2, 2, 3, 3, 4, 5, 2, 3, 4, 4, 5, 5, 6, 6};
  const MannWhitney test = mann_whitney(std::span(all).first(8), std::span(all).last(8));
  std::mt19937_64 random(3);
  constexpr int kDraws = 20000;
  int as_far = 0;
  for (int k = 0; k < kDraws; ++k) {
    for (std::size_t i = all.size() - 1; i > 0; --i) std::swap(all[i], all[random() % (i + 1)]);
    const double u = mann_whitney(std::span(all).first(8), std::span(all).last(8)).u;
    as_far += std::abs(u - 32) >= std::abs(test.u - 32) - 1e-9 ? 1 : 0;
  }
  EXPECT_NEAR(test.p, as_far / double{kDraws}, 0.01);
}

TEST(Auc, ItsIntervalIsOfPeopleNotOfAttempts) {
  std::vector<PersonValues> experts;
  std::vector<PersonValues> novices;
  for (int i = 0; i < 7; ++i) experts.push_back({10.0 + i, 12.0 + i});
  for (int i = 0; i < 15; ++i) novices.push_back({13.0 + i, 15.0 + i});
  const Interval of_people = auc_interval(novices, experts);
  EXPECT_LT(of_people.low, of_people.high);
  // The same values a hundred times from each person say nothing more of other people.
  for (auto* group : {&experts, &novices}) {
    for (PersonValues& values : *group) {
      const PersonValues once = values;
      for (int k = 0; k < 99; ++k) values.insert(values.end(), once.begin(), once.end());
    }
  }
  const Interval of_many = auc_interval(novices, experts);
  EXPECT_NEAR(of_many.low, of_people.low, 1e-12);
  EXPECT_NEAR(of_many.high, of_people.high, 1e-12);
}

}  // namespace
}  // namespace stylet::lab::statistics
