#include "physics/tissue/supernodal_cholesky.h"

#include "physics/tissue/supernodes.h"
#include "physics/tissue/triangular_inverse.h"

#include <cholmod.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <atomic>
#include <numeric>
#include <utility>

namespace stylet::physics {
namespace {

constexpr int kColumnsAtOnce = 192;  // columns of L made at once: their packed rows stay in the second cache
constexpr int kDepthAtOnce = 192;    // columns of a descendant taken at once: a packed strip stays in the first
static_assert(kColumnsAtOnce <= kDepthAtOnce);  // a strip of a panel is packed whole
constexpr int kRowsAtOnce = 480;                // rows of an upper panel that a thread takes at once
constexpr double kHeaviestPart = 1.0 / 16;      // of the work
constexpr std::size_t kLineDoubles = 8;

int strips(int count, int width) {
  return (count + width - 1) / width;
}

/// On a boundary of cache lines.
double* aligned(std::vector<double>& storage, std::size_t size) {
  if (storage.size() < size + kLineDoubles) storage.resize(size + kLineDoubles);
  const auto address = reinterpret_cast<std::uintptr_t>(storage.data());
  return storage.data() + (-address % (kLineDoubles * sizeof(double))) / sizeof(double);
}

/// Rows of a block by columns, in strips of `Width` rows; zero where there is no row.
template <int Width>
void pack(const double* from, std::ptrdiff_t stride, int rows, int depth, double* to) {
  for (int r = 0; r < rows; r += Width) {
    const int count = std::min(Width, rows - r);
    if (count == Width) {
      for (int k = 0; k < depth; ++k, to += Width) std::copy_n(from + r + k * stride, Width, to);
    } else {
      for (int k = 0; k < depth; ++k, to += Width) {
        std::fill(std::copy_n(from + r + k * stride, count, to), to + Width, 0.0);
      }
    }
  }
}

std::vector<int> supernodes_of_columns(const cholmod_factor& factor) {
  const auto* super = static_cast<const int*>(factor.super);
  std::vector<int> of(factor.n);
  for (std::size_t s = 0; s < factor.nsuper; ++s) std::fill(of.begin() + super[s], of.begin() + super[s + 1], int(s));
  return of;
}

}  // namespace

void SupernodalCholesky::analyse(const cholmod_factor_struct& factor, const StiffnessPattern& pattern) {
  const int n = static_cast<int>(factor.n);
  const auto count = static_cast<int>(factor.nsuper);
  const std::vector<int> supernode_of = supernodes_of_columns(factor);
  const auto node = [&](int s) {
    return Supernode<double>(factor, static_cast<const double*>(factor.x), static_cast<std::size_t>(s), n);
  };

  std::vector<int> parent(count, -1);
  std::vector<std::pair<int, Update>> found;  // target, update
  for (int s = 0; s < count; ++s) {
    const Supernode<double> from = node(s);
    int last = -1;
    for (int r = from.columns; r < from.rows; ++r) {
      const int target = supernode_of[from.row[r]];
      if (target == last) continue;
      if (last < 0) parent[s] = target;
      last = target;
      found.push_back({target, {.supernode = s, .first_row = r}});
    }
  }
  update_start_.assign(count + 1, 0);
  for (const auto& [target, update] : found) ++update_start_[target + 1];
  std::partial_sum(update_start_.begin(), update_start_.end(), update_start_.begin());
  std::vector<int> next(update_start_.begin(), update_start_.end() - 1);
  updates_.resize(found.size());
  for (const auto& [target, update] : found) updates_[next[target]++] = update;

  std::vector<int> eliminated_at(n);
  for (int i = 0; i < n; ++i) eliminated_at[static_cast<const int*>(factor.Perm)[i]] = i;
  const auto each_entry = [&](const auto& with) {
    for (int c = 0; c < n; ++c) {
      for (int k = pattern.column_start()[c]; k < pattern.column_start()[c + 1]; ++k) {
        const auto [column, row] = std::minmax(eliminated_at[c], eliminated_at[pattern.rows()[k]]);
        with(k, row, column);
      }
    }
  };
  entry_start_.assign(count + 1, 0);
  each_entry([&](int, int, int column) { ++entry_start_[supernode_of[column] + 1]; });
  std::partial_sum(entry_start_.begin(), entry_start_.end(), entry_start_.begin());
  next.assign(entry_start_.begin(), entry_start_.end() - 1);
  entries_.resize(pattern.nonzeros());
  std::vector<std::pair<int, int>> at(pattern.nonzeros());  // row, column
  each_entry([&](int k, int row, int column) {
    const int e = next[supernode_of[column]]++;
    entries_[e].value = static_cast<std::uint32_t>(k);
    at[e] = {row, column};
  });
  std::vector<int> place(n);
  for (int s = 0; s < count; ++s) {
    const Supernode<double> to = node(s);
    for (int r = 0; r < to.rows; ++r) place[to.row[r]] = r;
    for (int e = entry_start_[s]; e < entry_start_[s + 1]; ++e) {
      entries_[e].place = static_cast<std::uint32_t>((at[e].second - to.first) * to.rows + place[at[e].first]);
    }
  }
  cut(factor, parent);
}

void SupernodalCholesky::cut(const cholmod_factor_struct& factor, std::span<const int> parent) {
  const auto count = static_cast<int>(parent.size());
  std::vector<double> work(count, 0);  // of the whole subtree
  std::vector<std::vector<int>> children(count);
  std::vector<int> roots;
  for (int s = 0; s < count; ++s) {  // children come before their parents
    const Supernode<double> node(factor, static_cast<const double*>(factor.x), static_cast<std::size_t>(s),
                                 static_cast<int>(factor.n));
    for (int c = 0; c < node.columns; ++c) work[s] += double(node.rows - c) * double(node.rows - c);
    if (parent[s] < 0) {
      roots.push_back(s);
    } else {
      work[parent[s]] += work[s];
      children[parent[s]].push_back(s);
    }
  }
  flops_ = 0;
  for (const int root : roots) flops_ += work[root];
  const auto heavier = [&](int a, int b) { return std::pair(work[a], a) > std::pair(work[b], b); };
  std::sort(roots.begin(), roots.end(), heavier);
  upper_.clear();
  while (!roots.empty() && work[roots.front()] > kHeaviestPart * flops_) {
    const int root = roots.front();
    upper_.push_back(root);
    roots.erase(roots.begin());
    roots.insert(roots.end(), children[root].begin(), children[root].end());
    std::sort(roots.begin(), roots.end(), heavier);
  }
  std::sort(upper_.begin(), upper_.end());

  // Small subtrees go together, the heaviest part first: who is done early finds another one.
  std::vector<int> part_of(count, -1);
  parts_.clear();
  double filled = 2 * flops_;
  for (const int root : roots) {
    if (filled + work[root] > kHeaviestPart * flops_) {
      parts_.emplace_back();
      filled = 0;
    }
    filled += work[root];
    part_of[root] = static_cast<int>(parts_.size()) - 1;
  }
  for (int s = count; s-- > 0;) {
    if (part_of[s] < 0 && parent[s] >= 0) part_of[s] = part_of[parent[s]];
  }
  for (int s = 0; s < count; ++s) {
    if (part_of[s] >= 0) parts_[part_of[s]].push_back(s);
  }
}

/// One factorisation.
class SupernodalCholesky::Numbers {
public:
  Numbers(const SupernodalCholesky& symbols, cholmod_factor& factor, std::span<const double> values,
          TileProduct product)
      : symbols_(symbols), factor_(factor), l_(static_cast<double*>(factor.x)), values_(values), product_(product) {}

