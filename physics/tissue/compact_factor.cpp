#include "physics/tissue/compact_factor.h"

#include <cholmod.h>
#include <immintrin.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <type_traits>

namespace stylet::physics {
namespace {

constexpr int kPanelColumns = 8;  // and rows of a tile: a register of single precision
constexpr std::size_t kHead = kPanelColumns * kPanelColumns + kPanelColumns;
constexpr std::size_t kSpareEntries = 16;  // one part in so many: trailing DOFs make more, and fresh memory its pages
constexpr std::ptrdiff_t kAhead = 2048;    // bytes between what is read and what is fetched
constexpr std::size_t kMostParts = 6;      // enough that two threads end together
constexpr int kMostCuts = 40;              // of the elimination tree, tried from its root
constexpr float kLargestEntry = 32767;     // of a column
constexpr int kSmallTile = 1024;           // whose largest entry is below has narrow ones: rho does not show it
// Fewer entries stay in the cache that the cores share, and are read before another thread wakes.
constexpr std::size_t kEntriesWorthSharing = std::size_t{1} << 23;

using Row = float __attribute__((vector_size(32)));

Row load(const float* at) {
  Row row;
  std::memcpy(&row, at, sizeof row);
  return row;
}

void store(const Row& row, float* at) {
  std::memcpy(at, &row, sizeof row);
}

template <typename Integer>
Row load_integers(const std::uint8_t* at) {
  Integer __attribute__((vector_size(kPanelColumns * sizeof(Integer)))) entries;
  std::memcpy(&entries, at, sizeof entries);
  return __builtin_convertvector(entries, Row);
}

/// To the nearest integer from -most to most.
int nearest(float value, int most) {
  return std::clamp(static_cast<int>(std::lrint(value)), -most, most);
}

template <typename Integer>
void pack_integers(const std::array<float, kPanelColumns>& entries, std::uint8_t* to) {
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto entry = static_cast<Integer>(nearest(entries[i], std::numeric_limits<Integer>::max()));
    std::memcpy(to + i * sizeof entry, &entry, sizeof entry);
  }
}

// How eight entries of a column lie in memory: integers up to kLargest, which are read as multiples of kUnit, or what
// they are.
struct EightBits {
  static constexpr int kBytes = 8;
  static constexpr float kLargest = 127;
  static constexpr float kUnit = 1;
  static Row load(const std::uint8_t* at) { return load_integers<std::int8_t>(at); }
  static void pack(const std::array<float, kPanelColumns>& entries, std::uint8_t* to) {
    pack_integers<std::int8_t>(entries, to);
  }
};
struct SixteenBits {
  static constexpr int kBytes = 16;
  static constexpr float kLargest = 32767;
  static constexpr float kUnit = 1;
  static constexpr int kNarrowBelow = 0;
  static Row load(const std::uint8_t* at) { return load_integers<std::int16_t>(at); }
  static void pack(const std::array<float, kPanelColumns>& entries, std::uint8_t* to) {
    pack_integers<std::int16_t>(entries, to);
  }
};
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
constexpr std::size_t kBytesMore = 4;
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

/// Of what is read of a tile, over the scales of the columns.
template <typename Entries, typename Tile>
float unit_of(const Tile& tile) {
  return tile.largest * (1 / (Entries::kLargest * Entries::kUnit));
}

template <typename Entries>
constexpr bool kAsTheyAre = std::is_same_v<Entries, Single>;

Row times_and_more(const Row& a, const Row& b, const Row& more) {
  return Row(_mm256_fmadd_ps(__m256(a), __m256(b), __m256(more)));
}

/// A tile that will be read soon.
template <int Bytes>
void prefetch(const std::uint8_t* tile) {
  for (int at = 0; at < Bytes; at += 64) __builtin_prefetch(tile + at);
}

int tile_rows(int rows) {
  return (rows + kPanelColumns - 1) / kPanelColumns;
}

/// Entries of a node's tiles, with those that pad them.
std::size_t entries_of(int columns, int below) {
  std::size_t entries = 0;
  for (int c = 0; c < columns; c += kPanelColumns) {
    const int width = std::min(kPanelColumns, columns - c);
    entries += static_cast<std::size_t>(tile_rows(columns - c - width + below)) * kPanelColumns * width;
  }
  return entries;
}

std::size_t tiles_of(int columns, int below) {
  std::size_t tiles = 0;
  for (int c = 0; c < columns; c += kPanelColumns)
    tiles += static_cast<std::size_t>(tile_rows(columns - std::min(c + kPanelColumns, columns) + below));
  return tiles;
}

/// The inverse of a lower triangle, by columns, zero above the diagonal and where there is no column.
void invert_block(const double* l, std::ptrdiff_t stride, int width, float* inverse) {
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
Row sums_of(const std::array<Row, kPanelColumns>& s) {
  const __m256 low = _mm256_hadd_ps(_mm256_hadd_ps(s[0], s[1]), _mm256_hadd_ps(s[2], s[3]));
  const __m256 high = _mm256_hadd_ps(_mm256_hadd_ps(s[4], s[5]), _mm256_hadd_ps(s[6], s[7]));
  return _mm256_add_ps(_mm256_permute2f128_ps(low, high, 0x20), _mm256_permute2f128_ps(low, high, 0x31));
}

/// Some tiles of the first pass: w -= L w of the rows below. Returns their end.
template <typename Entries, int Width, typename Tile>
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
template <typename Entries, int Width, typename Tile>
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
template <typename Entries, int Width, typename Tile>
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
template <typename Entries, int Width, typename Tile>
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

/// Calls `with` with how entries lie.
template <typename With>
void by_precision(PassPrecision precision, const With& with) {
  switch (precision) {
    case PassPrecision::twelve_bits:
      return with(TwelveBits());
    case PassPrecision::sixteen_bits:
      return with(SixteenBits());
    default:
      return with(Single());
  }
}

/// Calls `with` with the width of a panel as a constant.
template <typename With>
void by_width(int width, const With& with) {
  switch (width) {
    case 1:
      return with(std::integral_constant<int, 1>());
    case 2:
      return with(std::integral_constant<int, 2>());
    case 3:
      return with(std::integral_constant<int, 3>());
    case 4:
      return with(std::integral_constant<int, 4>());
    case 5:
      return with(std::integral_constant<int, 5>());
    case 6:
      return with(std::integral_constant<int, 6>());
    case 7:
      return with(std::integral_constant<int, 7>());
    default:
      return with(std::integral_constant<int, kPanelColumns>());
  }
}

}  // namespace

void CompactFactor::clear() {
  nodes_.clear();
  heads_.clear();
  entry_count_ = 0;
}

std::size_t CompactFactor::bytes() const {
  std::size_t packed = heads_.size() * sizeof(float) + tiles_.size() * sizeof(Tile);
  for (const Node& node : nodes_) packed += node.packed;
  return packed;
}

double CompactFactor::serial_share() const {
  std::size_t upper = entry_count_;
  for (const Part& part : parts_) upper -= part.entries;
  return entry_count_ == 0 ? 0 : static_cast<double>(upper) / static_cast<double>(entry_count_);
}

void CompactFactor::read(const cholmod_factor_struct& factor, int leading, PassPrecision precision, bool same_symbols,
                         Companion* companion) {
  if (!same_symbols || nodes_.empty()) analyse(factor, leading);
  precision_ = precision;
  by_precision(precision, [&](auto entries) { read_entries<decltype(entries)>(factor, companion); });
}

void CompactFactor::analyse(const cholmod_factor_struct& factor, int leading) {
  const auto* super = static_cast<const int*>(factor.super);
  const auto* row_start = static_cast<const int*>(factor.pi);
  const auto* row = static_cast<const int*>(factor.s);
  dofs_ = static_cast<int>(factor.n);
  leading_ = leading;
  nodes_.clear();
  rows_.clear();
  longest_ = 0;
  std::vector<int> node_of(static_cast<std::size_t>(leading), -1);
  std::size_t panels = 0;
  std::size_t tiles = 0;
  entry_count_ = 0;
  for (std::size_t s = 0; s < factor.nsuper && super[s] < leading; ++s) {
    const int columns = std::min(super[s + 1], leading) - super[s];
    const int rows = row_start[s + 1] - row_start[s];
    for (int c = 0; c < columns; ++c) node_of[super[s] + c] = static_cast<int>(s);
    nodes_.push_back({.first = super[s],
                      .columns = columns,
                      .below = rows - columns,
                      .row_start = rows_.size(),
                      .panel_start = panels,
                      .tile_start = tiles,
                      .entry_start = entry_count_});
    rows_.insert(rows_.end(), row + row_start[s] + columns, row + row_start[s + 1]);
    panels += static_cast<std::size_t>(tile_rows(columns));
    tiles += tiles_of(columns, rows - columns);
    entry_count_ += entries_of(columns, rows - columns);
    longest_ = std::max(longest_, rows);
  }
  heads_.resize(kHead * panels);
  wide_.resize(panels);
  tiles_.resize(tiles);
  std::vector<int> parent(nodes_.size(), -1);
  for (std::size_t s = 0; s < nodes_.size(); ++s) {
    if (nodes_[s].below == 0) continue;
    const int next = rows_[nodes_[s].row_start];
    if (next < leading) parent[s] = node_of[next];
  }
  cut(parent);
}

void CompactFactor::cut(std::span<const int> parent) {
  const std::size_t count = nodes_.size();
  std::vector<std::size_t> own(count);
  for (std::size_t s = 0; s < count; ++s) own[s] = entries_of(nodes_[s].columns, nodes_[s].below);
  std::vector<std::size_t> below = own;  // of whole subtrees
  std::vector<std::vector<int>> children(count);
  std::vector<int> roots;
  for (std::size_t s = 0; s < count; ++s) {
    if (parent[s] < 0) {
      roots.push_back(static_cast<int>(s));
    } else {
      below[parent[s]] += below[s];
      children[parent[s]].push_back(static_cast<int>(s));
    }
  }
  const auto lighter = [&](int a, int b) { return below[a] != below[b] ? below[a] < below[b] : a > b; };

  // From the root, the heaviest subtree first, as long as two threads gain by it.
  std::vector<char> is_upper(count, 0);
  std::vector<char> best_upper = is_upper;
  std::vector<int> best_roots = roots;
  std::size_t upper = 0;
  std::size_t best = std::numeric_limits<std::size_t>::max();
  std::make_heap(roots.begin(), roots.end(), lighter);
  for (int cuts = 0; cuts <= kMostCuts && !roots.empty(); ++cuts) {
    const std::size_t heaviest = below[roots.front()];
    const std::size_t time = upper + std::max(heaviest, (entry_count_ - upper) / 2);
    if (time < best) {
      best = time;
      best_upper = is_upper;
      best_roots = roots;
    }
    std::pop_heap(roots.begin(), roots.end(), lighter);
    const int node = roots.back();
    roots.pop_back();
    is_upper[node] = 1;
    upper += own[node];
    for (const int child : children[node]) {
      roots.push_back(child);
      std::push_heap(roots.begin(), roots.end(), lighter);
    }
  }

  // The subtrees in few parts of about the same weight.
  parts_.clear();
  upper_.clear();
  if (entry_count_ < kEntriesWorthSharing) {
    upper_.resize(count);
    std::iota(upper_.begin(), upper_.end(), 0);
  } else {
    std::sort(best_roots.begin(), best_roots.end(), [&](int a, int b) { return lighter(b, a); });
    parts_.resize(std::min(kMostParts, best_roots.size()));
    std::vector<int> part_of(count, -1);
    for (const int root : best_roots) {
      const auto least = std::min_element(parts_.begin(), parts_.end(),
                                          [](const Part& a, const Part& b) { return a.entries < b.entries; });
      least->entries += below[root];
      part_of[root] = static_cast<int>(least - parts_.begin());
    }
    for (std::size_t s = count; s-- > 0;) {
      if (best_upper[s] != 0) continue;
      if (part_of[s] < 0) part_of[s] = part_of[parent[s]];
    }
    for (std::size_t s = 0; s < count; ++s) {
      if (best_upper[s] != 0) {
        upper_.push_back(static_cast<int>(s));
      } else {
        parts_[part_of[s]].nodes.push_back(static_cast<int>(s));
      }
    }
  }

  // Each part has the upper rows for itself, behind the vector.
  upper_rows_.clear();
  for (const int s : upper_) {
    for (int c = 0; c < nodes_[s].columns; ++c) upper_rows_.push_back(nodes_[s].first + c);
  }
  for (int i = leading_; i < dofs_; ++i) upper_rows_.push_back(i);
  std::vector<int> place(static_cast<std::size_t>(dofs_), -1);
  for (std::size_t u = 0; u < upper_rows_.size(); ++u) place[upper_rows_[u]] = static_cast<int>(u);
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const int copy = dofs_ + static_cast<int>(p * upper_rows_.size());
    for (const int s : parts_[p].nodes) {
      for (std::size_t i = nodes_[s].row_start; i < nodes_[s].row_start + static_cast<std::size_t>(nodes_[s].below);
           ++i) {
        if (place[rows_[i]] >= 0) rows_[i] = copy + place[rows_[i]];
      }
    }
  }
}

