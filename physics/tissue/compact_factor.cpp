#include "physics/tissue/compact_factor.h"

#include "physics/tissue/factor_panels.h"

#include <cholmod.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <type_traits>

namespace stylet::physics {
namespace {

constexpr std::size_t kSpareEntries = 16;  // one part in so many: trailing DOFs make more, and fresh memory its pages
constexpr std::size_t kMostParts = 6;      // enough that two threads end together
constexpr int kMostCuts = 40;              // of the elimination tree, tried from its root
// Fewer entries stay in the cache that the cores share, and are read before another thread wakes.
constexpr std::size_t kEntriesWorthSharing = std::size_t{1} << 23;

int tile_rows(int rows) {
  return (rows + panels::kPanelColumns - 1) / panels::kPanelColumns;
}

/// Entries of a node's tiles, with those that pad them.
std::size_t entries_of(int columns, int below) {
  std::size_t entries = 0;
  for (int c = 0; c < columns; c += panels::kPanelColumns) {
    const int width = std::min(panels::kPanelColumns, columns - c);
    entries += static_cast<std::size_t>(tile_rows(columns - c - width + below)) * panels::kPanelColumns * width;
  }
  return entries;
}

std::size_t tiles_of(int columns, int below) {
  std::size_t tiles = 0;
  for (int c = 0; c < columns; c += panels::kPanelColumns)
    tiles += static_cast<std::size_t>(tile_rows(columns - std::min(c + panels::kPanelColumns, columns) + below));
  return tiles;
}

/// Calls `with` with how entries lie.
template <typename With>
void by_precision(PassPrecision precision, const With& with) {
  switch (precision) {
    case PassPrecision::twelve_bits:
      return with(panels::TwelveBits());
    case PassPrecision::sixteen_bits:
      return with(panels::SixteenBits());
    default:
      return with(panels::Single());
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
      return with(std::integral_constant<int, panels::kPanelColumns>());
  }
}

}  // namespace

void CompactFactor::clear() {
  nodes_.clear();
  heads_.clear();
  entry_count_ = 0;
}

std::size_t CompactFactor::bytes() const {
  std::size_t packed = heads_.size() * sizeof(float) + tiles_.size() * sizeof(panels::Tile);
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
  std::size_t panel_count = 0;
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
                      .panel_start = panel_count,
                      .tile_start = tiles,
                      .entry_start = entry_count_});
    rows_.insert(rows_.end(), row + row_start[s] + columns, row + row_start[s + 1]);
    panel_count += static_cast<std::size_t>(tile_rows(columns));
    tiles += tiles_of(columns, rows - columns);
    entry_count_ += entries_of(columns, rows - columns);
    longest_ = std::max(longest_, rows);
  }
  heads_.resize(panels::kHead * panel_count);
  wide_.resize(panel_count);
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
  const std::size_t most = entry_count_ / panels::kPanelColumns * Entries::kBytes + panels::kBytesMore;
  if (entries_.size() < most) entries_.resize(most + most / kSpareEntries);
  in_parts(companion, static_cast<int>(nodes_.size()), [&](int s) {
    Node& node = nodes_[s];
    const int rows = node.columns + node.below;
    float* head = heads_.data() + panels::kHead * node.panel_start;
    int* wide = wide_.data() + node.panel_start;
    panels::Tile* tile = tiles_.data() + node.tile_start;
    std::uint8_t* const begin = entries_.data() + node.entry_start / panels::kPanelColumns * Entries::kBytes;
    std::uint8_t* to = begin;
    for (int c = 0; c < node.columns; c += panels::kPanelColumns, head += panels::kHead, ++wide) {
      const int width = std::min(panels::kPanelColumns, node.columns - c);
      const double* const diagonal = l + value_start[s] + static_cast<std::ptrdiff_t>(c) * rows + c;
      panels::invert_block(diagonal, rows, width, head);
      panels::Panel panel{.at = diagonal + width, .stride = rows, .width = width, .below = rows - c - width};
      panel.find_scales<Entries>(head + panels::kPanelColumns * panels::kPanelColumns);
      const auto pack_tiles = [&]<typename As>(As, bool narrow) {
        for (int t = 0; t < tile_rows(panel.below); ++t) {
          const panels::Block block = panel.block(t);
          const int largest = panels::largest_in<Entries>(block);
          if ((largest < Entries::kNarrowBelow) != narrow) continue;
          to = panels::pack<As>(block, width, largest, to);
          *tile++ = {.row = static_cast<std::uint16_t>(t), .largest = static_cast<std::uint16_t>(largest)};
        }
      };
      const panels::Tile* const first = tile;
      pack_tiles(Entries(), false);
      *wide = static_cast<int>(tile - first);
      if constexpr (Entries::kNarrowBelow > 0) pack_tiles(panels::EightBits(), true);
    }
    node.packed = static_cast<std::size_t>(to - begin);
  });
}

template <typename Entries>
void CompactFactor::eliminate_node(const Node& node, float* x, float* w) const {
  float* const mine = x + node.first;
  if (std::all_of(mine, mine + node.columns, [](float value) { return value == 0; })) return;
  std::copy_n(mine, node.columns, w);
  std::fill_n(w + node.columns, node.below + panels::kPanelColumns, 0.0F);
  const float* head = heads_.data() + panels::kHead * node.panel_start;
  const int* wide = wide_.data() + node.panel_start;
  std::size_t tile = node.tile_start;
  const std::uint8_t* at = entries_.data() + node.entry_start / panels::kPanelColumns * Entries::kBytes;
  for (int c = 0; c < node.columns; c += panels::kPanelColumns, head += panels::kHead, ++wide) {
    const int width = std::min(panels::kPanelColumns, node.columns - c);
    const auto count = static_cast<std::size_t>(tile_rows(node.columns - c - width + node.below));
    const auto tiles = std::span(tiles_).subspan(tile, count);
    by_width(width, [&](auto constant) {
      at = panels::eliminate_panel<Entries, constant()>(head, at, tiles, static_cast<std::size_t>(*wide), w + c);
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
  std::fill_n(w + node.columns + node.below, panels::kPanelColumns, 0.0F);
  const int panel_count = tile_rows(node.columns);
  const float* head = heads_.data() + panels::kHead * (node.panel_start + static_cast<std::size_t>(panel_count));
  const int* wide = wide_.data() + node.panel_start + panel_count;
  std::size_t tile = node.tile_start + tiles_of(node.columns, node.below);
  const std::uint8_t* at = entries_.data() + node.entry_start / panels::kPanelColumns * Entries::kBytes + node.packed;
  for (int c = (panel_count - 1) * panels::kPanelColumns; c >= 0; c -= panels::kPanelColumns) {
    const int width = std::min(panels::kPanelColumns, node.columns - c);
    const auto count = static_cast<std::size_t>(tile_rows(node.columns - c - width + node.below));
    head -= panels::kHead;
    --wide;
    tile -= count;
    const auto tiles = std::span(tiles_).subspan(tile, count);
    by_width(width, [&](auto constant) {
      at =
          panels::substitute_back_panel<Entries, constant()>(head, at, tiles, static_cast<std::size_t>(*wide), w + c);
    });
  }
  std::copy_n(w, node.columns, mine);
}

void CompactFactor::make_room(Scratch& scratch) const {
  scratch.x.resize(static_cast<std::size_t>(dofs_) + parts_.size() * upper_rows_.size());
  if (scratch.panels.size() < parts_.size() + 1) scratch.panels.resize(parts_.size() + 1);
  const auto length = static_cast<std::size_t>(longest_ + panels::kPanelColumns);
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
