#include "engine/gltf/gltf.h"

#include "engine/content/tissue_table.h"
#include "engine/files/json_reader.h"
#include "engine/files/json_scan.h"
#include "engine/gltf/gltf_accessor.h"
#include "engine/gltf/gltf_container.h"

#include <fmt/format.h>
#include <tiny_gltf.h>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

namespace stylet::gltf {
namespace {

/// Builds a GltfScene from a parsed model, trusting none of its indices.
class SceneBuilder {
public:
  SceneBuilder(GltfContainer& container, const GltfLimits& limits, const files::Pulse& pulse)
      : model_(container.model()),
        document_(container.document()),
        limits_(limits),
        pulse_(pulse),
        reader_(model_, container.buffers(), document_.path().string(), limits) {
    for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
      const auto found = document_.tree().find(list);
      if (found == document_.tree().end() || !found->is_array()) continue;
      quantised_ = quantised_ || std::ranges::find(*found, "KHR_mesh_quantization") != found->end();
    }
  }

  GltfScene build() {
    for (const int root : roots()) walk(root);
    if (scene_.organs.empty()) {
      const bool unplaced = !model_.meshes.empty() &&
                            std::ranges::none_of(model_.nodes, [](const auto& node) { return node.mesh != -1; });
      fail("scenes", unplaced
                         ? fmt::format("the file has {} mesh(es), but no node that places one: give each a node, "
                                       "or leave out \"scenes\"",
                                       model_.meshes.size())
                         : "no node has triangles; export the organs as triangle meshes");
    }
    document_.throw_problems();
    return std::move(scene_);
  }

private:
  [[noreturn]] void fail(const std::string& place, const std::string& what) const {
    throw files::ContentError(fmt::format("{}:/{}: {}", document_.path().string(), place, what));
  }

  void warn(const std::string& place, const std::string& what) {
    if (scene_.warnings.size() < 100) {
      scene_.warnings.push_back(fmt::format("{}:/{}: {}", document_.path().string(), place, what));
    }
  }

  std::vector<int> roots() const {
    if (!model_.scenes.empty() || model_.defaultScene != -1) {
      const int scene = model_.defaultScene == -1 ? 0 : model_.defaultScene;
      if (scene < 0 || static_cast<std::size_t>(scene) >= model_.scenes.size()) {
        fail("scene", fmt::format("is {}, the file has {} scenes; export it again", scene, model_.scenes.size()));
      }
      return model_.scenes[scene].nodes;
    }
    std::vector<bool> child(model_.nodes.size(), false);  // no scene: every node that nobody owns
    for (const auto& node : model_.nodes) {
      for (const int c : node.children) {
        if (c >= 0 && static_cast<std::size_t>(c) < child.size()) child[c] = true;
      }
    }
    std::vector<int> out;
    for (std::size_t i = 0; i < child.size(); ++i) {
      if (!child[i]) out.push_back(static_cast<int>(i));
    }
    return out;
  }

  /// Depth first without recursion; a node met twice is a cycle or has two parents.
  void walk(int root) {
    struct Visit {
      int node;
      int depth;
      Eigen::Affine3d patient_from_parent;
    };
    std::vector<Visit> stack{{root, 1, Eigen::Affine3d::Identity()}};
    visited_.resize(model_.nodes.size(), false);
    while (!stack.empty()) {
      pulse_(64);
      const Visit visit = stack.back();
      stack.pop_back();
      const std::string place = fmt::format("nodes/{}", visit.node);
      if (visit.node < 0 || static_cast<std::size_t>(visit.node) >= model_.nodes.size()) {
        fail(place, fmt::format("there is no such node, the file has {}; export it again", model_.nodes.size()));
      }
      const std::size_t index = static_cast<std::size_t>(visit.node);
      if (visited_[index]) fail(place, "is reached twice: a cycle, or two parents; a node has one parent");
      visited_[index] = true;
      if (visit.depth > limits_.node_depth) {
        fail(place, fmt::format("is nested deeper than {} nodes; flatten the hierarchy", limits_.node_depth));
      }
      if (++instances_ > limits_.instances)
        fail(place, fmt::format("the scene has more than {} nodes; split it", limits_.instances));
      const auto& node = model_.nodes[index];
      const Eigen::Affine3d patient_from_node = visit.patient_from_parent * transform(node, place);
      check_volume(patient_from_node, place, "with its parents its transform");
      if (node.mesh != -1) add_organ(visit.node, patient_from_node);
      for (auto child = node.children.rbegin(); child != node.children.rend(); ++child) {
        stack.push_back({*child, visit.depth + 1, patient_from_node});
      }
    }
  }

