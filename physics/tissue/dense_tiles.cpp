#include "physics/tissue/dense_tiles.h"

#include <immintrin.h>

namespace stylet::physics {
namespace {

// C arrays: the compilers keep these in registers.
// NOLINTBEGIN(modernize-avoid-c-arrays)

__attribute__((target("avx512f"))) void multiply_avx512(int depth, const double* a, const double* b, double* out) {
  constexpr int kWide = 8;
  constexpr int kRows = kStripRows / kWide;
  __m512d sums[kStripColumns][kRows];
  for (auto& column : sums) {
    for (__m512d& sum : column) sum = _mm512_setzero_pd();
  }
  for (int k = 0; k < depth; ++k, a += kStripRows, b += kStripColumns) {
    __m512d rows[kRows];
    for (int i = 0; i < kRows; ++i) rows[i] = _mm512_loadu_pd(a + i * kWide);
    for (int j = 0; j < kStripColumns; ++j) {
      const __m512d column = _mm512_set1_pd(b[j]);
      for (int i = 0; i < kRows; ++i) sums[j][i] = _mm512_fmadd_pd(rows[i], column, sums[j][i]);
    }
  }
  for (int j = 0; j < kStripColumns; ++j) {
    for (int i = 0; i < kRows; ++i) _mm512_storeu_pd(out + j * kStripRows + i * kWide, sums[j][i]);
  }
}

/// A part of the tile that 16 registers hold.
__attribute__((target("avx2,fma"))) inline void multiply_part_avx2(int depth, const double* a, const double* b,
                                                                   double* out) {
  constexpr int kWide = 4;
  constexpr int kRows = 3;
  constexpr int kColumns = 4;
  __m256d sums[kColumns][kRows];
  for (auto& column : sums) {
    for (__m256d& sum : column) sum = _mm256_setzero_pd();
  }
  for (int k = 0; k < depth; ++k, a += kStripRows, b += kStripColumns) {
    __m256d rows[kRows];
    for (int i = 0; i < kRows; ++i) rows[i] = _mm256_loadu_pd(a + i * kWide);
    for (int j = 0; j < kColumns; ++j) {
      const __m256d column = _mm256_broadcast_sd(b + j);
      for (int i = 0; i < kRows; ++i) sums[j][i] = _mm256_fmadd_pd(rows[i], column, sums[j][i]);
    }
  }
  for (int j = 0; j < kColumns; ++j) {
    for (int i = 0; i < kRows; ++i) _mm256_storeu_pd(out + j * kStripRows + i * kWide, sums[j][i]);
  }
}

void multiply_avx2(int depth, const double* a, const double* b, double* out) {
  for (int j = 0; j < kStripColumns; j += 4) {
    for (int i = 0; i < kStripRows; i += 12) multiply_part_avx2(depth, a + i, b + j, out + j * kStripRows + i);
  }
}

// NOLINTEND(modernize-avoid-c-arrays)

}  // namespace

TileProduct tile_product_avx2() {
  return multiply_avx2;
}

TileProduct tile_product_avx512() {
  return __builtin_cpu_supports("avx512f") != 0 ? multiply_avx512 : nullptr;
}

TileProduct tile_product() {
  static const TileProduct fastest = tile_product_avx512() != nullptr ? tile_product_avx512() : tile_product_avx2();
  return fastest;
}

}  // namespace stylet::physics
