// One number that stands for the bits of a state: two runs are equal step for step if their chained hashes are.
#pragma once

#include <Eigen/Core>

#include <array>
#include <bit>
#include <cstdint>
#include <span>

namespace stylet::session {

/// Chained 64-bit hash over raw bits, the same on every machine of the same endianness. Each word goes in by a
/// bijection of the state (xor, odd multiplication, xor-shift; constants of the finaliser of SplitMix64), so a change
/// of a single word always changes the result (a span by four chains of such); it is no defence against forgery. +0
/// and -0 differ, and so do two NaNs with different payloads.
/// @realtime no allocation, a few instructions a word
class StateHash {
public:
  void add(std::uint64_t word) { mix(state_, word); }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(std::span<const double> values) {
    add(static_cast<std::uint64_t>(values.size()));
    // Four chains side by side, each waiting for itself alone, then added in their order.
    std::array<std::uint64_t, 4> chains{state_, state_, state_, state_};
    std::size_t i = 0;
    for (; i + chains.size() <= values.size(); i += chains.size()) {
      for (std::size_t c = 0; c < chains.size(); ++c) mix(chains[c], std::bit_cast<std::uint64_t>(values[i + c]));
    }
    if (i > 0) {
      for (const std::uint64_t chain : chains) add(chain);
    }
    for (; i < values.size(); ++i) add(values[i]);
  }
  /// The used part of a dense column-major block: `columns` leading columns.
  void add_columns(const Eigen::Matrix3Xd& matrix, Eigen::Index columns) {
    add(std::span<const double>(matrix.data(), static_cast<std::size_t>(3 * columns)));
  }
  /// Of everything added so far; adding may go on.
  std::uint64_t value() const { return state_; }

private:
  static void mix(std::uint64_t& state, std::uint64_t word) {
    state = (state ^ word) * 0xbf58476d1ce4e5b9ULL;
    state ^= state >> 31;
    state = (state + 0x9e3779b97f4a7c15ULL) * 0x94d049bb133111ebULL;
    state ^= state >> 29;
  }

  std::uint64_t state_ = 0x5374796c65745631ULL;  // "StyletV1"
};

}  // namespace stylet::session
