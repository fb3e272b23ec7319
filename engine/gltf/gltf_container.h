// From bytes to a tinygltf model without letting the file harm us: what must be checked before and around the parser.
#pragma once

#include "engine/files/json_reader.h"
#include "engine/gltf/gltf.h"
#include "engine/gltf/gltf_buffers.h"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>

namespace tinygltf {
class Model;
}

namespace stylet::gltf {

/// A parsed glTF file: its JSON for annotations and places, its buffers, and tinygltf's model of what geometry needs
/// (scenes, nodes, meshes, materials, accessors, views). What is wrong elsewhere does not matter to a mesh.
class GltfContainer {
public:
  /// Checks the GLB frame, the depth of the JSON, version and required extensions, then parses. `bytes` must outlive
  /// this. @throws ContentError
  GltfContainer(std::span<const std::byte> bytes, const std::filesystem::path& name, const GltfLimits& limits);
  ~GltfContainer();

  const tinygltf::Model& model() const { return *model_; }
  files::JsonFile& document() { return *document_; }
  GltfBuffers& buffers() { return *buffers_; }

private:
  std::unique_ptr<files::JsonFile> document_;
  std::unique_ptr<GltfBuffers> buffers_;
  std::unique_ptr<tinygltf::Model> model_;
};

}  // namespace stylet::gltf
