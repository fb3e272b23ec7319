#include "engine/gltf/gltf_writer.h"

#include <tiny_gltf.h>

#include <cmath>
#include <cstring>
#include <sstream>
#include <stdexcept>

namespace stylet::gltf {
namespace {

template <typename T>
int add_view(tinygltf::Model& model, const std::vector<T>& data, int target) {
  tinygltf::Buffer& buffer = model.buffers[0];
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = buffer.data.size();
  view.byteLength = data.size() * sizeof(T);
  view.target = target;
  buffer.data.resize(view.byteOffset + view.byteLength);
  std::memcpy(buffer.data.data() + view.byteOffset, data.data(), view.byteLength);
  model.bufferViews.push_back(view);
  return static_cast<int>(model.bufferViews.size()) - 1;
}

tinygltf::Value::Object organ_extras(const AnnotatedSurface& organ) {
  tinygltf::Value::Object annotation;
  annotation["id"] = tinygltf::Value(organ.name);
  annotation["role"] = tinygltf::Value(organ.role);
  annotation["deformable"] = tinygltf::Value(!organ.body.empty());
  if (!organ.body.empty()) annotation["body"] = tinygltf::Value(organ.body);
  return {{"organ", tinygltf::Value(annotation)}};
}

tinygltf::Value::Object tissue_extras(const std::string& preset) {
  tinygltf::Value::Object annotation;
  annotation["version"] = tinygltf::Value(1);
  annotation["preset"] = tinygltf::Value(preset);
  return {{"tissue", tinygltf::Value(annotation)}};
}

int add_mesh(tinygltf::Model& model, const AnnotatedSurface& organ, int material) {
  std::vector<float> positions;
  std::vector<double> low(3, INFINITY);
  std::vector<double> high(3, -INFINITY);
  for (const Eigen::Vector3d& x : organ.mesh.vertices) {
    for (int axis = 0; axis < 3; ++axis) {
      // Whole micrometres: last-bit differences of another machine's library vanish.
      positions.push_back(static_cast<float>(std::round(x[axis] * 1e6) * 1e-6));
      low[axis] = std::min<double>(low[axis], positions.back());
      high[axis] = std::max<double>(high[axis], positions.back());
    }
  }
  std::vector<std::uint32_t> indices;
  for (const auto& t : organ.mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());

  tinygltf::Accessor position;
  position.bufferView = add_view(model, positions, TINYGLTF_TARGET_ARRAY_BUFFER);
  position.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
  position.type = TINYGLTF_TYPE_VEC3;
  position.count = organ.mesh.vertices.size();
  position.minValues = low;
  position.maxValues = high;
  tinygltf::Accessor index;
  index.bufferView = add_view(model, indices, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  index.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  index.type = TINYGLTF_TYPE_SCALAR;
  index.count = indices.size();
  model.accessors.push_back(position);
  model.accessors.push_back(index);

  tinygltf::Primitive primitive;
  primitive.attributes["POSITION"] = static_cast<int>(model.accessors.size()) - 2;
  primitive.indices = static_cast<int>(model.accessors.size()) - 1;
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
  primitive.material = material;
  tinygltf::Mesh mesh;
  mesh.name = organ.name;
  mesh.primitives.push_back(primitive);
  model.meshes.push_back(mesh);
  return static_cast<int>(model.meshes.size()) - 1;
}

}  // namespace

std::vector<std::byte> write_glb(std::span<const AnnotatedSurface> organs, const TissueColours& colours,
                                 const GlbAsset& asset) {
  tinygltf::Model model;
  model.asset.version = "2.0";
  model.asset.generator = asset.generator;
  model.asset.copyright = asset.copyright;
  model.buffers.emplace_back();
  tinygltf::Scene scene;
  scene.name = asset.scene;
  std::map<std::string, int> material_of;
  for (const AnnotatedSurface& organ : organs) {
    const auto [entry, fresh] = material_of.try_emplace(organ.tissue, static_cast<int>(model.materials.size()));
    if (fresh) {
      const auto known = colours.find(organ.tissue);
      const std::array<float, 4> colour = known != colours.end() ? known->second : std::array{0.8F, 0.8F, 0.8F, 1.0F};
      tinygltf::Material material;
      material.name = organ.tissue;
      material.pbrMetallicRoughness.baseColorFactor = {colour[0], colour[1], colour[2], colour[3]};
      material.pbrMetallicRoughness.metallicFactor = 0;
      material.pbrMetallicRoughness.roughnessFactor = 0.5;
      if (colour[3] < 1) material.alphaMode = "BLEND";
      if (!organ.tissue.empty()) material.extras = tinygltf::Value(tissue_extras(organ.tissue));
      model.materials.push_back(material);
    }
    tinygltf::Node node;
    node.name = organ.name;
    node.mesh = add_mesh(model, organ, entry->second);
    node.extras = tinygltf::Value(organ_extras(organ));
    model.nodes.push_back(node);
    scene.nodes.push_back(static_cast<int>(model.nodes.size()) - 1);
  }
  model.scenes.push_back(scene);
  model.defaultScene = 0;

  std::ostringstream stream;
  tinygltf::TinyGLTF writer;
  if (!writer.WriteGltfSceneToStream(&model, stream, false, true)) throw std::runtime_error("glTF writer failed");
  const std::string text = stream.str();
  std::vector<std::byte> bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

}  // namespace stylet::gltf
