#include "engine/ultrasound/speckle_field.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace stylet::ultrasound {
namespace {

constexpr int kChannels = 8;
/// All channels of a texel, anywhere in an array of floats: one load, which a sanitizer checks once.
using Channels [[gnu::vector_size(kChannels * sizeof(float)), gnu::aligned(alignof(float)), gnu::may_alias]] = float;

/// splitmix64 (Steele, Lea, Flood 2014): one word of random bits for a counter.
std::uint64_t random_word(std::uint64_t counter) {
  std::uint64_t z = counter * 0x9E3779B97F4A7C15ULL;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

/// Fields over a periodic box, channels interleaved.
struct Fields {
  std::array<int, 3> size;  ///< x, y, z
  std::vector<float> values;

  /// White noise, uniform in [-128, 127]; the blur makes it Gaussian (central limit theorem).
  Fields(const std::array<int, 3>& size_, std::uint64_t seed)
      : size(size_), values(static_cast<std::size_t>(size_[0]) * size_[1] * size_[2] * kChannels) {
    for (std::size_t texel = 0; texel * kChannels < values.size(); ++texel) {
      const std::uint64_t word = random_word((seed << 32) + texel + 1);
      for (int c = 0; c < kChannels; ++c) {
        values[texel * kChannels + c] = static_cast<float>(static_cast<std::int8_t>(word >> (8 * c)));
      }
    }
  }

  /// Circular Gaussian blur along all axes, sigma in texels.
  void blur(double sigma) {
    const int radius = static_cast<int>(std::ceil(3 * sigma));
    std::vector<float> kernel(2 * radius + 1);
    for (int i = -radius; i <= radius; ++i)
      kernel[i + radius] = static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma)));
    const std::array<std::size_t, 3> strides{kChannels, std::size_t{kChannels} * size[0],
                                             std::size_t{kChannels} * size[0] * size[1]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int length = size[axis];
      const std::size_t stride = strides[axis];
      const std::size_t u = axis == 0 ? 1 : 0;
      const std::size_t v = axis == 2 ? 1 : 2;
      std::vector<float> line(static_cast<std::size_t>(length + 2 * radius) * kChannels);
      for (int a = 0; a < size[u]; ++a) {
        for (int b = 0; b < size[v]; ++b) {
          float* first = values.data() + a * strides[u] + b * strides[v];
          for (int i = 0; i < length + 2 * radius; ++i) {
            const float* from = first + ((i - radius + length) % length) * stride;
            std::copy_n(from, kChannels, line.data() + static_cast<std::size_t>(i) * kChannels);
          }
          for (int i = 0; i < length; ++i) {
            Channels sum = {};
            for (int k = 0; k <= 2 * radius; ++k) {
              sum += kernel[k] *
                     *reinterpret_cast<const Channels*>(line.data() + (static_cast<std::size_t>(i) + k) * kChannels);
            }
            *reinterpret_cast<Channels*>(first + i * stride) = sum;
          }
        }
      }
    }
  }

  /// Mean 0 and variance 1 in every channel.
  void normalise() {
    const double count = static_cast<double>(values.size()) / kChannels;
    for (int c = 0; c < kChannels; ++c) {
      double sum = 0;
      double squares = 0;
      for (std::size_t i = c; i < values.size(); i += kChannels) {
        sum += values[i];
        squares += double(values[i]) * values[i];
      }
      const double mean = sum / count;
      const double scale = 1 / std::sqrt(squares / count - mean * mean);
      for (std::size_t i = c; i < values.size(); i += kChannels)
        values[i] = static_cast<float>((values[i] - mean) * scale);
    }
  }

  float at(int x, int y, int z, int channel) const {
    const std::size_t row = static_cast<std::size_t>(z % size[2]) * size[1] + y % size[1];
    return values[(row * size[0] + x % size[0]) * kChannels + channel];
  }
};

SpeckleField::Texel quantise(float first, float second) {
  const auto level = [](float value) {
    return static_cast<std::int8_t>(std::lround(std::clamp(value * 127.0F / kSpeckleScale, -127.0F, 127.0F)));
  };
  return {level(first), level(second)};
}

/// Index in bricks of 4 x 4 x 4, two cache lines each, so that neighbours in any direction are near in memory.
std::size_t bricked(int x, int y, int z, int side) {
  const std::size_t bricks = static_cast<std::size_t>(side) / 4;
  const std::size_t brick = (static_cast<std::size_t>(z / 4) * bricks + y / 4) * bricks + x / 4;
  return brick * 64 + static_cast<std::size_t>((z % 4 * 4 + y % 4) * 4 + x % 4);
}

