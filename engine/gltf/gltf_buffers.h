// The buffers of a glTF file: the BIN chunk of a GLB, base64 in the JSON, or files of its own folder.
#pragma once

#include "engine/files/json_reader.h"

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace stylet::gltf {

/// Every buffer with a URI is read at once, used or not: one that cannot be is a broken or a hostile file. Those
/// without (place holders of compression extensions, the BIN chunk) matter only where triangles need them.
class GltfBuffers {
public:
  /// @param binary     BIN chunk of a GLB, must outlive this; empty: none
  /// @param max_bytes  of all buffers that are loaded together
  /// @throws ContentError
  GltfBuffers(const files::JsonFile& document, std::span<const std::byte> binary, std::size_t max_bytes);

  std::size_t size() const { return buffers_.size(); }
  /// byteLength bytes of buffer `index`, which is below size(). @throws ContentError
  std::span<const std::byte> bytes(std::size_t index) const;
  /// Adds a buffer. @returns its index
  std::size_t add(std::vector<std::byte> bytes);

private:
  struct Buffer {
    std::vector<std::byte> loaded;  ///< from its URI
    std::size_t length = 0;         ///< byteLength
    bool has_uri = false;
  };
  [[noreturn]] void fail(std::size_t index, const std::string& what) const;
  std::vector<std::byte> load(std::size_t index, const std::string& uri, std::size_t max_bytes) const;

  std::filesystem::path file_;
  std::span<const std::byte> binary_;
  std::vector<Buffer> buffers_;
};

}  // namespace stylet::gltf
