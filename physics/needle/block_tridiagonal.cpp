#include "physics/needle/block_tridiagonal.h"

#include <cmath>

namespace stylet::physics {
namespace {

using Block = BlockTridiagonal::Block;
constexpr int kSize = 6;

/// Cholesky of a block in its lower triangle. A pivot that lost all its digits to cancellation counts as not
/// positive.
bool cholesky(Block& a) {
  constexpr double kLostDigits = 1e-14;
  for (int k = 0; k < kSize; ++k) {
    const double before = a(k, k);
    double pivot = before;
    for (int j = 0; j < k; ++j) pivot -= a(k, j) * a(k, j);
    if (!(pivot > kLostDigits * std::abs(before)) || !std::isfinite(pivot)) return false;
    const double root = std::sqrt(pivot);
    a(k, k) = root;
    const double inverse = 1 / root;
    for (int i = k + 1; i < kSize; ++i) {
      double sum = a(i, k);
      for (int j = 0; j < k; ++j) sum -= a(i, j) * a(k, j);
      a(i, k) = sum * inverse;
    }
  }
  return true;
}

/// v <- G^-1 v for one column of six.
void solve_lower(const Block& g, double* v) {
  for (int r = 0; r < kSize; ++r) {
    for (int c = 0; c < r; ++c) v[r] -= g(r, c) * v[c];
    v[r] /= g(r, r);
  }
}

/// v <- G^-T v for one column of six.
void solve_lower_transposed(const Block& g, double* v) {
  for (int r = kSize - 1; r >= 0; --r) {
    for (int c = r + 1; c < kSize; ++c) v[r] -= g(c, r) * v[c];
    v[r] /= g(r, r);
  }
}

}  // namespace

BlockTridiagonal::BlockTridiagonal(int block_count)
    : diagonal_(static_cast<std::size_t>(block_count), Block::Zero()),
      upper_(static_cast<std::size_t>(block_count > 0 ? block_count - 1 : 0), Block::Zero()) {}

void BlockTridiagonal::set_zero() {
  for (Block& block : diagonal_) block.setZero();
  for (Block& block : upper_) block.setZero();
}

bool BlockTridiagonal::factorise() {
  for (std::size_t i = 0; i < diagonal_.size(); ++i) {
    if (!cholesky(diagonal_[i])) return false;
    if (i + 1 == diagonal_.size()) break;
    Block& u = upper_[i];
    for (int c = 0; c < kSize; ++c) solve_lower(diagonal_[i], u.col(c).data());
    diagonal_[i + 1] -= u.transpose().lazyProduct(u);
  }
  return true;
}

void BlockTridiagonal::solve(Eigen::Ref<Eigen::VectorXd> x) const {
  const int n = block_count();
  for (int i = 0; i < n; ++i) {
    auto xi = x.segment<kSize>(kSize * i);
    if (i > 0) xi -= upper_[i - 1].transpose().lazyProduct(x.segment<kSize>(kSize * (i - 1)));
    solve_lower(diagonal_[i], xi.data());
  }
  for (int i = n - 1; i >= 0; --i) {
    auto xi = x.segment<kSize>(kSize * i);
    if (i + 1 < n) xi -= upper_[i].lazyProduct(x.segment<kSize>(kSize * (i + 1)));
    solve_lower_transposed(diagonal_[i], xi.data());
  }
}

void BlockTridiagonal::forward_solve(double* y, std::span<const int> columns, int row_stride) const {
  using Row = Eigen::Map<Eigen::ArrayXd>;
  for (int block = 0; block < block_count(); ++block) {
    const int count = columns[block];
    if (count == 0) continue;
    const auto row = [=](int i) { return Row(y + static_cast<std::ptrdiff_t>(i) * row_stride, count); };
    const Block& g = diagonal_[block];
    for (int r = 0; r < kSize; ++r) {
      Row target = row(kSize * block + r);
      if (block > 0) {
        const auto u = upper_[block - 1].col(r);
        const int p = kSize * (block - 1);
        target -= u(0) * row(p) + u(1) * row(p + 1) + u(2) * row(p + 2) + u(3) * row(p + 3) + u(4) * row(p + 4) +
                  u(5) * row(p + 5);
      }
      for (int c = 0; c < r; ++c) target -= g(r, c) * row(kSize * block + c);
      target *= 1 / g(r, r);
    }
  }
}

}  // namespace stylet::physics