/// Calls fill(x, y, z) for every texel of a box.
template <typename Fill>
void each_texel(int side, int depth, Fill&& fill) {
  for (int z = 0; z < depth; ++z) {
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) fill(x, y, z);
    }
  }
}

}  // namespace

SpeckleField::SpeckleField(std::uint32_t seed) {
  static_assert(kSpeckleTexels == kSpeckleSize * kSpeckleSize * kSpeckleSize);
  static_assert(kSlowTexels == kSlowSize * kSlowSize * kSlowDepth && kSlowTexels == 1U << kTexelBits);
  texels.resize(kMaxLooks * std::size_t{kSpeckleTexels} + kSlowTexels);
  // A kernel of amplitude FWHM a gives white noise an autocorrelation of FWHM a sqrt(2).
  const auto sigma = [](double fwhm, double pitch) { return fwhm / (4 * std::sqrt(std::log(2.0))) / pitch; };
  Fields fine({kSpeckleSize, kSpeckleSize, kSpeckleSize}, 2ULL * seed);
  fine.blur(sigma(kSpeckleFwhm, kSpeckleSpacing));
  fine.normalise();
  each_texel(kSpeckleSize, kSpeckleSize, [&](int x, int y, int z) {
    const std::size_t here = bricked(x, y, z, kSpeckleSize);
    for (int k = 0; k < kMaxLooks; ++k) {
      texels[k * std::size_t{kSpeckleTexels} + here] = quantise(fine.at(x, y, z, 2 * k), fine.at(x, y, z, 2 * k + 1));
    }
  });

  // Slow fields need no fine grid: every fourth texel, trilinear between.
  constexpr int kStep = 4;
  Fields texture({kSlowSize / kStep, kSlowSize / kStep, kSlowDepth / kStep}, 2ULL * seed + 1);
  Fields beads = texture;
  texture.blur(sigma(kTextureFwhm, kStep * double(kSpeckleSpacing)));
  texture.normalise();
  beads.blur(sigma(kBeadFwhm, kStep * double(kSpeckleSpacing)));
  beads.normalise();
  each_texel(kSlowSize, kSlowDepth, [&](int x, int y, int z) {
    const float f[3] = {float(x % kStep) / kStep, float(y % kStep) / kStep, float(z % kStep) / kStep};
    float slow[2] = {0, 0};
    float energy = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const int d[3] = {corner & 1, (corner >> 1) & 1, corner >> 2};
      float w = 1;
      for (int axis = 0; axis < 3; ++axis) w *= d[axis] != 0 ? f[axis] : 1 - f[axis];
      const int p[3] = {x / kStep + d[0], y / kStep + d[1], z / kStep + d[2]};
      slow[0] += w * texture.at(p[0], p[1], p[2], 6);
      slow[1] += w * beads.at(p[0], p[1], p[2], 7);
      energy += w * w;
    }
    // Interpolation averages; part of the variance it takes is given back, so that cell centres are not flat.
    const float restore = 1 / std::sqrt(std::sqrt(energy));
    texels[kMaxLooks * std::size_t{kSpeckleTexels} + bricked(x, y, z, kSlowSize)] =
        quantise(slow[0] * restore, slow[1] * restore);
  });
}

std::size_t SpeckleField::texel(const Eigen::Vector3i& cell) {
  constexpr int kBoxBits = 6;
  static_assert(kSpeckleSize == 1 << kBoxBits);
  constexpr int kInBox = kSpeckleSize - 1;
  const auto box = [&cell](int axis) { return static_cast<std::uint32_t>(cell[axis] >> kBoxBits); };
  // Fibonacci hashing (Knuth), mixed once more: a linear hash would only skew the pattern.
  std::uint32_t shift = (box(0) + (box(1) << kBoxBits) + (box(2) << 2 * kBoxBits)) * 2654435769U;
  shift = ((shift ^ (shift >> 15U)) * 2246822519U) >> 14U;
  const auto shifted = [&](int axis) {
    return (cell[axis] + static_cast<int>(shift >> (kBoxBits * axis) & unsigned{kInBox})) & kInBox;
  };
  return bricked(shifted(0), shifted(1), shifted(2), kSpeckleSize);
}

std::size_t SpeckleField::slow_texel(const Eigen::Vector3i& cell) {
  return bricked(cell.x() & (kSlowSize - 1), cell.y() & (kSlowSize - 1), cell.z() & (kSlowDepth - 1), kSlowSize);
}

std::uint32_t hash(std::uint32_t x) {
  x = x * 747796405U + 2891336453U;
  x = ((x >> ((x >> 28U) + 4U)) ^ x) * 277803737U;
  return (x >> 22U) ^ x;
}

}  // namespace stylet::ultrasound
