// Each sound by itself: what people tell them apart by.
#include "engine/sound/waveform.h"

#include "tests/sound/spectrum.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <span>
#include <vector>

namespace stylet::sound {
namespace {

constexpr std::array kStruck{Sound::puncture, Sound::bone, Sound::shot, Sound::warning};

TEST(Waveform, BeginsAndEndsAtRestAndIsNeverOverFullScale) {
  for (const Sound sound : kStruck) {
    for (const double strength : {0.0, 0.3, 1.0, 7.0}) {
      const std::vector<float> samples = waveform(sound, strength);
      ASSERT_GT(samples.size(), 1000U);
      EXPECT_LT(samples.size(), std::size_t{kRate / 2}) << "is over before the next one matters";
      EXPECT_EQ(samples.front(), 0);
      EXPECT_EQ(samples.back(), 0);
      EXPECT_LT(peak(samples), 1);
      // No click where it is cut: the last millisecond is 60 dB below the peak.
      EXPECT_LE(peak(std::span(samples).last(kRate / 1000)), 1e-3F * peak(samples));
    }
  }
}

TEST(Waveform, IsLouderTheStrongerItIs) {
  for (const Sound sound : kStruck) {
    double before = -1;
    for (const double strength : {0.0, 0.1, 0.25, 0.5, 0.75, 1.0}) {
      const double now = energy(waveform(sound, strength));
      EXPECT_GT(now, before) << static_cast<int>(sound) << " of " << strength;
      before = now;
    }
    EXPECT_EQ(waveform(sound, 3), waveform(sound, 1));
  }
}

TEST(Waveform, OfSoftTissueIsLowOfBoneHigherOfSteelHighest) {
  const double pop = centroid(waveform(Sound::puncture, 0.7), kRate);
  const double knock = centroid(waveform(Sound::bone, 0.7), kRate);
  const double click = centroid(waveform(Sound::shot, 1), kRate);
  const double tones = centroid(waveform(Sound::warning, 1), kRate);
  std::printf("centroids: puncture %.0f Hz, bone %.0f, shot %.0f, warning %.0f\n", pop, knock, click, tones);
  EXPECT_GT(pop, 100) << "or a small loudspeaker has nothing of it";
  EXPECT_LT(pop, 350);
  EXPECT_GT(knock, 500);
  EXPECT_LT(knock, 1200);
  EXPECT_GT(click, 2000);
  EXPECT_LT(click, 6000);
  EXPECT_NEAR(tones, 681, 40) << "between its two";
}

TEST(Waveform, OfAShotHasTwoStrokes) {
  const std::vector<float> samples = waveform(Sound::shot, 1);
  // Energy of every 5 ms; a stroke is where it rises tenfold.
  constexpr std::size_t kPiece = kRate / 200;
  std::vector<double> strokes_s;
  double before = 0;
  for (std::size_t at = 0; at + kPiece <= samples.size(); at += kPiece) {
    const double now = energy(std::span(samples).subspan(at, kPiece));
    if (now > 10 * before && now > 0.01) strokes_s.push_back(static_cast<double>(at) / kRate);
    before = now;
  }
  ASSERT_EQ(strokes_s.size(), 2U);
  EXPECT_EQ(strokes_s[0], 0);
  EXPECT_GT(strokes_s[1], 0.03) << "or they are heard as one";
  EXPECT_LT(strokes_s[1], 0.08);
}

TEST(Waveform, OfAWarningIsDiscreet) {
  EXPECT_LT(peak(waveform(Sound::warning, 1)), 0.3F * peak(waveform(Sound::puncture, 1)));
}

TEST(Noise, IsWhiteAndTheSameEverywhere) {
  constexpr int kCount = 100'000;
  double sum = 0, square = 0, neighbour = 0;
  for (int n = 0; n < kCount; ++n) {
    const double x = white_noise(n);
    ASSERT_LT(std::abs(x), 1.0 + 1e-9);
    sum += x;
    square += x * x;
    neighbour += x * white_noise(n + 1);
  }
  // Of independent uniform numbers; four standard deviations of the mean of so many.
  const double tolerance = 4 / std::sqrt(kCount);
  EXPECT_NEAR(sum / kCount, 0, tolerance);
  EXPECT_NEAR(square / kCount, 1.0 / 3, tolerance);
  EXPECT_NEAR(neighbour / kCount, 0, tolerance);
  EXPECT_EQ(white_noise(7), white_noise(7));
}

}  // namespace
}  // namespace stylet::sound
