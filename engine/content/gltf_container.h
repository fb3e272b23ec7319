// From bytes to a tinygltf model without letting the file harm us: what must be checked before and around the parser.
#pragma once

#include "engine/content/gltf.h"
#include "engine/content/gltf_buffers.h"
#include "engine/content/json_reader.h"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>

namespace tinygltf {
class Model;
}

namespace stylet::content {

/// A parsed glTF file: its JSON for annotations and places, its buffers, and tinygltf's model of what geometry needs
/// (scenes, nodes, meshes, materials, accessors, views). What is wrong elsewhere does not matter to a mesh.
class GltfContainer {
public:
  /// Checks the GLB frame, the depth of the JSON, version and required extensions, then parses. `bytes` must outlive
  /// this. @throws ContentError
  GltfContainer(std::span<const std::byte> bytes, const std::filesystem::path& name, const GltfLimits& limits);
  ~GltfContainer();

  const tinygltf::Model& model() const { return *model_; }
  JsonFile& document() { return *document_; }
  GltfBuffers& buffers() { return *buffers_; }

private:
  std::unique_ptr<JsonFile> document_;
  std::unique_ptr<GltfBuffers> buffers_;
  std::unique_ptr<tinygltf::Model> model_;
};

}  // namespace stylet::content
