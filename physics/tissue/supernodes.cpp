#include "physics/tissue/supernodes.h"

#include <immintrin.h>

#include <array>
#include <cmath>

namespace stylet::physics {
namespace {

constexpr int kDoubles = 4;        // a vector
constexpr int kVectorsOfTile = 3;  // rows at once, in vectors
constexpr int kColumnsOfTile = 4;  // of y: with as many vectors of rows their sums fill the registers

// NOLINTBEGIN(modernize-avoid-c-arrays): the compilers keep these in registers.

/// w(:, j) -= l(:, k) x(k, j): `Vectors` vectors of rows, `Columns` columns.
/// @param x  [depth x Columns] by rows
template <int Vectors, int Columns>
void subtract_tile(int depth, const double* l, std::ptrdiff_t l_stride, const double* x, double* w,
                   std::ptrdiff_t w_stride) {
  __m256d sums[Columns][Vectors];
  for (int j = 0; j < Columns; ++j) {
    for (int i = 0; i < Vectors; ++i) sums[j][i] = _mm256_loadu_pd(w + j * w_stride + i * kDoubles);
  }
  for (int k = 0; k < depth; ++k, l += l_stride, x += Columns) {
    __m256d rows[Vectors];
    for (int i = 0; i < Vectors; ++i) rows[i] = _mm256_loadu_pd(l + i * kDoubles);
    for (int j = 0; j < Columns; ++j) {
      const __m256d factor = _mm256_broadcast_sd(x + j);
      for (int i = 0; i < Vectors; ++i) sums[j][i] = _mm256_fnmadd_pd(rows[i], factor, sums[j][i]);
    }
  }
  for (int j = 0; j < Columns; ++j) {
    for (int i = 0; i < Vectors; ++i) _mm256_storeu_pd(w + j * w_stride + i * kDoubles, sums[j][i]);
  }
}

// NOLINTEND(modernize-avoid-c-arrays)

template <int Columns>
void subtract_rows(int rows, int depth, const double* l, std::ptrdiff_t l_stride, const double* x, double* w,
                   std::ptrdiff_t w_stride) {
  int i = 0;
  for (; i + kVectorsOfTile * kDoubles <= rows; i += kVectorsOfTile * kDoubles)
    subtract_tile<kVectorsOfTile, Columns>(depth, l + i, l_stride, x, w + i, w_stride);
  for (; i + kDoubles <= rows; i += kDoubles) subtract_tile<1, Columns>(depth, l + i, l_stride, x, w + i, w_stride);
  for (; i < rows; ++i) {
    for (int j = 0; j < Columns; ++j) {
      double& sum = w[j * w_stride + i];
      for (int k = 0; k < depth; ++k) sum = std::fma(-l[k * l_stride + i], x[k * Columns + j], sum);
    }
  }
}

using Subtract = void (*)(int, int, const double*, std::ptrdiff_t, const double*, double*, std::ptrdiff_t);
constexpr std::array<Subtract, kColumnsOfTile> kSubtract{subtract_rows<1>, subtract_rows<2>, subtract_rows<3>,
                                                         subtract_rows<4>};
constexpr int kRowsOfBand = 60;  // rows whose panel stays in a core's first cache while all columns take their turn

}  // namespace

void eliminate_columns(const Supernode<double>& node, Eigen::Ref<Eigen::MatrixXd> y, std::vector<double>& scratch) {
  const auto columns = static_cast<int>(y.cols());
  const auto size = static_cast<std::size_t>(node.rows + kPanel) * static_cast<std::size_t>(columns);
  if (scratch.size() < size) scratch.resize(size);
  Eigen::Map<Eigen::MatrixXd> w(scratch.data(), node.rows, columns);
  double* const x = scratch.data() + w.size();  // of a panel, group by group of kColumnsOfTile
  w.topRows(node.columns) = y.middleRows(node.first, node.columns);
  w.bottomRows(node.rows - node.columns).setZero();
  for (int c = 0; c < node.columns; c += kPanel) {
    const int width = std::min(kPanel, node.columns - c);
    const auto l = node.panel(c, width);
    for (int j = 0; j < columns; ++j) {
      const int group = j / kColumnsOfTile * kColumnsOfTile;
      const int in_group = std::min(kColumnsOfTile, columns - group);
      for (int k = 0; k < width; ++k) {
        const double value = w(c + k, j) /= l(k, k);
        for (int i = k + 1; i < width; ++i) w(c + i, j) = std::fma(-l(i, k), value, w(c + i, j));
        x[width * group + k * in_group + j - group] = value;
      }
    }
    for (int begin = c + width; begin < node.rows; begin += kRowsOfBand) {
      const int rows = std::min(kRowsOfBand, node.rows - begin);
      for (int group = 0; group < columns; group += kColumnsOfTile) {
        const auto in_group = static_cast<std::size_t>(std::min(kColumnsOfTile, columns - group));
        kSubtract[in_group - 1](rows, width, l.data() + (begin - c), l.outerStride(), x + width * group,
                                &w(begin, group), w.outerStride());
      }
    }
  }
  y.middleRows(node.first, node.columns) = w.topRows(node.columns);
  for (int j = 0; j < columns; ++j) {
    for (int i = node.columns; i < node.rows; ++i) y(node.row[i], j) += w(i, j);
  }
}

}  // namespace stylet::physics