template <typename Entries>
void CompactFactor::read_entries(const cholmod_factor_struct& factor, Companion* companion) {
  const auto* value_start = static_cast<const int*>(factor.px);
  const auto* l = static_cast<const double*>(factor.x);
  const std::size_t most = entry_count_ / kPanelColumns * Entries::kBytes + kBytesMore;
  if (entries_.size() < most) entries_.resize(most + most / kSpareEntries);
  in_parts(companion, static_cast<int>(nodes_.size()), [&](int s) {
    Node& node = nodes_[s];
    const int rows = node.columns + node.below;
    float* head = heads_.data() + kHead * node.panel_start;
    int* wide = wide_.data() + node.panel_start;
    Tile* tile = tiles_.data() + node.tile_start;
    std::uint8_t* const begin = entries_.data() + node.entry_start / kPanelColumns * Entries::kBytes;
    std::uint8_t* to = begin;
    for (int c = 0; c < node.columns; c += kPanelColumns, head += kHead, ++wide) {
      const int width = std::min(kPanelColumns, node.columns - c);
      const double* const diagonal = l + value_start[s] + static_cast<std::ptrdiff_t>(c) * rows + c;
      invert_block(diagonal, rows, width, head);
      Panel panel{.at = diagonal + width, .stride = rows, .width = width, .below = rows - c - width};
      panel.find_scales<Entries>(head + kPanelColumns * kPanelColumns);
      const Tile* const first = tile;
      for (int t = 0; t < tile_rows(panel.below); ++t) {
        const Block block = panel.block(t);
        const int largest = largest_in<Entries>(block);
        if (largest < Entries::kNarrowBelow) continue;
        to = pack<Entries>(block, width, largest, to);
        *tile++ = {.row = static_cast<std::uint16_t>(t), .largest = static_cast<std::uint16_t>(largest)};
      }
      *wide = static_cast<int>(tile - first);
      for (int t = 0; t < tile_rows(panel.below) && Entries::kNarrowBelow > 0; ++t) {
        const Block block = panel.block(t);
        const int largest = largest_in<Entries>(block);
        if (largest >= Entries::kNarrowBelow) continue;
        to = pack<EightBits>(block, width, largest, to);
        *tile++ = {.row = static_cast<std::uint16_t>(t), .largest = static_cast<std::uint16_t>(largest)};
      }
    }
    node.packed = static_cast<std::size_t>(to - begin);
  });
}

