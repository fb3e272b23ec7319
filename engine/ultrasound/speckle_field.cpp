#include "engine/ultrasound/speckle_field.h"

#include "shaders/ultrasound_shared.h"

#include <algorithm>
#include <cmath>

namespace stylet::ultrasound {
namespace {

constexpr int kChannels = 8;
/// All channels of a texel, anywhere in an array of floats: one load, which a sanitizer checks once.
using Texel [[gnu::vector_size(kChannels * sizeof(float)), gnu::aligned(alignof(float)), gnu::may_alias]] = float;

/// splitmix64 (Steele, Lea, Flood 2014): one word of random bits for a counter.
std::uint64_t random_word(std::uint64_t counter) {
  std::uint64_t z = counter * 0x9E3779B97F4A7C15ULL;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

/// Fields over a periodic cube, channels interleaved.
struct Fields {
  int size;
  std::vector<float> values;

  /// White noise, uniform in [-128, 127]; the blur makes it Gaussian (central limit theorem).
  Fields(int size_, std::uint64_t seed)
      : size(size_), values(static_cast<std::size_t>(size_) * size_ * size_ * kChannels) {
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
    std::vector<float> line(static_cast<std::size_t>(size + 2 * radius) * kChannels);
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t stride = (axis == 0 ? 1 : axis == 1 ? size : size * size) * std::size_t{kChannels};
      const std::size_t across[2] = {(axis == 0 ? size : 1) * std::size_t{kChannels},
                                     (axis == 2 ? size : size * size) * std::size_t{kChannels}};
      for (int a = 0; a < size; ++a) {
        for (int b = 0; b < size; ++b) {
          float* first = values.data() + a * across[0] + b * across[1];
          for (int i = 0; i < size + 2 * radius; ++i) {
            const float* from = first + ((i - radius + size) % size) * stride;
            std::copy_n(from, kChannels, line.data() + static_cast<std::size_t>(i) * kChannels);
          }
          for (int i = 0; i < size; ++i) {
            Texel sum = {};
            for (int k = 0; k <= 2 * radius; ++k) {
              sum += kernel[k] *
                     *reinterpret_cast<const Texel*>(line.data() + (static_cast<std::size_t>(i) + k) * kChannels);
            }
            *reinterpret_cast<Texel*>(first + i * stride) = sum;
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
    const auto wrap = [this](int i) { return static_cast<std::size_t>(i % size); };
    return values[((wrap(z) * size + wrap(y)) * size + wrap(x)) * kChannels + channel];
  }
};

std::int8_t quantise(float value) {
  return static_cast<std::int8_t>(std::lround(std::clamp(value * 127.0F / kSpeckleScale, -127.0F, 127.0F)));
}

}  // namespace

SpeckleField::SpeckleField(std::uint32_t seed) {
  // A kernel of amplitude FWHM a gives white noise an autocorrelation of FWHM a sqrt(2).
  const double sigma_of_fwhm = 1 / (2 * std::sqrt(2 * std::log(2.0)));
  Fields fine(kSpeckleSize, 2ULL * seed);
  fine.blur(sigma_of_fwhm * double(kSpeckleFwhm) / std::sqrt(2.0) / double(kSpeckleSpacing));
  fine.normalise();
  // Slow fields need no fine grid: every fourth texel, trilinear between.
  constexpr int kStep = 4;
  Fields texture(kSpeckleSize / kStep, 2ULL * seed + 1);
  Fields beads = texture;
  texture.blur(0.98);
  texture.normalise();
  beads.blur(0.71);
  beads.normalise();

  texels.resize(static_cast<std::size_t>(kSpeckleSize) * kSpeckleSize * kSpeckleSize);
  for (int z = 0; z < kSpeckleSize; ++z) {
    for (int y = 0; y < kSpeckleSize; ++y) {
      for (int x = 0; x < kSpeckleSize; ++x) {
        std::array<std::int8_t, 8>& texel = texels[index(x, y, z)];
        for (int c = 0; c < 6; ++c) texel[c] = quantise(fine.at(x, y, z, c));
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
        texel[6] = quantise(slow[0] * restore);
        texel[7] = quantise(slow[1] * restore);
      }
    }
  }
}

std::size_t SpeckleField::index(int x, int y, int z) {
  constexpr int kBricks = kSpeckleSize / 2;
  const std::size_t brick = (static_cast<std::size_t>(z >> 1) * kBricks + (y >> 1)) * kBricks + (x >> 1);
  return (brick << 3) + static_cast<std::size_t>(((z & 1) << 2) + ((y & 1) << 1) + (x & 1));
}

}  // namespace stylet::ultrasound
