#include "engine/gltf/gltf_draco.h"

#include "engine/gltf/draco_decoder.h"

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <array>
#include <cstring>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace stylet::gltf {
namespace {

constexpr const char* kExtension = "KHR_draco_mesh_compression";
/// Of all primitives together, which may share their data; more than the largest mesh accepted ever needs.
constexpr std::size_t kCompressedBytes = 64u << 20;

/// The member `key` of an object; null where there is none.
const nlohmann::json& member(const nlohmann::json& object, const std::string& key) {
  static const nlohmann::json kNull;
  if (!object.is_object()) return kNull;
  const auto found = object.find(key);
  return found == object.end() ? kNull : *found;
}

const nlohmann::json& element(const nlohmann::json& list, const nlohmann::json& index) {
  static const nlohmann::json kNull;
  if (!list.is_array() || !index.is_number_unsigned() || index.get<std::size_t>() >= list.size()) return kNull;
  return list[index.get<std::size_t>()];
}

[[noreturn]] void fail(const std::string& file, const std::string& place, const std::string& what) {
  throw files::ContentError(fmt::format("{}:/{}: {}", file, place, what));
}

/// A compressed primitive: what it decodes to, and where it stands in meshes and primitives.
struct Job {
  DracoMesh mesh;
  std::size_t mesh_index;
  std::size_t primitive_index;
  Eigen::AlignedBox3d declared{};  // of its positions
};

/// `count` of an accessor of this type. What the decoder gives is held against it.
std::size_t declared(const nlohmann::json& accessor, const char* type, std::size_t limit, const std::string& file,
                     const std::string& place) {
  if (member(accessor, "type") != type)
    fail(file, place, fmt::format("its accessor is no {}; export it again", type));
  const nlohmann::json& count = member(accessor, "count");
  if (!count.is_number_unsigned() || count.get<std::size_t>() == 0 || count.get<std::size_t>() > limit) {
    fail(file, place,
         fmt::format("the count of its accessor is {}, accepted is 1 to {}; decimate the mesh",
                     count.dump().substr(0, 40), limit));
  }
  return count.get<std::size_t>();
}

DracoMesh compressed_mesh(const nlohmann::json& geometry, const nlohmann::json& primitive,
                          const nlohmann::json& extension, const GltfBuffers& buffers, std::size_t limit,
                          const std::string& file, const std::string& place) {
  DracoMesh mesh;
  mesh.place = place;
  const nlohmann::json& accessors = member(geometry, "accessors");
  const nlohmann::json& position = element(accessors, member(member(primitive, "attributes"), "POSITION"));
  if (member(position, "componentType") != 5126) fail(file, place, "its positions are no floats; export it again");
  mesh.vertices = declared(position, "VEC3", limit, file, place);
  mesh.indices = declared(element(accessors, member(primitive, "indices")), "SCALAR", limit, file, place);
  if (member(primitive, "mode") != nullptr && member(primitive, "mode") != 4) {
    fail(file, place, "is compressed, but no list of triangles; export it as triangles");
  }

  const nlohmann::json& id = member(member(extension, "attributes"), "POSITION");
  const nlohmann::json& view = element(member(geometry, "bufferViews"), member(extension, "bufferView"));
  const nlohmann::json& buffer = member(view, "buffer");
  const nlohmann::json offset = view.is_object() ? view.value("byteOffset", nlohmann::json(0U)) : nullptr;
  const nlohmann::json& length = member(view, "byteLength");
  if (!id.is_number_unsigned() || id.get<std::size_t>() > 0xFFFF || !buffer.is_number_unsigned() ||
      buffer.get<std::size_t>() >= buffers.size() || !offset.is_number_unsigned() || !length.is_number_unsigned()) {
    fail(file, place, fmt::format("its {} lacks attributes, bufferView or buffer; export it again", kExtension));
  }
  const auto bytes = buffers.bytes(buffer.get<std::size_t>());
  const auto first = offset.get<std::size_t>();
  const auto size = length.get<std::size_t>();
  if (first > bytes.size() || size > bytes.size() - first) {
    fail(file, place, "its Draco data leave their buffer; the file is cut off or wrong");
  }
  mesh.position_id = id.get<std::uint32_t>();
  mesh.compressed = bytes.subspan(first, size);
  return mesh;
}

/// Three numbers of an accessor; empty where they are not there.
std::optional<Eigen::Vector3d> corner(const nlohmann::json& accessor, const char* key) {
  const nlohmann::json& list = member(accessor, key);
  if (!list.is_array() || list.size() != 3) return std::nullopt;
  Eigen::Vector3d out;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!list[i].is_number()) return std::nullopt;
    out[static_cast<Eigen::Index>(i)] = list[i].get<double>();
  }
  return out;
}