template <typename Entries>
void CompactFactor::eliminate_node(const Node& node, float* x, float* w) const {
  float* const mine = x + node.first;
  if (std::all_of(mine, mine + node.columns, [](float value) { return value == 0; })) return;
  std::copy_n(mine, node.columns, w);
  std::fill_n(w + node.columns, node.below + kPanelColumns, 0.0F);
  const float* head = heads_.data() + kHead * node.panel_start;
  const int* wide = wide_.data() + node.panel_start;
  std::size_t tile = node.tile_start;
  const std::uint8_t* at = entries_.data() + node.entry_start / kPanelColumns * Entries::kBytes;
  for (int c = 0; c < node.columns; c += kPanelColumns, head += kHead, ++wide) {
    const int width = std::min(kPanelColumns, node.columns - c);
    const auto count = static_cast<std::size_t>(tile_rows(node.columns - c - width + node.below));
    const auto tiles = std::span(tiles_).subspan(tile, count);
    by_width(width, [&](auto constant) {
      at = eliminate_panel<Entries, constant()>(head, at, tiles, static_cast<std::size_t>(*wide), w + c);
    });
    tile += count;
  }
  std::copy_n(w, node.columns, mine);
  const int* const row = rows_.data() + node.row_start;
  for (int i = 0; i < node.below; ++i) x[row[i]] += w[node.columns + i];
}

