// Eight columns of L as a pass reads them: tiles of eight rows, in few bits. Internal to CompactFactor.
#pragma once

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <type_traits>

namespace stylet::physics::panels {

inline constexpr int kPanelColumns = 8;  // and rows of a tile: a register of single precision
/// Numbers of a panel in single precision: the inverse of its diagonal block, scales of its columns.
inline constexpr std::size_t kHead = kPanelColumns * kPanelColumns + kPanelColumns;
inline constexpr std::ptrdiff_t kAhead = 2048;  // bytes between what is read and what is fetched
inline constexpr float kLargestEntry = 32767;   // of a column, over its scale
inline constexpr int kSmallTile = 1024;         // whose largest entry is below is narrow: rho does not show it

using Row = float __attribute__((vector_size(32)));

inline Row load(const float* at) {
  Row row;
  std::memcpy(&row, at, sizeof row);
  return row;
}

inline void store(const Row& row, float* at) {
  std::memcpy(at, &row, sizeof row);
}

/// The nearest integer that has room beside `most`.
inline int nearest(float value, int most) {
  return std::clamp(static_cast<int>(std::lrint(value)), -most - 1, most);
}

// How eight entries of a column lie in memory: integers up to kLargest, which are read as multiples of kUnit, or what
// they are.
template <typename Integer>
struct Integers {
  static constexpr int kBytes = kPanelColumns * sizeof(Integer);
  static constexpr float kLargest = std::numeric_limits<Integer>::max();
  static constexpr float kUnit = 1;
  static constexpr int kNarrowBelow = 0;
  static Row load(const std::uint8_t* at) {
    Integer __attribute__((vector_size(kBytes))) entries;
    std::memcpy(&entries, at, sizeof entries);
    return __builtin_convertvector(entries, Row);
  }
  static void pack(const std::array<float, kPanelColumns>& entries, std::uint8_t* to) {
    for (std::size_t i = 0; i < entries.size(); ++i) {
      const auto entry = static_cast<Integer>(nearest(entries[i], std::numeric_limits<Integer>::max()));
      std::memcpy(to + i * sizeof entry, &entry, sizeof entry);
    }
  }
};
using EightBits = Integers<std::int8_t>;
using SixteenBits = Integers<std::int16_t>;
/// Two in three bytes, the first in the lower bits. They are read at the top of 32 bits; the second has the upper
/// bits of the first behind its own there, which costs nothing: what it is rounded to knows them.
struct TwelveBits {
  static constexpr int kBytes = 12;  // reads kBytesMore behind them
  static constexpr float kLargest = 2047;
  static constexpr float kUnit = 1 << 20;
  static constexpr int kNarrowBelow = kSmallTile;
  static Row load(const std::uint8_t* at) {
    const __m256i pairs = _mm256_broadcastsi128_si256(_mm_loadu_si128(reinterpret_cast<const __m128i*>(at)));
    const __m256i places = _mm256_setr_epi8(-1, -1, 0, 1, -1, -1, 1, 2, -1, -1, 3, 4, -1, -1, 4, 5,  //
                                            -1, -1, 6, 7, -1, -1, 7, 8, -1, -1, 9, 10, -1, -1, 10, 11);
    const __m256i up = _mm256_setr_epi32(4, 0, 4, 0, 4, 0, 4, 0);
    return Row(_mm256_cvtepi32_ps(_mm256_sllv_epi32(_mm256_shuffle_epi8(pairs, places), up)));
  }
  static void pack(const std::array<float, kPanelColumns>& entries, std::uint8_t* to) {
    for (std::size_t i = 0; i < entries.size(); i += 2, to += 3) {
      const auto first = static_cast<unsigned>(nearest(entries[i], 2047));
      const unsigned behind = first >> 8 & 15U;
      const auto second = static_cast<unsigned>(nearest(entries[i + 1] - static_cast<float>(behind) / 16, 2047));
      to[0] = static_cast<std::uint8_t>(first);
      to[1] = static_cast<std::uint8_t>(behind | second << 4);
      to[2] = static_cast<std::uint8_t>(second >> 4);
    }
  }
};
inline constexpr std::size_t kBytesMore = 4;
struct Single {
  static constexpr int kBytes = 32;
  static constexpr float kLargest = 1;
  static constexpr float kUnit = 1;
  static constexpr int kNarrowBelow = 0;
  static Row load(const std::uint8_t* at) {
    Row row;
    std::memcpy(&row, at, sizeof row);
    return row;
  }
  static void pack(const std::array<float, kPanelColumns>& entries, std::uint8_t* to) {
    std::memcpy(to, entries.data(), sizeof entries);
  }
};

/// Of eight rows and a panel's columns.
struct Tile {
  std::uint16_t row = 0;      // first of them, over eight, below the panel's diagonal block
  std::uint16_t largest = 0;  // entry; the largest of a column is kLargestEntry
};

/// Of what is read of a tile, over the scales of the columns.
template <typename Entries>
float unit_of(const Tile& tile) {
  return tile.largest * (1 / (Entries::kLargest * Entries::kUnit));
}

template <typename Entries>
inline constexpr bool kAsTheyAre = std::is_same_v<Entries, Single>;

inline Row times_and_more(const Row& a, const Row& b, const Row& more) {
  return Row(_mm256_fmadd_ps(__m256(a), __m256(b), __m256(more)));
}

/// A tile that will be read soon.
template <int Bytes>
void prefetch(const std::uint8_t* tile) {
  for (int at = 0; at < Bytes; at += 64) __builtin_prefetch(tile + at);
}

/// The inverse of a lower triangle, by columns, zero above the diagonal and where there is no column.
inline void invert_block(const double* l, std::ptrdiff_t stride, int width, float* inverse) {
  std::fill_n(inverse, kPanelColumns * kPanelColumns, 0.0F);
  for (int c = 0; c < width; ++c) {
    std::array<double, kPanelColumns> column{};
    for (int r = c; r < width; ++r) {
      double sum = r == c ? 1 : 0;
      for (int k = c; k < r; ++k) sum -= l[k * stride + r] * column[k];
      column[r] = sum / l[r * stride + r];
      inverse[c * kPanelColumns + r] = static_cast<float>(column[r]);
    }
  }
}

using Block = std::array<std::array<float, kPanelColumns>, kPanelColumns>;  // [column][row] of a tile, over scales

/// The rows of a panel below its diagonal block.
struct Panel {
  const double* at = nullptr;
  std::ptrdiff_t stride = 0;  // between columns
  int width = 0;
  int below = 0;
  std::array<float, kPanelColumns> inverse{};  // of the scales

