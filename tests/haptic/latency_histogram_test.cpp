#include "haptic/latency_histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace stylet::haptic {
namespace {

TEST(LatencyHistogram, QuantilesMatchTheSortedSamples) {
  std::mt19937_64 random(3);
  std::lognormal_distribution<double> draw(10, 2);  // ns: from 50 ns to 10 ms
  LatencyHistogram histogram;
  std::vector<std::int64_t> samples;
  for (int i = 0; i < 20'000; ++i) {
    samples.push_back(static_cast<std::int64_t>(draw(random)));
    histogram.add(samples.back());
  }
  std::sort(samples.begin(), samples.end());
  for (const double fraction : {0.01, 0.5, 0.9, 0.99, 0.999}) {
    const auto rank = static_cast<std::size_t>(std::ceil(fraction * 20'000)) - 1;
    const double truth = 1e-9 * static_cast<double>(samples[rank]);
    EXPECT_NEAR(histogram.quantile(fraction), truth, truth / 64 + 1e-9) << fraction;
  }
  EXPECT_EQ(histogram.quantile(1.0), 1e-9 * static_cast<double>(samples.back()));
  EXPECT_EQ(histogram.count(), 20'000u);
}

TEST(LatencyHistogram, CoversEveryDuration) {
  for (const std::int64_t ns : {std::int64_t{0}, std::int64_t{1}, std::int64_t{31}, std::int64_t{32},
                                std::int64_t{1} << 40, std::int64_t{0x7fffffffffffffff}}) {
    LatencyHistogram histogram;
    histogram.add(ns);
    histogram.add(ns);
    EXPECT_NEAR(histogram.quantile(0.5), 1e-9 * static_cast<double>(ns), 1e-9 * static_cast<double>(ns) / 64) << ns;
  }
}

TEST(LatencyHistogram, NegativeCountsAsZeroAndEmptyIsZero) {
  LatencyHistogram histogram;
  EXPECT_EQ(histogram.quantile(0.5), 0);
  histogram.add(-5);
  EXPECT_EQ(histogram.quantiles().max_s, 0);
  EXPECT_EQ(histogram.count(), 1u);
}

}  // namespace
}  // namespace stylet::haptic