/// Damaged Draco data decode to noise more often than not: positions must lie where their accessors say.
void check_ranges(const std::vector<Job>& jobs, std::span<const std::byte> plain, const std::string& file) {
  std::size_t offset = 0;
  for (const Job& job : jobs) {
    const double slack = 0.01 * job.declared.diagonal().norm();  // rounding of the compression
    for (std::size_t v = 0; v < job.mesh.vertices; ++v) {
      std::array<float, 3> x;
      std::memcpy(x.data(), plain.data() + offset + 12 * v, sizeof x);
      const Eigen::Vector3d p(x[0], x[1], x[2]);
      if (p.allFinite() && job.declared.exteriorDistance(p) <= slack) continue;
      fail(
          file, job.mesh.place,
          fmt::format("its Draco data put vertex {} at ({:g}, {:g}, {:g}), outside min and max of its accessor: they "
                      "are damaged; export it again",
                      v, p.x(), p.y(), p.z()));
    }
    offset += 12 * job.mesh.vertices + 4 * job.mesh.indices;
  }
}

/// Appends a buffer view and an accessor on it. @returns the accessor
std::size_t add_accessor(nlohmann::json& geometry, std::size_t buffer, std::size_t offset, std::size_t bytes,
                         nlohmann::json accessor) {
  geometry["bufferViews"].push_back({{"buffer", buffer}, {"byteOffset", offset}, {"byteLength", bytes}});
  accessor["bufferView"] = geometry["bufferViews"].size() - 1;
  geometry["accessors"].push_back(std::move(accessor));
  return geometry["accessors"].size() - 1;
}

/// Decodes them together and gives them plain accessors.
void decompress(const std::vector<Job>& jobs, const std::string& file, nlohmann::json& geometry,
                GltfBuffers& buffers) {
  std::vector<DracoMesh> meshes;
  meshes.reserve(jobs.size());
  for (const Job& job : jobs) meshes.push_back(job.mesh);
  std::vector<std::byte> plain = decode_draco(meshes, file);
  check_ranges(jobs, plain, file);
  const std::size_t buffer = buffers.add(std::move(plain));
  std::size_t offset = 0;
  for (const Job& job : jobs) {
    nlohmann::json& primitive = geometry["meshes"][job.mesh_index]["primitives"][job.primitive_index];
    const auto add = [&](std::size_t bytes, const nlohmann::json& accessor) {
      offset += bytes;
      return add_accessor(geometry, buffer, offset - bytes, bytes, accessor);
    };
    primitive["attributes"]["POSITION"] =
        add(12 * job.mesh.vertices, {{"componentType", 5126}, {"type", "VEC3"}, {"count", job.mesh.vertices}});
    primitive["indices"] =
        add(4 * job.mesh.indices, {{"componentType", 5125}, {"type", "SCALAR"}, {"count", job.mesh.indices}});
  }
}

}  // namespace

void decompress_draco(const files::JsonFile& document, nlohmann::json& geometry, GltfBuffers& buffers,
                      const GltfLimits& limits) {
  const std::string file = document.path().string();
  std::vector<Job> jobs;
  std::size_t elements = 0;
  std::size_t compressed = 0;
  const nlohmann::json& meshes = member(document.tree(), "meshes");
  for (std::size_t m = 0; meshes.is_array() && m < meshes.size(); ++m) {
    const nlohmann::json& primitives = member(meshes[m], "primitives");
    for (std::size_t p = 0; primitives.is_array() && p < primitives.size(); ++p) {
      const nlohmann::json& extension = member(member(primitives[p], "extensions"), kExtension);
      if (extension.is_null()) continue;
      const nlohmann::json& primitive = geometry["meshes"][m]["primitives"][p];
      const nlohmann::json& position =
          element(member(geometry, "accessors"), member(member(primitive, "attributes"), "POSITION"));
      // Else the extension is an offer, and the plain triangles are there too.
      if (!member(position, "bufferView").is_null()) continue;
      const std::string place = fmt::format("meshes/{}/primitives/{}", m, p);
      jobs.push_back(
          {compressed_mesh(geometry, primitive, extension, buffers, limits.elements, file, place), m, p, {}});
      const auto least = corner(position, "min"), most = corner(position, "max");
      // glTF demands them of positions; without them noise would pass for an organ.
      if (!least || !most || !(least->array() <= most->array()).all()) {
        fail(file, place + "/attributes/POSITION",
             "its accessor has no min and max, three numbers each, to hold Draco data against; export it again");
      }
      jobs.back().declared = Eigen::AlignedBox3d(*least, *most);
      elements += jobs.back().mesh.vertices + jobs.back().mesh.indices;
      compressed += jobs.back().mesh.compressed.size();
      if (compressed > kCompressedBytes) {
        fail(file, place, fmt::format("the file has more than {} bytes of Draco data; split it", kCompressedBytes));
      }
      if (elements > 2 * limits.elements) {
        fail(file, place,
             fmt::format("the file has more than {} vertices and indices; decimate it", 2 * limits.elements));
      }
    }
  }
  if (!jobs.empty()) decompress(jobs, file, geometry, buffers);
}

}  // namespace stylet::gltf
