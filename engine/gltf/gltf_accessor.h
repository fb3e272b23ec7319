// Bounds-checked reading of glTF accessors out of a parsed but untrusted tinygltf model.
#pragma once

#include "engine/gltf/gltf.h"
#include "engine/gltf/gltf_buffers.h"

#include <Eigen/Core>

#include <cstdint>
#include <string>
#include <vector>

namespace tinygltf {
class Model;
}

namespace stylet::gltf {

/// Reads accessors of one file. Every index, view, stride and count is checked in 64 bits before a byte is touched;
/// sparse accessors are applied; an accessor without a view is zeros.
class AccessorReader {
public:
  AccessorReader(const tinygltf::Model& model, GltfBuffers& buffers, std::string file, const GltfLimits& limits);

  /// POSITION: float VEC3, or quantised integers where `quantised` says the extension is declared.
  /// @throws ContentError
  std::vector<Eigen::Vector3d> positions(int accessor, bool quantised) const;
  /// Indices: unsigned scalars, each below `vertex_count`, no restart value. @throws ContentError
  std::vector<std::uint32_t> indices(int accessor, std::size_t vertex_count) const;

private:
  struct Layout {
    int component_type = 0;
    int components = 0;
    std::size_t component_bytes = 0;
    std::size_t count = 0;
    bool normalised = false;
  };
  [[noreturn]] void fail(const std::string& place, const std::string& what) const;
  Layout layout(int accessor) const;
  /// Dense components, row by row, as doubles                                     [count * components]
  std::vector<double> values(int accessor, const Layout& layout) const;
  /// `count` elements of `bytes` each, `stride` apart (0: tight), from a view. Checked; returns the first.
  const std::byte* elements(int view, std::size_t offset, std::size_t count, std::size_t bytes, std::size_t& stride,
                            const std::string& place) const;

  const tinygltf::Model& model_;
  GltfBuffers& buffers_;
  std::string file_;
  GltfLimits limits_;
};

}  // namespace stylet::gltf
