// Random numbers that are the same on every machine, in streams that know nothing of each other.
#pragma once

#include <cstdint>

namespace stylet::session {

/// SplitMix64 (Steele, Lea, Flood, OOPSLA 2014). A stream is told apart by a seed, an index and a part.
class RandomStream {
public:
  RandomStream(std::uint64_t seed, std::uint64_t index, std::uint64_t part) : state_(seed) {
    state_ = next() ^ (index * 0xD1B54A32D192ED03ULL);
    state_ = next() ^ (part * 0x8CB92BA72F3D8DD7ULL);
  }
  std::uint64_t next() {
    state_ += 0x9E3779B97F4A7C15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31);
  }
  /// In [low, high).
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(next() >> 11) * 0x1.0p-53);
  }
  /// In (-half, half).
  double within(double half) { return uniform(-half, half); }

private:
  std::uint64_t state_;
};

}  // namespace stylet::session
