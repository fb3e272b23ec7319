// The product of two packed strips of doubles: what a sparse factorisation spends its time in. Internal to it.
#pragma once

namespace stylet::physics {

inline constexpr int kStripRows = 24;
inline constexpr int kStripColumns = 8;

/// out(i, j) = sum over k of a(i, k) b(j, k), i < kStripRows, j < kStripColumns. Each entry is one chain of fused
/// multiply-adds in the order of k, so the bits do not depend on the processor's vectors.
/// @param a    [kStripRows x depth] by columns
/// @param b    [kStripColumns x depth] by columns
/// @param out  [kStripRows x kStripColumns] by columns
using TileProduct = void (*)(int depth, const double* a, const double* b, double* out);

/// The fastest here: with AVX-512 where the processor has it, else with AVX2.
TileProduct tile_product();
TileProduct tile_product_avx2();
/// Null where the processor has no AVX-512.
TileProduct tile_product_avx512();

}  // namespace stylet::physics
