// The scatterers of the tissue: random fields over rest space, so that speckle moves and strains with the tissue.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace stylet::ultrasound {

/// Periodic cube of kSpeckleSize^3 texels, kSpeckleSpacing apart (shaders/ultrasound_shared.h). A texel is 8 signed
/// bytes, kSpeckleScale standard deviations at full scale:
///   [2k], [2k + 1]  real and imaginary part of look k: complex circular Gaussian, correlated over kSpeckleFwhm
///   [6]             slow texture of the parenchyma, correlated over about 2.6 mm
///   [7]             beads along interfaces, correlated over about 1.9 mm
///   The parts of a look have variance 1 each; channels 6 and 7 have variance 1.
/// Texel of a rest position x: floor(R x / kSpeckleSpacing) mod kSpeckleSize, R the rotation of the shared header.
struct SpeckleField {
  std::vector<std::array<std::int8_t, 8>> texels;  ///< see index()

  /// The same seed gives the same bytes on every machine.
  explicit SpeckleField(std::uint32_t seed);

  /// Place of texel (x, y, z), each in [0, kSpeckleSize), in `texels`: bricks of 2 x 2 x 2, a cache line each, so
  /// that neighbours in any direction are near in memory.
  static std::size_t index(int x, int y, int z);
};

}  // namespace stylet::ultrasound
