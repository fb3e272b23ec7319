// What a sound consists of, by a plain Fourier sum.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <span>

namespace stylet::sound {

inline double energy(std::span<const float> samples) {
  double sum = 0;
  for (const float x : samples) sum += static_cast<double>(x) * x;
  return sum;
}

inline float peak(std::span<const float> samples) {
  float most = 0;
  for (const float x : samples) most = std::max(most, std::abs(x));
  return most;
}

/// Mean frequency of its power, Hz, in steps of 20 Hz up to 12 kHz.
inline double centroid(std::span<const float> samples, double rate) {
  double power = 0, moment = 0;
  for (double hz = 20; hz <= 12'000; hz += 20) {
    const std::complex<double> turn = std::polar(1.0, -2 * std::numbers::pi * hz / rate);
    std::complex<double> sum = 0, phase = 1;
    for (const float x : samples) {
      sum += static_cast<double>(x) * phase;
      phase *= turn;
    }
    power += std::norm(sum);
    moment += hz * std::norm(sum);
  }
  return moment / power;
}

}  // namespace stylet::sound
