// What the reader asks of stylet-draco (tools/draco): on its standard input one of these for each mesh, its
// compressed bytes behind it; on its standard output the plain meshes.
#pragma once

#include <cstdint>

namespace stylet::gltf {

struct DracoRequest {
  std::uint32_t position_id = 0;  ///< unique id of the attribute
  std::uint32_t vertices = 0;     ///< declared
  std::uint32_t indices = 0;      ///< declared
  std::uint32_t bytes = 0;        ///< compressed
};

/// What the program returns.
inline constexpr int kDracoBroken = 1;
inline constexpr int kDracoNotAsDeclared = 2;

}  // namespace stylet::gltf