template <typename Entries>
void CompactFactor::substitute_back_node(const Node& node, float* x, float* w) const {
  float* const mine = x + node.first;
  std::copy_n(mine, node.columns, w);
  const int* const row = rows_.data() + node.row_start;
  for (int i = 0; i < node.below; ++i) w[node.columns + i] = x[row[i]];
  std::fill_n(w + node.columns + node.below, kPanelColumns, 0.0F);
  const int panels = tile_rows(node.columns);
  const float* head = heads_.data() + kHead * (node.panel_start + static_cast<std::size_t>(panels));
  const int* wide = wide_.data() + node.panel_start + panels;
  std::size_t tile = node.tile_start + tiles_of(node.columns, node.below);
  const std::uint8_t* at = entries_.data() + node.entry_start / kPanelColumns * Entries::kBytes + node.packed;
  for (int c = (panels - 1) * kPanelColumns; c >= 0; c -= kPanelColumns) {
    const int width = std::min(kPanelColumns, node.columns - c);
    const auto count = static_cast<std::size_t>(tile_rows(node.columns - c - width + node.below));
    head -= kHead;
    --wide;
    tile -= count;
    const auto tiles = std::span(tiles_).subspan(tile, count);
    by_width(width, [&](auto constant) {
      at = substitute_back_panel<Entries, constant()>(head, at, tiles, static_cast<std::size_t>(*wide), w + c);
    });
  }
  std::copy_n(w, node.columns, mine);
}