  Supernode<double> node(int s) const {
    return {factor_, l_, static_cast<std::size_t>(s), static_cast<int>(factor_.n)};
  }
  double* numbers(const Supernode<double>& node) const { return l_ + (node.value - l_); }

  void find_places(const Supernode<double>& node, std::vector<int>& place) const {
    for (int r = 0; r < node.rows; ++r) place[node.row[r]] = r;
  }
  void clear(const Supernode<double>& node, int column, int width) const {
    std::fill_n(numbers(node) + static_cast<std::ptrdiff_t>(column) * node.rows,
                static_cast<std::ptrdiff_t>(width) * node.rows, 0.0);
  }
  void fill_in(int s) const {
    double* to = numbers(node(s));
    for (int e = symbols_.entry_start_[s]; e < symbols_.entry_start_[s + 1]; ++e) {
      to[symbols_.entries_[e].place] = values_[symbols_.entries_[e].value];
    }
  }

  /// What the columns before do to rows [from, to) of columns [column, column + width) of a supernode.
  void update(int s, int column, int width, int from, int to, const std::vector<int>& place,
              Scratch::Part& scratch) const {
    const Supernode<double> mine = node(s);
    for (int u = symbols_.update_start_[s]; u < symbols_.update_start_[s + 1]; ++u) {
      const Supernode<double> other = node(symbols_.updates_[u].supernode);
      const int* const end = other.row + other.rows;
      const auto before = [&](int row, int position) { return place[row] < position; };
      const int* const first = std::lower_bound(other.row + symbols_.updates_[u].first_row, end, column, before);
      const int* const last = std::lower_bound(first, end, column + width, before);
      if (first == last) continue;
      const int* const low = std::lower_bound(first, end, from, before);
      const int* const high = std::lower_bound(low, end, to, before);
      if (low == high) continue;
      subtract(mine, other, other.columns, static_cast<int>(low - other.row), static_cast<int>(high - low),
               static_cast<int>(first - other.row), static_cast<int>(last - first), place.data(), scratch);
    }
    from = std::max(from, column);
    if (from < to) subtract(mine, mine, column, from, to - from, column, width, nullptr, scratch);
  }

