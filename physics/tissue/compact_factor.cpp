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
constexpr std::ptrdiff_t kAhead = 1024;    // entries between what is read and what is fetched
constexpr std::size_t kMostParts = 6;      // enough that two threads end together
constexpr int kMostCuts = 40;              // of the elimination tree, tried from its root
constexpr float kLargestEntry = 32767;     // of 16 bits
// Fewer entries stay in the cache that the cores share, and are read before another thread wakes.
constexpr std::size_t kEntriesWorthSharing = std::size_t{1} << 23;

using Row = float __attribute__((vector_size(32)));

Row load(const float* at) {
  Row row;
  std::memcpy(&row, at, sizeof row);
  return row;
}

Row load(const std::int16_t* at) {
  std::int16_t __attribute__((vector_size(16))) entries;
  std::memcpy(&entries, at, sizeof entries);
  return __builtin_convertvector(entries, Row);
}

void store(const Row& row, float* at) {
  std::memcpy(at, &row, sizeof row);
}

/// A tile that will be read soon: two lines of 64 bytes of 16 bits.
template <typename Stored>
void prefetch(const Stored* tile) {
  for (std::size_t at = 0; at < kPanelColumns * kPanelColumns; at += 64 / sizeof(Stored))
    __builtin_prefetch(tile + at);
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

float scale_of(const double* column, int rows, const std::int16_t*) {
  double largest = 0;
  for (int r = 0; r < rows; ++r) largest = std::max(largest, std::abs(column[r]));
  return std::max(static_cast<float>(largest) / kLargestEntry, std::numeric_limits<float>::min());
}
float scale_of(const double*, int, const float*) {
  return 1;
}
std::int16_t stored(double value, const std::int16_t*) {
  return static_cast<std::int16_t>(std::nearbyint(value));
}
float stored(double value, const float*) {
  return static_cast<float>(value);
}

/// Of eight rows the sum of each.
Row sums_of(const std::array<Row, kPanelColumns>& s) {
  const __m256 low = _mm256_hadd_ps(_mm256_hadd_ps(s[0], s[1]), _mm256_hadd_ps(s[2], s[3]));
  const __m256 high = _mm256_hadd_ps(_mm256_hadd_ps(s[4], s[5]), _mm256_hadd_ps(s[6], s[7]));
  return _mm256_add_ps(_mm256_permute2f128_ps(low, high, 0x20), _mm256_permute2f128_ps(low, high, 0x31));
}

/// One panel of the first pass: w <- L^-1 w of its columns, w -= L w of the rows below. Returns the end of its tiles.
template <int Width, typename Stored>
const Stored* eliminate_panel(const float* head, const Stored* tile, float* w, int below) {
  Row solved{};
  for (int j = 0; j < Width; ++j) solved += load(head + j * kPanelColumns) * w[j];
  std::memcpy(w, &solved, Width * sizeof(float));
  const Row scaled = solved * load(head + kPanelColumns * kPanelColumns);
  for (float* to = w + Width; to < w + Width + below; to += kPanelColumns, tile += Width * kPanelColumns) {
    prefetch(tile + kAhead);
    Row sum = load(to);
    for (int j = 0; j < Width; ++j) sum -= load(tile + j * kPanelColumns) * scaled[j];
    store(sum, to);
  }
  return tile;
}

/// One panel of the second pass: w <- L^-T (w - L^T w below). From the end of its tiles, so that L is read in one
/// direction; returns where they begin.
template <int Width, typename Stored>
const Stored* substitute_back_panel(const float* head, const Stored* tile, float* w, int below) {
  std::array<Row, kPanelColumns> sums{};
  for (int r = tile_rows(below); r-- > 0;) {
    tile -= Width * kPanelColumns;
    prefetch(tile - kAhead);
    const Row known = load(w + Width + static_cast<std::ptrdiff_t>(r) * kPanelColumns);
    for (int j = 0; j < Width; ++j) sums[j] += load(tile + j * kPanelColumns) * known;
  }
  Row mine{};
  std::memcpy(&mine, w, Width * sizeof(float));
  const Row rest = mine - load(head + kPanelColumns * kPanelColumns) * sums_of(sums);
  for (int j = 0; j < kPanelColumns; ++j) sums[j] = load(head + j * kPanelColumns) * rest;
  const Row solved = sums_of(sums);
  std::memcpy(w, &solved, Width * sizeof(float));
  return tile;
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
  const std::size_t size = precision_ == PassPrecision::sixteen_bits ? sizeof(std::int16_t) : sizeof(float);
  return entry_count_ * size + heads_.size() * sizeof(float);
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
  if (precision == PassPrecision::sixteen_bits) {
    read_entries(factor, int_, companion);
  } else {
    read_entries(factor, float_, companion);
  }
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
  std::size_t heads = 0;
  entry_count_ = 0;
  for (std::size_t s = 0; s < factor.nsuper && super[s] < leading; ++s) {
    const int columns = std::min(super[s + 1], leading) - super[s];
    const int rows = row_start[s + 1] - row_start[s];
    for (int c = 0; c < columns; ++c) node_of[super[s] + c] = static_cast<int>(s);
    nodes_.push_back({.first = super[s],
                      .columns = columns,
                      .below = rows - columns,
                      .row_start = rows_.size(),
                      .head_start = heads,
                      .tile_start = entry_count_});
    rows_.insert(rows_.end(), row + row_start[s] + columns, row + row_start[s + 1]);
    heads += kHead * static_cast<std::size_t>(tile_rows(columns));
    entry_count_ += entries_of(columns, rows - columns);
    longest_ = std::max(longest_, rows);
  }
  heads_.resize(heads);
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

template <typename Stored>
void CompactFactor::read_entries(const cholmod_factor_struct& factor, std::vector<Stored>& entries,
                                 Companion* companion) {
  const auto* value_start = static_cast<const int*>(factor.px);
  const auto* l = static_cast<const double*>(factor.x);
  if (entries.size() < entry_count_) entries.resize(entry_count_ + entry_count_ / kSpareEntries);
  in_parts(companion, static_cast<int>(nodes_.size()), [&](int s) {
    const Node& node = nodes_[s];
    const int rows = node.columns + node.below;
    float* head = heads_.data() + node.head_start;
    Stored* tile = entries.data() + node.tile_start;
    for (int c = 0; c < node.columns; c += kPanelColumns, head += kHead) {
      const int width = std::min(kPanelColumns, node.columns - c);
      const double* const diagonal = l + value_start[s] + static_cast<std::ptrdiff_t>(c) * rows + c;
      invert_block(diagonal, rows, width, head);
      const int below = rows - c - width;
      float* const scale = head + kPanelColumns * kPanelColumns;
      std::fill_n(scale, kPanelColumns, 0.0F);
      std::array<double, kPanelColumns> inverse{};
      for (int j = 0; j < width; ++j) {
        scale[j] = scale_of(diagonal + j * static_cast<std::ptrdiff_t>(rows) + width, below, tile);
        inverse[j] = 1 / static_cast<double>(scale[j]);
      }
      for (int r = 0; r < below; r += kPanelColumns) {
        const int height = std::min(kPanelColumns, below - r);
        for (int j = 0; j < width; ++j, tile += kPanelColumns) {
          const double* const from = diagonal + j * static_cast<std::ptrdiff_t>(rows) + width + r;
          if (height == kPanelColumns) {
            for (int i = 0; i < kPanelColumns; ++i) tile[i] = stored(from[i] * inverse[j], tile);
          } else {
            for (int i = 0; i < height; ++i) tile[i] = stored(from[i] * inverse[j], tile);
            std::fill(tile + height, tile + kPanelColumns, Stored(0));
          }
        }
      }
    }
  });
}

template <typename Stored>
void CompactFactor::eliminate_node(const Node& node, const Stored* entries, float* x, float* w) const {
  float* const mine = x + node.first;
  if (std::all_of(mine, mine + node.columns, [](float value) { return value == 0; })) return;
  std::copy_n(mine, node.columns, w);
  std::fill_n(w + node.columns, node.below + kPanelColumns, 0.0F);
  const float* head = heads_.data() + node.head_start;
  const Stored* tile = entries + node.tile_start;
  for (int c = 0; c < node.columns; c += kPanelColumns, head += kHead) {
    const int width = std::min(kPanelColumns, node.columns - c);
    const int below = node.columns - c - width + node.below;
    by_width(width, [&](auto constant) { tile = eliminate_panel<constant()>(head, tile, w + c, below); });
  }
  std::copy_n(w, node.columns, mine);
  const int* const row = rows_.data() + node.row_start;
  for (int i = 0; i < node.below; ++i) x[row[i]] += w[node.columns + i];
}

template <typename Stored>
void CompactFactor::substitute_back_node(const Node& node, const Stored* entries, float* x, float* w) const {
  float* const mine = x + node.first;
  std::copy_n(mine, node.columns, w);
  const int* const row = rows_.data() + node.row_start;
  for (int i = 0; i < node.below; ++i) w[node.columns + i] = x[row[i]];
  std::fill_n(w + node.columns + node.below, kPanelColumns, 0.0F);
  const int panels = tile_rows(node.columns);
  const float* head = heads_.data() + node.head_start + kHead * static_cast<std::size_t>(panels);
  const Stored* tile = entries + node.tile_start + entries_of(node.columns, node.below);
  for (int c = (panels - 1) * kPanelColumns; c >= 0; c -= kPanelColumns) {
    const int width = std::min(kPanelColumns, node.columns - c);
    const int below = node.columns - c - width + node.below;
    head -= kHead;
    by_width(width, [&](auto constant) { tile = substitute_back_panel<constant()>(head, tile, w + c, below); });
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

template <typename Stored>
void CompactFactor::eliminate_in(const Stored* entries, Scratch& scratch, Companion* companion) const {
  make_room(scratch);
  float* const x = scratch.x.data();
  const std::size_t upper = upper_rows_.size();
  in_parts(companion, part_count(), [&](int p) {
    std::fill_n(x + dofs_ + static_cast<std::size_t>(p) * upper, upper, 0.0F);
    for (const int s : parts_[p].nodes) eliminate_node(nodes_[s], entries, x, scratch.panels[p].data());
  });
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const float* const added = x + dofs_ + p * upper;
    for (std::size_t u = 0; u < upper; ++u) x[upper_rows_[u]] += added[u];
  }
  for (const int s : upper_) eliminate_node(nodes_[s], entries, x, scratch.panels.back().data());
}

template <typename Stored>
void CompactFactor::substitute_back_in(const Stored* entries, Scratch& scratch, Companion* companion) const {
  make_room(scratch);
  float* const x = scratch.x.data();
  for (std::size_t i = upper_.size(); i-- > 0;) {
    substitute_back_node(nodes_[upper_[i]], entries, x, scratch.panels.back().data());
  }
  const std::size_t upper = upper_rows_.size();
  in_parts(companion, part_count(), [&](int p) {
    float* const copy = x + dofs_ + static_cast<std::size_t>(p) * upper;
    for (std::size_t u = 0; u < upper; ++u) copy[u] = x[upper_rows_[u]];
    const std::vector<int>& nodes = parts_[p].nodes;
    for (std::size_t i = nodes.size(); i-- > 0;) {
      substitute_back_node(nodes_[nodes[i]], entries, x, scratch.panels[p].data());
    }
  });
}

void CompactFactor::eliminate(Scratch& scratch, Companion* companion) const {
  if (precision_ == PassPrecision::sixteen_bits) return eliminate_in(int_.data(), scratch, companion);
  eliminate_in(float_.data(), scratch, companion);
}

void CompactFactor::substitute_back(Scratch& scratch, Companion* companion) const {
  if (precision_ == PassPrecision::sixteen_bits) return substitute_back_in(int_.data(), scratch, companion);
  substitute_back_in(float_.data(), scratch, companion);
}

}  // namespace stylet::physics
