#include "engine/sound/waveform.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace stylet::sound {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kFadeOut = 0.01;  // s

/// From 0 to 1 without a corner at either end.
double rise(double share) {
  return 0.5 - 0.5 * std::cos(std::numbers::pi * std::clamp(share, 0.0, 1.0));
}

std::size_t samples_of(double seconds) {
  return static_cast<std::size_t>(std::lround(seconds * kRate));
}

/// A mode of something that was struck.
struct Mode {
  double hz = 0;
  double decay_s = 0;
  double amplitude = 0;
};

/// Adds it, struck at `from_s` within `attack_s`. @param bend_hz  by which it begins higher, gone after `bend_s`
void strike(std::vector<float>& out, double from_s, const Mode& mode, double attack_s, double bend_hz = 0,
            double bend_s = 1) {
  for (std::size_t n = samples_of(from_s); n < out.size(); ++n) {
    const double t = static_cast<double>(n) / kRate - from_s;
    const double turns = mode.hz * t + bend_hz * bend_s * (1 - std::exp(-t / bend_s));
    out[n] += static_cast<float>(mode.amplitude * rise(t / attack_s) * std::exp(-t / mode.decay_s) *
                                 std::sin(kTurn * turns));
  }
}

/// Something soft lets go: a low note that falls. Loudspeakers of a laptop have its upper octave alone.
std::vector<float> puncture(double strength) {
  std::vector<float> out(samples_of(0.18));
  const double loud = 0.12 + 0.5 * strength;
  strike(out, 0, {.hz = 115, .decay_s = 0.04, .amplitude = loud}, 0.004, 130, 0.03);
  strike(out, 0, {.hz = 230, .decay_s = 0.02, .amplitude = 0.3 * loud}, 0.004, 260, 0.03);
  return out;
}

/// Something hard that does not ring: a few modes, damped by what lies around it.
std::vector<float> bone(double strength) {
  std::vector<float> out(samples_of(0.12));
  const double loud = 0.1 + 0.35 * strength;
  for (const Mode& mode : {Mode{540, 0.014, loud}, Mode{890, 0.010, 0.7 * loud}, Mode{1430, 0.006, 0.5 * loud}}) {
    strike(out, 0, mode, 0.001);
  }
  return out;
}

/// Steel on steel, twice: the stylet reaches its stop, then the cannula over it.
std::vector<float> shot(double strength) {
  constexpr double kCannula = 0.045;  // s after the stylet
  constexpr double kSnap = 0.0025;    // s
  std::vector<float> out(samples_of(0.15));
  const double loud = 0.3 * strength;
  for (const double at : {0.0, kCannula}) {
    const double pitch = at > 0 ? 0.9 : 1;
    for (const Mode& mode :
         {Mode{2300, 0.008, 0.5 * loud}, Mode{3700, 0.006, 0.6 * loud}, Mode{5600, 0.004, 0.5 * loud}}) {
      strike(out, at, {pitch * mode.hz, mode.decay_s, mode.amplitude}, 0.0003);
    }
    for (std::size_t n = samples_of(at); n < out.size(); ++n) {
      const double t = static_cast<double>(n) / kRate - at;
      out[n] += static_cast<float>(0.5 * loud * rise(t / 0.0003) * std::exp(-t / kSnap)) * white_noise(n);
    }
  }
  return out;
}

/// A minor third down, as monitors beside a bed speak when nothing is urgent.
std::vector<float> warning(double strength) {
  constexpr double kTone = 0.13, kEdge = 0.02;  // s
  std::vector<float> out(samples_of(2 * kTone));
  for (std::size_t n = 0; n < out.size(); ++n) {
    const double t = static_cast<double>(n) / kRate;
    const double hz = t < kTone ? 740 : 622, within = t < kTone ? t : t - kTone;
    out[n] = static_cast<float>(0.13 * strength * rise(within / kEdge) * rise((kTone - within) / kEdge) *
                                std::sin(kTurn * hz * within));
  }
  return out;
}

std::vector<float> raw(Sound sound, double strength) {
  switch (sound) {
    case Sound::puncture:
      return puncture(strength);
    case Sound::bone:
      return bone(strength);
    case Sound::shot:
      return shot(strength);
    case Sound::warning:
      return warning(strength);
    case Sound::breath:
    case Sound::generator:
      break;
  }
  return {};
}

}  // namespace

std::vector<float> waveform(Sound sound, double strength) {
  std::vector<float> out = raw(sound, std::clamp(strength, 0.0, 1.0));
  const std::size_t fade = std::min(samples_of(kFadeOut), out.size());
  for (std::size_t n = 0; n < fade; ++n) {
    out[out.size() - 1 - n] *= static_cast<float>(rise(static_cast<double>(n) / static_cast<double>(fade)));
  }
  return out;
}

// splitmix64
float white_noise(std::uint64_t n) {
  n = (n + 1) * 0x9e3779b97f4a7c15U;
  n = (n ^ (n >> 30)) * 0xbf58476d1ce4e5b9U;
  n = (n ^ (n >> 27)) * 0x94d049bb133111ebU;
  n ^= n >> 31;
  return static_cast<float>(static_cast<std::int32_t>(n >> 32)) * 0x1p-31F;
}

}  // namespace stylet::sound