  /// @param[out] scales  [kPanelColumns] zero where there is no column
  template <typename Entries>
  void find_scales(float* scales) {
    std::fill_n(scales, kPanelColumns, 0.0F);
    for (int j = 0; j < width; ++j) {
      double largest = 0;
      for (int r = 0; r < below; ++r) largest = std::max(largest, std::abs(at[j * stride + r]));
      scales[j] = std::max(static_cast<float>(largest) / kLargestEntry, std::numeric_limits<float>::min());
      if (kAsTheyAre<Entries>) scales[j] = 1;
      inverse[j] = 1 / scales[j];
    }
  }
  /// The tile of eight rows from 8 t on, zero where there are none.
  Block block(int t) const {
    Block entries{};
    const std::ptrdiff_t first = std::ptrdiff_t{kPanelColumns} * t;
    const auto height = std::min<std::ptrdiff_t>(kPanelColumns, below - first);
    for (int j = 0; j < width; ++j) {
      const double* const from = at + j * stride + first;
      for (std::ptrdiff_t i = 0; i < height; ++i) entries[j][i] = static_cast<float>(from[i]) * inverse[j];
    }
    return entries;
  }
};

/// Rounded up; 1 where entries are stored as they are.
template <typename Entries>
int largest_in(const Block& block) {
  if (kAsTheyAre<Entries>) return 1;
  float largest = 0;
  for (const auto& column : block) {
    for (const float entry : column) largest = std::max(largest, std::abs(entry));
  }
  return static_cast<int>(std::min(std::ceil(largest), kLargestEntry));
}

/// Returns the end of what it has written.
template <typename Entries>
std::uint8_t* pack(Block block, int width, int largest, std::uint8_t* to) {
  const float steps = Entries::kLargest / static_cast<float>(std::max(1, largest));
  for (int j = 0; j < width; ++j, to += Entries::kBytes) {
    for (float& entry : block[j]) entry *= steps;
    Entries::pack(block[j], to);
  }
  return to;
}

/// Of eight rows the sum of each.
inline Row sums_of(const std::array<Row, kPanelColumns>& s) {
  const __m256 low = _mm256_hadd_ps(_mm256_hadd_ps(s[0], s[1]), _mm256_hadd_ps(s[2], s[3]));
  const __m256 high = _mm256_hadd_ps(_mm256_hadd_ps(s[4], s[5]), _mm256_hadd_ps(s[6], s[7]));
  return _mm256_add_ps(_mm256_permute2f128_ps(low, high, 0x20), _mm256_permute2f128_ps(low, high, 0x31));
}

/// Some tiles of the first pass: w -= L w of the rows below. Returns their end.
template <typename Entries, int Width>
const std::uint8_t* eliminate_tiles(const std::uint8_t* at, std::span<const Tile> tiles, const Row& scaled,
                                    float* below) {
  for (const Tile& tile : tiles) {
    prefetch<Width * Entries::kBytes>(at + kAhead);
    Row sum{};
    for (int j = 0; j < Width; ++j, at += Entries::kBytes)
      sum = times_and_more(Entries::load(at), Row{} + scaled[j], sum);
    float* const to = below + std::ptrdiff_t{kPanelColumns} * tile.row;
    store(load(to) - sum * unit_of<Entries>(tile), to);
  }
  return at;
}

/// Some tiles of the second pass, from their end, so that L is read in one direction; returns where they begin.
/// @param[in,out] sums  L^T w of the rows below, eight summands a column
template <typename Entries, int Width>
const std::uint8_t* substitute_back_tiles(const std::uint8_t* at, std::span<const Tile> tiles, const float* below,
                                          std::array<Row, kPanelColumns>& sums) {
  for (std::size_t t = tiles.size(); t-- > 0;) {
    at -= Width * Entries::kBytes;
    prefetch<Width * Entries::kBytes>(at - kAhead);
    const Row known = load(below + std::ptrdiff_t{kPanelColumns} * tiles[t].row) * unit_of<Entries>(tiles[t]);
    for (int j = 0; j < Width; ++j)
      sums[j] = times_and_more(Entries::load(at + std::ptrdiff_t{j} * Entries::kBytes), known, sums[j]);
  }
  return at;
}

/// One panel of the first pass: w <- L^-1 w of its columns, w -= L w of the rows below. Returns the end of its tiles.
template <typename Entries, int Width>
const std::uint8_t* eliminate_panel(const float* head, const std::uint8_t* at, std::span<const Tile> tiles,
                                    std::size_t wide, float* w) {
  Row solved{};
  for (int j = 0; j < Width; ++j) solved += load(head + j * kPanelColumns) * w[j];
  std::memcpy(w, &solved, Width * sizeof(float));
  const Row scaled = solved * load(head + kPanelColumns * kPanelColumns);
  at = eliminate_tiles<Entries, Width>(at, tiles.first(wide), scaled, w + Width);
  return eliminate_tiles<EightBits, Width>(at, tiles.subspan(wide), scaled, w + Width);
}

/// One panel of the second pass: w <- L^-T (w - L^T w below). From the end of its tiles; returns where they begin.
template <typename Entries, int Width>
const std::uint8_t* substitute_back_panel(const float* head, const std::uint8_t* at, std::span<const Tile> tiles,
                                          std::size_t wide, float* w) {
  std::array<Row, kPanelColumns> sums{};
  at = substitute_back_tiles<EightBits, Width>(at, tiles.subspan(wide), w + Width, sums);
  at = substitute_back_tiles<Entries, Width>(at, tiles.first(wide), w + Width, sums);
  Row mine{};
  std::memcpy(&mine, w, Width * sizeof(float));
  const Row rest = mine - load(head + kPanelColumns * kPanelColumns) * sums_of(sums);
  for (int j = 0; j < kPanelColumns; ++j) sums[j] = load(head + j * kPanelColumns) * rest;
  const Row solved = sums_of(sums);
  std::memcpy(w, &solved, Width * sizeof(float));
  return at;
}

}  // namespace stylet::physics::panels