  /// The diagonal block of columns [column, column + width) is L L^T: L in place, and its inverse, packed.
  bool factorise_block(const Supernode<double>& node, int column, int width, std::vector<double>& inverse) const {
    Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>> block(
        numbers(node) + static_cast<std::ptrdiff_t>(column) * node.rows + column, width, width,
        Eigen::OuterStride<>(node.rows));
    const Eigen::LLT<Eigen::MatrixXd> cholesky(block);
    if (cholesky.info() != Eigen::Success || !cholesky.matrixLLT().diagonal().allFinite()) return false;
    Eigen::MatrixXd inverted = cholesky.matrixL();
    block = inverted;
    invert_lower_triangle(inverted);
    pack<kStripColumns>(inverted.data(), width, width, width,
                        aligned(inverse, static_cast<std::size_t>(kColumnsAtOnce) * kColumnsAtOnce));
    return true;
  }

  /// Rows [from, to), below the diagonal block, times its inverse.
  void solve_rows(const Supernode<double>& node, int column, int width, int from, int to,
                  std::vector<double>& inverse, Scratch::Part& scratch) const {
    double* const rows = aligned(scratch.rows, static_cast<std::size_t>(kStripRows) * kDepthAtOnce);
    const double* const packed = aligned(inverse, static_cast<std::size_t>(kColumnsAtOnce) * kColumnsAtOnce);
    alignas(64) std::array<double, kStripRows * kStripColumns> tile;
    for (int r = from; r < to; r += kStripRows) {
      const int count = std::min(kStripRows, to - r);
      double* const block = numbers(node) + static_cast<std::ptrdiff_t>(column) * node.rows + r;
      pack<kStripRows>(block, node.rows, count, width, rows);
      for (int c = 0; c < width; c += kStripColumns) {
        const int columns = std::min(kStripColumns, width - c);
        product_(c + columns, rows, packed + static_cast<std::ptrdiff_t>(c) * width, tile.data());
        for (int j = 0; j < columns; ++j) {
          std::copy_n(tile.data() + j * kStripRows, count, block + static_cast<std::ptrdiff_t>(c + j) * node.rows);
        }
      }
    }
  }

  /// All of a supernode whose descendants are done, by one thread.
  bool make(int s, Scratch::Part& scratch, std::vector<double>& inverse) const {
    const Supernode<double> mine = node(s);
    find_places(mine, scratch.place);
    clear(mine, 0, mine.columns);
    fill_in(s);
    for (int c = 0; c < mine.columns; c += kColumnsAtOnce) {
      const int width = std::min(kColumnsAtOnce, mine.columns - c);
      update(s, c, width, c, mine.rows, scratch.place, scratch);
      if (!factorise_block(mine, c, width, inverse)) return false;
      solve_rows(mine, c, width, c + width, mine.rows, inverse, scratch);
    }
    return true;
  }

