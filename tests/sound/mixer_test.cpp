// Sounds together: added up, limited, muted, the same every time.
#include "engine/sound/mixer.h"

#include "tests/sound/spectrum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <numbers>
#include <span>
#include <vector>

namespace stylet::sound {
namespace {

std::vector<float> next(Mixer& mixer, double seconds) {
  std::vector<float> out(static_cast<std::size_t>(std::lround(seconds * kRate)), 9.0F);
  mixer.render(out);
  return out;
}

TEST(Mixer, AddsUpWhatSoundsAtOnce) {
  Mixer mixer;
  EXPECT_EQ(peak(next(mixer, 0.1)), 0);
  mixer.start({.sound = Sound::warning, .strength = 1});
  const std::vector<float> first = next(mixer, 0.1);
  mixer.start({.sound = Sound::bone, .strength = 0.2});
  const std::vector<float> both = next(mixer, 0.4);
  const std::vector<float> tones = waveform(Sound::warning, 1), knock = waveform(Sound::bone, 0.2);
  for (std::size_t n = 0; n < first.size(); ++n) ASSERT_EQ(first[n], tones[n]);
  for (std::size_t n = 0; n < both.size(); ++n) {
    const std::size_t m = n + first.size();
    const float sum = (m < tones.size() ? tones[m] : 0) + (n < knock.size() ? knock[n] : 0);
    ASSERT_NEAR(both[n], sum, 1e-6F) << n;  // rounding of a sum in another order
  }
}

TEST(Mixer, IsNeverOverFullScale) {
  Mixer mixer;
  for (int i = 0; i < 100; ++i) mixer.start({.sound = Sound::puncture, .strength = 1});
  mixer.start({.sound = Sound::breath, .strength = 1});
  EXPECT_LE(peak(next(mixer, 1)), 1);
  float before = -1;
  for (float x = 0; x < 40; x += 0.01F) {  // neither folds over nor breaks
    ASSERT_GE(limited(x), before);
    ASSERT_LE(limited(x), 1);
    ASSERT_EQ(limited(-x), -limited(x));
    if (x <= kLinear) {
      ASSERT_EQ(limited(x), x);
    }
    before = limited(x);
  }
  EXPECT_NEAR((limited(kLinear + 1e-3F) - kLinear) / 1e-3F, 1, 0.01) << "a corner would be heard";
  EXPECT_LE(limited(1e30F), 1);
}

TEST(Mixer, MutedGivesZerosAndHasNoClick) {
  Mixer mixer, open;
  for (Mixer* each : {&mixer, &open}) each->start({.sound = Sound::breath, .strength = 1});
  next(mixer, 0.5);
  const std::vector<float> unmuted = next(open, 1.0);
  mixer.mute(true);
  const std::vector<float> fading = next(mixer, Mixer::kFade);
  for (std::size_t n = 0; n < fading.size(); ++n) {
    EXPECT_LE(std::abs(fading[n]), std::abs(unmuted[n + kRate / 2]) + 1e-7F);
  }
  mixer.start({.sound = Sound::shot});
  EXPECT_EQ(peak(next(mixer, 1.0)), 0);
  mixer.mute(false);
  EXPECT_LT(std::abs(next(mixer, 1.0 / kRate)[0]), 1e-3F);
  EXPECT_GT(peak(next(mixer, 0.5)), 0.01F) << "the breath goes on";
}

TEST(Mixer, IsAFunctionOfItsCuesHoweverItIsAsked) {
  const auto play = [](std::size_t block) {
    Mixer mixer;
    mixer.start({.sound = Sound::breath, .strength = -0.7});
    mixer.start({.sound = Sound::generator, .strength = 1});
    mixer.start({.sound = Sound::shot});
    std::vector<float> out(kRate / 2);
    for (std::size_t at = 0; at < out.size(); at += block) {
      mixer.render(std::span(out).subspan(at, std::min(block, out.size() - at)));
    }
    return out;
  };
  EXPECT_EQ(play(480), play(1));
  EXPECT_EQ(play(480), play(7919));
}

TEST(Mixer, TakesNothingThatIsNoNumber) {
  Mixer mixer;
  for (const Sound sound : {Sound::breath, Sound::generator, Sound::puncture}) mixer.start({0, sound, std::nan("")});
  EXPECT_EQ(peak(next(mixer, 0.2)), 0);
}

/// Energy of every piece of so many seconds.
std::vector<double> envelope(std::span<const float> samples, double piece_s) {
  std::vector<double> out;
  const auto piece = static_cast<std::size_t>(piece_s * kRate);
  for (std::size_t at = 0; at + piece <= samples.size(); at += piece)
    out.push_back(energy(samples.subspan(at, piece)));
  return out;
}

TEST(Breath, HasThePeriodOfThePatientAndIsSilentWhileItIsHeld) {
  constexpr double kPeriod = 4, kStep = 0.02, kHeld = 24, kUntil = 30;
  // sin^4, as the patient breathes; its slope is the flow.
  std::vector<Cue> cues;
  for (double t = 0; t < kHeld; t += kStep) {
    const double a = std::numbers::pi * t / kPeriod;
    const double flow = 4 * std::pow(std::sin(a), 3) * std::cos(a) * std::numbers::pi / kPeriod;
    cues.push_back({t, Sound::breath, flow / 1.2});
  }
  cues.push_back({kHeld, Sound::breath, 0});
  const std::vector<float> out = track(cues, 0, kUntil);
  ASSERT_EQ(out.size(), std::size_t{30 * kRate});
  EXPECT_LT(peak(out), 0.2F) << "quiet beside a puncture";
  EXPECT_EQ(peak(std::span(out).subspan(std::size_t{25 * kRate})), 0) << "held";

  // In and out are two puffs of one breath: the next that is like this one comes a period later.
  const std::vector<double> loud = envelope(std::span(out).first(std::size_t{24 * kRate}), 0.05);
  double mean = 0;
  for (const double x : loud) mean += x / static_cast<double>(loud.size());
  std::size_t best = 0;
  double most = -1;
  for (std::size_t lag = 20; lag < 120; ++lag) {  // 1 to 6 s
    double sum = 0;
    for (std::size_t i = 0; i + lag < loud.size(); ++i) sum += (loud[i] - mean) * (loud[i + lag] - mean);
    sum /= static_cast<double>(loud.size() - lag);
    if (sum > most) {
      most = sum;
      best = lag;
    }
  }
  EXPECT_NEAR(0.05 * static_cast<double>(best), kPeriod, 0.051);

  // Between breaths, at end-expiration, there is nothing; in sounds higher than out.
  const auto at = [&](double from_s, double to_s) {
    return std::span(out).subspan(static_cast<std::size_t>(from_s * kRate),
                                  static_cast<std::size_t>((to_s - from_s) * kRate));
  };
  EXPECT_LT(energy(at(7.9, 8.1)), 1e-3 * energy(at(9.2, 9.4)));
  const double in = centroid(at(9.2, 9.4), kRate), out_again = centroid(at(10.6, 10.8), kRate);
  std::printf("in %.0f Hz, out %.0f Hz, rms %.4f\n", in, out_again, std::sqrt(energy(at(9.2, 9.4)) / (0.2 * kRate)));
  EXPECT_GT(in, 1.3 * out_again);
}

TEST(Generator, SoundsWhileItsElectrodeIsUnderPower) {
  const std::vector<Cue> cues{{1, Sound::generator, 1}, {2, Sound::generator, 0}};
  const std::vector<float> out = track(cues, 0, 3);
  EXPECT_EQ(peak(std::span(out).first(kRate)), 0);
  EXPECT_GT(peak(std::span(out).subspan(kRate * 5 / 4, kRate / 2)), 0.005F);
  EXPECT_LT(peak(out), 0.05F) << "for minutes";
  EXPECT_EQ(peak(std::span(out).last(kRate / 2)), 0);
}

TEST(Track, IsTheSameFromTheMiddleOn) {
  const std::vector<Cue> cues{{0.25, Sound::puncture, 1}, {0.5, Sound::generator, 1}, {1.5, Sound::bone, 0.5}};
  const std::vector<float> part = track(cues, 1, 2);
  ASSERT_EQ(part.size(), std::size_t{kRate});
  const std::vector<float> alone = track(std::vector<Cue>{{1.5, Sound::bone, 0.5}}, 1, 2);
  EXPECT_EQ(peak(std::span(alone).first(kRate / 2)), 0) << "at its time and not before";
  EXPECT_EQ(alone[kRate / 2 + 100], waveform(Sound::bone, 0.5)[100]);
  EXPECT_GT(peak(std::span(part).subspan(kRate / 4, kRate / 4)), 0.005F) << "the generator was on already";
}

}  // namespace
}  // namespace stylet::sound