  Eigen::Affine3d transform(const tinygltf::Node& node, const std::string& place) const {
    const auto check = [&](const std::vector<double>& values, std::size_t count, const char* key) {
      if (!values.empty() && values.size() != count) {
        fail(place + "/" + key, fmt::format("has {} numbers, expected {}", values.size(), count));
      }
      for (const double value : values) {
        if (!std::isfinite(value)) fail(place + "/" + key, "is not finite; export it again");
      }
      return !values.empty();
    };
    Eigen::Affine3d out = Eigen::Affine3d::Identity();
    if (check(node.matrix, 16, "matrix")) {
      out.matrix() = Eigen::Map<const Eigen::Matrix4d>(node.matrix.data());
      if ((out.matrix().row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-6) {
        fail(place + "/matrix", "is not affine: its last row is not 0 0 0 1");
      }
    } else {
      if (check(node.translation, 3, "translation")) {
        out.translate(Eigen::Map<const Eigen::Vector3d>(node.translation.data()));
      }
      if (check(node.rotation, 4, "rotation")) {
        const Eigen::Quaterniond q(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
        if (q.norm() < 1e-6) fail(place + "/rotation", "is a zero quaternion; export it again");
        out.rotate(q.normalized());
      }
      if (check(node.scale, 3, "scale")) out.scale(Eigen::Map<const Eigen::Vector3d>(node.scale.data()));
    }
    check_volume(out, place, "its transform");
    return out;
  }

  void check_volume(const Eigen::Affine3d& transform, const std::string& place, const char* what) const {
    const double volume = std::abs(transform.linear().determinant());
    if (volume > 1e-15 && volume < 1e15) return;
    fail(place,
         fmt::format("{} scales volumes by {:g}: singular or absurd; apply it and export again", what, volume));
  }

  void add_organ(int node_index, const Eigen::Affine3d& patient_from_node) {
    const auto& node = model_.nodes[node_index];
    GltfOrgan organ;
    organ.place = fmt::format("nodes/{}", node_index);
    if (node.mesh < 0 || static_cast<std::size_t>(node.mesh) >= model_.meshes.size()) {
      fail(organ.place + "/mesh",
           fmt::format("is {}, the file has {} meshes; export it again", node.mesh, model_.meshes.size()));
    }
    const auto& mesh = model_.meshes[node.mesh];
    organ.name = node.name.empty() ? mesh.name : node.name;  // tools that split a node name only the upper one
    if (organ.name.empty()) organ.name = fmt::format("node_{}", node_index);
    organ.name = files::one_line(organ.name);
    if (mesh.primitives.empty()) fail(fmt::format("meshes/{}/primitives", node.mesh), "is empty; export it again");

    int material = -1;
    for (std::size_t p = 0; p < mesh.primitives.size(); ++p) {
      add_primitive(mesh.primitives[p], fmt::format("meshes/{}/primitives/{}", node.mesh, p), patient_from_node,
                    organ.mesh);
      if (material < 0) material = mesh.primitives[p].material;
    }
    if (organ.mesh.triangles.empty()) return;
    annotate_node(static_cast<std::size_t>(node_index), organ);
    annotate_material(material, organ);
    check_size(organ);
    scene_.organs.push_back(std::move(organ));
  }

  void add_primitive(const tinygltf::Primitive& primitive, const std::string& place,
                     const Eigen::Affine3d& patient_from_node, mesh::TriangleMesh& mesh) {
    const int mode = primitive.mode;
    if (mode < 0 || mode > 6) fail(place + "/mode", fmt::format("is {}, accepted is 0 to 6", mode));
    if (mode < TINYGLTF_MODE_TRIANGLES) {
      warn(place, "is points or lines; it is skipped");
      return;
    }
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) fail(place + "/attributes", "has no POSITION; export it again");
    const std::vector<Eigen::Vector3d> points = reader_.positions(position->second, quantised_);
    std::vector<std::uint32_t> indices;
    if (primitive.indices != -1) {
      indices = reader_.indices(primitive.indices, points.size());
    } else {
      indices.resize(points.size());
      for (std::size_t i = 0; i < indices.size(); ++i) indices[i] = static_cast<std::uint32_t>(i);
    }
    elements_ += points.size() + indices.size();
    if (elements_ > 2 * limits_.elements) {
      fail(place, fmt::format("the scene has more than {} vertices and indices; decimate it", 2 * limits_.elements));
    }

    const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      pulse_();
      const Eigen::Vector3d p = patient_from_node * points[i];
      if (!(p.cwiseAbs().maxCoeff() <= limits_.coordinate_m)) {
        fail(place, fmt::format("vertex {} lies at {:g} m, accepted is within {:g} m; glTF is in metres", i,
                                p.cwiseAbs().maxCoeff(), limits_.coordinate_m));
      }
      mesh.vertices.push_back(p);
    }
    const bool mirrored = patient_from_node.linear().determinant() < 0;
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      pulse_();
      if (a == b || b == c || c == a) return;
      if (mirrored) std::swap(b, c);
      mesh.triangles.push_back({base + a, base + b, base + c});
    };
    const std::size_t n = indices.size();
    if (mode == TINYGLTF_MODE_TRIANGLES) {
      if (primitive.indices == -1 && n % 3 != 0) {
        warn(place, fmt::format("has {} vertices, not a multiple of 3; the last ones are left out", n));
      } else if (n % 3 != 0) {
        fail(place, fmt::format("has {} indices, not a multiple of 3; export it again", n));
      }
      for (std::size_t i = 0; i + 2 < n; i += 3) add(indices[i], indices[i + 1], indices[i + 2]);
    } else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
      for (std::size_t i = 0; i + 2 < n; ++i) add(indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]);
    } else {
      for (std::size_t i = 1; i + 1 < n; ++i) add(indices[0], indices[i], indices[i + 1]);
    }
  }

  void annotate_node(std::size_t index, GltfOrgan& organ) {
    const auto* extras = extras_of("nodes", index);
    if (extras == nullptr || !extras->contains("organ")) return;
    const std::string pointer = fmt::format("/nodes/{}/extras/organ", index);
    if (!(*extras)["organ"].is_object()) {
      add_unknown({document_.line(pointer, "is not an object; write {\"id\": ...}")});
      return;
    }
    files::JsonObject object = document_.object_at(pointer);
    organ.organ.id = object.text("id", "");
    organ.organ.role = object.choice("role", organ_roles(), "");
    organ.organ.body = object.text("body", "");
    organ.organ.deformable = object.boolean("deformable", false);
    add_unknown(object.unknown_keys());
  }

  void annotate_material(int index, GltfOrgan& organ) {
    if (index == -1) return;
    if (index < 0 || static_cast<std::size_t>(index) >= model_.materials.size()) {
      fail(organ.place,
           fmt::format("its material is {}, the file has {}; export it again", index, model_.materials.size()));
    }
    const auto& colour = model_.materials[index].pbrMetallicRoughness.baseColorFactor;
    for (std::size_t i = 0; i < 4 && i < colour.size(); ++i) {
      organ.colour[i] = static_cast<float>(std::clamp(colour[i], 0.0, 1.0));
    }
    const auto* extras = extras_of("materials", static_cast<std::size_t>(index));
    if (extras == nullptr) return;
    if (!extras->contains("tissue")) return;
    const std::string pointer = fmt::format("/materials/{}/extras/tissue", index);
    std::vector<std::string> unknown;
    if ((*extras)["tissue"].is_object()) {
      organ.tissue = content::read_tissue_annotation(document_.object_at(pointer), unknown);
    } else {
      unknown.push_back(document_.line(pointer, "is not an object; write {\"preset\": ...}"));
    }
    add_unknown(unknown);
  }

  /// Once each: nodes share materials.
  void add_unknown(const std::vector<std::string>& lines) {
    for (const std::string& line : lines) {
      if (known_unknowns_.size() < 100 && known_unknowns_.insert(line).second) {
        scene_.unknown_annotations.push_back(line);
      }
    }
  }

  /// The extras of an element, where they are an object.
  const nlohmann::json* extras_of(const char* list, std::size_t index) const {
    const auto found = document_.tree().find(list);
    if (found == document_.tree().end() || !found->is_array() || index >= found->size()) return nullptr;
    const auto& element = (*found)[index];
    if (!element.is_object() || !element.contains("extras") || !element["extras"].is_object()) return nullptr;
    return &element["extras"];
  }

  void check_size(const GltfOrgan& organ) {
    Eigen::AlignedBox3d box;
    for (const auto& vertex : organ.mesh.vertices) box.extend(vertex);
    const double size = box.sizes().maxCoeff();
    if (size > 3) {
      warn(organ.place, fmt::format("is {:.3g} m wide: is the file in millimetres? scale it by 0.001", size));
    } else if (size < 1e-3) {
      warn(organ.place, fmt::format("is {:.3g} m wide: too small for an organ; check its scale", size));
    }
  }

  const tinygltf::Model& model_;
  files::JsonFile& document_;
  GltfLimits limits_;
  const files::Pulse& pulse_;
  AccessorReader reader_;
  bool quantised_ = false;
  std::vector<bool> visited_;
  std::size_t instances_ = 0;
  std::size_t elements_ = 0;
  std::set<std::string> known_unknowns_;
  GltfScene scene_;
};

}  // namespace

GltfScene read_gltf(std::span<const std::byte> bytes, const std::filesystem::path& name, const GltfLimits& limits,
                    const files::Pulse& pulse) {
  pulse.now();
  GltfContainer container(bytes, name, limits);
  pulse.now();
  return SceneBuilder(container, limits, pulse).build();
}

GltfScene read_gltf(const std::filesystem::path& path, const GltfLimits& limits) {
  const std::string bytes = files::read_file(path, limits.file_bytes);
  return read_gltf(std::as_bytes(std::span(bytes.data(), bytes.size())), path, limits);
}

}  // namespace stylet::gltf