  /// The same by two.
  bool make(int s, Scratch& scratch, Companion* companion) const {
    const Supernode<double> mine = node(s);
    std::vector<int>& place = scratch.parts[0].place;
    find_places(mine, place);
    in_parts(companion, strips(mine.columns, kColumnsAtOnce), [&](int part) {
      const int c = part * kColumnsAtOnce;
      clear(mine, c, std::min(kColumnsAtOnce, mine.columns - c));
    });
    fill_in(s);
    for (int c = 0; c < mine.columns; c += kColumnsAtOnce) {
      const int width = std::min(kColumnsAtOnce, mine.columns - c);
      const auto by_rows = [&](int begin, const auto& with) {
        in_parts(companion, strips(mine.rows - begin, kRowsAtOnce), [&](int part) {
          const int from = begin + part * kRowsAtOnce;
          with(from, std::min(from + kRowsAtOnce, mine.rows), scratch.parts[part]);
        });
      };
      by_rows(c,
              [&](int from, int to, Scratch::Part& mine_alone) { update(s, c, width, from, to, place, mine_alone); });
      if (!factorise_block(mine, c, width, scratch.inverse)) return false;
      by_rows(c + width, [&](int from, int to, Scratch::Part& mine_alone) {
        solve_rows(mine, c, width, from, to, scratch.inverse, mine_alone);
      });
    }
    return true;
  }

private:
  /// Rows of `mine` -= rows of `other` times rows of `other`, transposed, over its first `depth` columns.
  /// @param place  where a row of `other` is in `mine`; null where they are the same
  void subtract(const Supernode<double>& mine, const Supernode<double>& other, int depth, int row, int rows,
                int column, int columns, const int* place, Scratch::Part& scratch) const {
    const auto place_of = [&](int r) { return place == nullptr ? r : place[other.row[r]]; };
    double* const to = numbers(mine);
    double* const packed_row = aligned(scratch.rows, static_cast<std::size_t>(kStripRows) * kDepthAtOnce);
    double* const packed_columns = aligned(scratch.columns, static_cast<std::size_t>(kColumnsAtOnce) * kDepthAtOnce);
    alignas(64) std::array<double, kStripRows * kStripColumns> tile;
    std::array<int, kStripRows> places{};
    for (int k = 0; k < depth; k += kDepthAtOnce) {
      const int deep = std::min(kDepthAtOnce, depth - k);
      const double* const from = other.value + static_cast<std::ptrdiff_t>(k) * other.rows;
      pack<kStripColumns>(from + column, other.rows, columns, deep, packed_columns);
      for (int r = row; r < row + rows; r += kStripRows) {
        const int count = std::min(kStripRows, row + rows - r);
        const int first = place_of(r);
        const int last = place_of(r + count - 1);
        const bool together = last - first == count - 1;
        if (!together) {
          for (int i = 0; i < count; ++i) places[i] = place_of(r + i);
        }
        pack<kStripRows>(from + r, other.rows, count, deep, packed_row);
        for (int c = 0; c < columns; c += kStripColumns) {
          if (last < place_of(column + c)) break;  // above the diagonal
          product_(deep, packed_row, packed_columns + static_cast<std::ptrdiff_t>(c) * deep, tile.data());
          const int wide = std::min(kStripColumns, columns - c);
          for (int j = 0; j < wide; ++j) {
            double* const out = to + static_cast<std::ptrdiff_t>(place_of(column + c + j)) * mine.rows;
            const double* const sums = tile.data() + static_cast<std::ptrdiff_t>(j) * kStripRows;
            if (together) {
              for (int i = 0; i < count; ++i) out[first + i] -= sums[i];
            } else {
              for (int i = 0; i < count; ++i) out[places[i]] -= sums[i];
            }
          }
        }
      }
    }
  }

  const SupernodalCholesky& symbols_;
  cholmod_factor& factor_;
  double* l_;
  std::span<const double> values_;
  TileProduct product_;
};

bool SupernodalCholesky::factorise(cholmod_factor_struct& factor, std::span<const double> values, Scratch& scratch,
                                   Companion* companion, TileProduct product) const {
  const Numbers numbers(*this, factor, values, product);
  int longest = 0;
  for (const int s : upper_) longest = std::max(longest, numbers.node(s).rows);
  scratch.parts.resize(
      std::max({parts_.size(), static_cast<std::size_t>(strips(longest, kRowsAtOnce)), std::size_t{1}}));
  for (Scratch::Part& part : scratch.parts) part.place.resize(factor.n);

  std::atomic<bool> definite{true};
  in_parts(companion, static_cast<int>(parts_.size()), [&](int part) {
    std::vector<double> inverse;
    for (const int s : parts_[part]) {
      if (!numbers.make(s, scratch.parts[part], inverse)) definite.store(false, std::memory_order_relaxed);
      if (!definite.load(std::memory_order_relaxed)) return;
    }
  });
  if (!definite.load()) return false;
  return std::all_of(upper_.begin(), upper_.end(), [&](int s) { return numbers.make(s, scratch, companion); });
}

}  // namespace stylet::physics