void CompactFactor::make_room(Scratch& scratch) const {
  scratch.x.resize(static_cast<std::size_t>(dofs_) + parts_.size() * upper_rows_.size());
  if (scratch.panels.size() < parts_.size() + 1) scratch.panels.resize(parts_.size() + 1);
  const auto length = static_cast<std::size_t>(longest_ + kPanelColumns);
  for (std::vector<float>& panel : scratch.panels) {
    if (panel.size() < length) panel.resize(length);
  }
}

template <typename Entries>
void CompactFactor::eliminate_in(Scratch& scratch, Companion* companion) const {
  make_room(scratch);
  float* const x = scratch.x.data();
  const std::size_t upper = upper_rows_.size();
  in_parts(companion, part_count(), [&](int p) {
    std::fill_n(x + dofs_ + static_cast<std::size_t>(p) * upper, upper, 0.0F);
    for (const int s : parts_[p].nodes) eliminate_node<Entries>(nodes_[s], x, scratch.panels[p].data());
  });
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const float* const added = x + dofs_ + p * upper;
    for (std::size_t u = 0; u < upper; ++u) x[upper_rows_[u]] += added[u];
  }
  for (const int s : upper_) eliminate_node<Entries>(nodes_[s], x, scratch.panels.back().data());
}

template <typename Entries>
void CompactFactor::substitute_back_in(Scratch& scratch, Companion* companion) const {
  make_room(scratch);
  float* const x = scratch.x.data();
  for (std::size_t i = upper_.size(); i-- > 0;) {
    substitute_back_node<Entries>(nodes_[upper_[i]], x, scratch.panels.back().data());
  }
  const std::size_t upper = upper_rows_.size();
  in_parts(companion, part_count(), [&](int p) {
    float* const copy = x + dofs_ + static_cast<std::size_t>(p) * upper;
    for (std::size_t u = 0; u < upper; ++u) copy[u] = x[upper_rows_[u]];
    const std::vector<int>& nodes = parts_[p].nodes;
    for (std::size_t i = nodes.size(); i-- > 0;) {
      substitute_back_node<Entries>(nodes_[nodes[i]], x, scratch.panels[p].data());
    }
  });
}

void CompactFactor::eliminate(Scratch& scratch, Companion* companion) const {
  by_precision(precision_, [&](auto entries) { eliminate_in<decltype(entries)>(scratch, companion); });
}

void CompactFactor::substitute_back(Scratch& scratch, Companion* companion) const {
  by_precision(precision_, [&](auto entries) { substitute_back_in<decltype(entries)>(scratch, companion); });
}

}  // namespace stylet::physics
