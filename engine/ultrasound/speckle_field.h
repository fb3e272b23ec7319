// The scatterers of the tissue: random fields over rest space, so that speckle moves and strains with the tissue.
#pragma once

#include "shaders/ultrasound_shared.h"

#include <Eigen/Core>

#include <array>
#include <complex>
#include <cstdint>
#include <vector>

namespace stylet::ultrasound {

/// Fields over boxes of texels, kSpeckleSpacing apart (shaders/ultrasound_shared.h). A texel is a pair of signed
/// bytes, kSpeckleScale standard deviations at full scale; all have variance 1:
///   looks  real and imaginary part: complex circular Gaussian, correlated over kSpeckleFwhm. kSpeckleSize^3 texels
///   slow   texture of the parenchyma, correlated over kTextureFwhm, and beads along interfaces, over kBeadFwhm.
///          kSlowSize^2 kSlowDepth texels, periodic
/// Lattice of a rest position x: R x / kSpeckleSpacing, R the rotation of the shared header.
struct SpeckleField {
  using Texel = std::array<std::int8_t, 2>;
  std::vector<Texel> texels;  ///< looks [kMaxLooks][kSpeckleTexels], then slow [kSlowTexels]

  /// The same seed gives the same bytes on every machine.
  explicit SpeckleField(std::uint32_t seed);

  /// Place of a cell of the lattice within a look. The box is repeated without end, each time shifted at random: what
  /// is seen of it stays small in memory and never looks like a pattern; across its faces speckle does not go on.
  static std::size_t texel(const Eigen::Vector3i& cell);
  /// The same within the slow fields, which go on.
  static std::size_t slow_texel(const Eigen::Vector3i& cell);
  /// The two numbers of a texel, in standard deviations.
  std::complex<float> look(int look, std::size_t texel) const {
    return pair(look * std::size_t{kSpeckleTexels} + texel);
  }
  std::complex<float> slow(std::size_t texel) const { return pair(kMaxLooks * std::size_t{kSpeckleTexels} + texel); }

private:
  std::complex<float> pair(std::size_t index) const {
    const Texel& texel = texels[index];
    return kSpeckleScale / 127.0F * std::complex<float>(texel[0], texel[1]);
  }
};

/// PCG output permutation (O'Neill 2014): random bits of a counter.
std::uint32_t hash(std::uint32_t x);

}  // namespace stylet::ultrasound
