// Files in memory.
#pragma once

#include "engine/mesh/triangle_mesh.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace stylet::import::test {

inline std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

/// A binary STL.
/// @param header  what stands first, 80 bytes of it
inline std::string binary_stl(const mesh::TriangleMesh& mesh, std::string header = "ball") {
  header.resize(80, ' ');
  std::string out = header;
  const auto append = [&](const auto& value) { out.append(reinterpret_cast<const char*>(&value), sizeof value); };
  append(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& triangle : mesh.triangles) {
    for (int i = 0; i < 3; ++i) append(0.0F);  // normals that say nothing
    for (const std::uint32_t corner : triangle) {
      for (int axis = 0; axis < 3; ++axis) append(static_cast<float>(mesh.vertices[corner][axis]));
    }
    append(std::uint16_t{0});
  }
  return out;
}

}  // namespace stylet::import::test
