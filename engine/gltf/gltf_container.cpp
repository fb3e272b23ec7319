#include "engine/gltf/gltf_container.h"

#include "engine/gltf/draco_decoder.h"
#include "engine/gltf/gltf_draco.h"

#include "engine/files/json_scan.h"

#include <fmt/format.h>
#include <tiny_gltf.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>
#include <set>

namespace stylet::gltf {
namespace {

namespace fs = std::filesystem;

bool file_exists(const std::string&, void*) {
  return false;
}

std::string same_path(const std::string& path, void*) {
  return path;
}

bool read_nothing(std::vector<unsigned char>*, std::string*, const std::string&, void*) {
  return false;
}

bool write_nothing(std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
  return false;
}

std::uint32_t word(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

/// Where the parts of a file lie: JSON alone, or in the chunks of a GLB.
struct Chunks {
  std::string_view json;
  std::span<const std::byte> binary;
};

Chunks split(std::span<const std::byte> bytes, const std::string& name) {
  const auto* chars = reinterpret_cast<const char*>(bytes.data());
  const auto fail = [&](const std::string& what) -> Chunks {
    throw files::ContentError(fmt::format("{}:/: {}", name, what));
  };
  if (bytes.size() < 4 || std::memcmp(chars, "glTF", 4) != 0) {
    const std::string_view text(chars, bytes.size());
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    const bool json =
        first == std::string_view::npos || text[first] == '{' || text.substr(first, 3) == "\xEF\xBB\xBF";
    if (!json) return fail("is neither a GLB nor the JSON of a glTF file; copy or export it again");
    return {.json = text, .binary = {}};
  }
  if (bytes.size() < 12) return fail("is cut off inside the GLB header; copy or export it again");
  if (word(bytes, 4) != 2)
    return fail(fmt::format("is GLB version {}, accepted is 2; export it again", word(bytes, 4)));
  const std::size_t length = word(bytes, 8);
  if (length > bytes.size() || length < 20) {
    return fail(fmt::format("its header says {} bytes, there are {}; copy or export it again", length, bytes.size()));
  }
  Chunks chunks;
  for (std::size_t at = 12; at + 8 <= length;) {
    const std::size_t size = word(bytes, at);
    const std::uint32_t type = word(bytes, at + 4);
    if (at == 12 && type != 0x4E4F534A) return fail("its first chunk is not JSON; export it again");
    if (size > length - at - 8)
      return fail(fmt::format("its chunk at byte {} is cut off; copy or export it again", at));
    if (at == 12) chunks.json = {chars + at + 8, size};
    if (type == 0x004E4942 && chunks.binary.data() == nullptr) chunks.binary = bytes.subspan(at + 8, size);
    at += 8 + size;
  }
  return chunks;
}

/// "2.0" -> 2; -1 where it is no version.
int major_version(const nlohmann::json& asset, const char* key) {
  if (!asset.contains(key) || !asset[key].is_string()) return -1;
  const std::string text = asset[key].get<std::string>();
  const std::size_t dot = text.find('.');
  if (dot == std::string::npos || dot == 0 || dot > 3) return -1;
  int value = 0;
  for (const char c : text.substr(0, dot)) {
    if (c < '0' || c > '9') return -1;
    value = 10 * value + (c - '0');
  }
  return value;
}

void check_version(files::JsonFile& document) {
  const auto& json = document.tree();
  if (!json.is_object() || !json.contains("asset") || !json["asset"].is_object()) {
    throw files::ContentError(
        fmt::format("{}:/asset: is missing; this is not a glTF 2.0 file", document.path().string()));
  }
  const auto& asset = json["asset"];
  if (major_version(asset, "version") != 2) {
    throw files::ContentError(
        fmt::format("{}:/asset/version: is {}, accepted is 2.x; export as glTF 2.0", document.path().string(),
                    asset.contains("version") ? asset["version"].dump().substr(0, 40) : "missing"));
  }
  if (asset.contains("minVersion") &&
      (!asset["minVersion"].is_string() || asset["minVersion"].get<std::string>() != "2.0")) {
    throw files::ContentError(fmt::format("{}:/asset/minVersion: is {}, this program reads 2.0; export as glTF 2.0",
                                          document.path().string(), asset["minVersion"].dump().substr(0, 40)));
  }
}

/// Geometry is read without extensions but for quantisation and Draco; what only concerns looks is harmless.
void check_extensions(files::JsonFile& document) {
  const auto& json = document.tree();
  if (!json.contains("extensionsRequired")) return;
  const auto& list = json["extensionsRequired"];
  const auto fail = [&](const std::string& what) {
    throw files::ContentError(fmt::format("{}:/extensionsRequired: {}", document.path().string(), what));
  };
  if (!list.is_array()) fail("is not an array; export it again");
  for (const auto& entry : list) {
    if (!entry.is_string()) fail("holds something that is no text; export it again");
    const std::string name = entry.get<std::string>();
    if (name == "KHR_mesh_quantization" || name == "KHR_texture_transform" || name == "KHR_texture_basisu" ||
        name == "EXT_texture_webp" || name.starts_with("KHR_materials_")) {
      continue;
    }
    if (name == "KHR_draco_mesh_compression") {
      if (draco_decoder().empty()) fail(kWithoutDraco);
      continue;
    }
    const bool compressed = name == "EXT_meshopt_compression" || name == "KHR_meshopt_compression";
    fail(fmt::format("{} is not supported; export {}", nlohmann::json(name).dump().substr(0, 80),
                     compressed ? "without mesh compression" : "without it"));
  }
}

/// tinygltf takes a value of another type, a negative or fractional number and what does not fit an int for an absent
/// key, or wraps it.
class TypeCheck {
public:
  explicit TypeCheck(const files::JsonFile& document) : document_(document) {}

  void run() const {
    const auto& json = document_.tree();
    for (const char* list : {"scenes", "nodes", "meshes", "materials", "accessors", "bufferViews", "buffers"}) {
      each(json, list, "", [&](const auto& object, const std::string& place) { look(list, object, place); });
    }
    index(json, "scene", "");
  }

private:
  void look(std::string_view list, const nlohmann::json& object, const std::string& place) const {
    if (!object.is_object()) fail(place, object, "an object");
    if (list == "scenes") {
      indices(object, "nodes", place);
    } else if (list == "nodes") {
      index(object, "mesh", place);
      indices(object, "children", place);
      for (const char* key : {"matrix", "translation", "rotation", "scale"}) numbers(object, key, place);
    } else if (list == "meshes") {
      each(object, "primitives", place,
           [&](const auto& primitive, const std::string& at) { look_at(primitive, at); });
    } else if (list == "accessors") {
      for (const char* key : {"bufferView", "componentType"}) index(object, key, place);
      for (const char* key : {"byteOffset", "count"}) size(object, key, place);
      is(object, "type", place, "text", [](const auto& value) { return value.is_string(); });
      is(object, "normalized", place, "true or false", [](const auto& value) { return value.is_boolean(); });
      is(object, "sparse", place, "an object", [](const auto& value) { return value.is_object(); });
    } else if (list == "bufferViews") {
      index(object, "buffer", place);
      for (const char* key : {"byteOffset", "byteLength", "byteStride"}) size(object, key, place);
    } else if (list == "buffers") {
      size(object, "byteLength", place);
    }
  }

  void look_at(const nlohmann::json& primitive, const std::string& place) const {
    if (!primitive.is_object()) fail(place, primitive, "an object");
    for (const char* key : {"indices", "material", "mode"}) index(primitive, key, place);
    is(primitive, "attributes", place, "an object", [](const auto& value) { return value.is_object(); });
    if (primitive.contains("attributes")) index(primitive["attributes"], "POSITION", place + "/attributes");
  }

  template <typename Is>
  void is(const nlohmann::json& object, const char* key, const std::string& place, const char* expected,
          Is good) const {
    const auto found = object.find(key);
    if (found != object.end() && !good(*found)) fail(fmt::format("{}/{}", place, key), *found, expected);
  }
  template <typename Visit>
  void each(const nlohmann::json& object, const char* key, const std::string& place, Visit visit) const {
    is(object, key, place, "a list", [](const auto& value) { return value.is_array(); });
    const auto found = object.find(key);
    if (found == object.end()) return;
    for (std::size_t i = 0; i < found->size(); ++i) visit((*found)[i], fmt::format("{}/{}/{}", place, key, i));
  }
  // Some exporters write 12.0.
  static bool is_whole(const nlohmann::json& value, double most) {
    if (!value.is_number() || value.is_number_integer() != value.is_number_unsigned()) return false;
    const double number = value.get<double>();
    return number >= 0 && number <= most && number == std::floor(number);
  }
  void index(const nlohmann::json& object, const char* key, const std::string& place) const {
    is(object, key, place, kIndex, [](const auto& value) { return is_whole(value, kMostIndex); });
  }
  void size(const nlohmann::json& object, const char* key, const std::string& place) const {
    is(object, key, place, kSize, [](const auto& value) { return is_whole(value, kMostBytes); });
  }
  void indices(const nlohmann::json& object, const char* key, const std::string& place) const {
    each(object, key, place, [&](const auto& value, const std::string& at) {
      if (!is_whole(value, kMostIndex)) fail(at, value, kIndex);
    });
  }
  void numbers(const nlohmann::json& object, const char* key, const std::string& place) const {
    each(object, key, place, [&](const auto& value, const std::string& at) {
      if (!value.is_number()) fail(at, value, "a number");
    });
  }
  [[noreturn]] void fail(const std::string& place, const nlohmann::json& value, const char* expected) const {
    const std::string text = value.is_structured() ? (value.is_array() ? "a list" : "an object") : value.dump();
    throw files::ContentError(fmt::format("{}:{}: is {}, expected {}; export it again", document_.path().string(),
                                          place, files::printable(text.substr(0, 40)), expected));
  }

  static constexpr double kMostIndex = 2147483647;        // an int
  static constexpr double kMostBytes = 9007199254740992;  // exact in a double
  static constexpr const char* kIndex = "a whole number from 0 to 2147483647";
  static constexpr const char* kSize = "a whole number from 0 to 9007199254740992";
  const files::JsonFile& document_;
};

/// The parser gets no extras and extensions: it knows none that matter here, and blows them up tenfold in memory.
/// Some exporters write 12.0 where it wants 12.
nlohmann::json plain(const nlohmann::json& value) {
  if (value.is_number_float()) {
    const double number = value.get<double>();
    if (number != std::floor(number) || std::abs(number) > 1e15) return value;
    if (number < 0) return static_cast<std::int64_t>(number);
    return static_cast<std::uint64_t>(number);
  }
  if (!value.is_structured()) return value;
  nlohmann::json out(value.type());
  for (const auto& [key, member] : value.items()) {
    if (value.is_array()) {
      out.push_back(plain(member));
    } else if (key != "extras" && key != "extensions") {
      out[key] = plain(member);
    }
  }
  return out;
}

/// The accessors that triangles are read from, by index.
std::set<std::size_t> used_accessors(const nlohmann::json& document) {
  std::set<std::size_t> used;
  const auto add = [&](const nlohmann::json& object, const char* key) {
    if (object.is_object() && object.contains(key) && object[key].is_number_unsigned()) {
      used.insert(object[key].get<std::size_t>());
    }
  };
  if (!document.contains("meshes")) return used;
  for (const auto& mesh : document["meshes"]) {
    if (!mesh.is_object() || !mesh.contains("primitives")) continue;
    for (const auto& primitive : mesh["primitives"]) {
      if (!primitive.is_object()) continue;
      add(primitive, "indices");
      if (primitive.contains("attributes")) add(primitive["attributes"], "POSITION");
    }
  }
  return used;
}

/// What triangles come from, as JSON. Images, animations, accessors of normals and the like stay out: what is wrong
/// with them does not matter to a mesh. Buffers too: GltfBuffers has them.
nlohmann::json geometry(files::JsonFile& document, std::size_t max_elements) {
  nlohmann::json out = nlohmann::json::object();
  for (const char* key : {"asset", "scene", "scenes", "nodes", "meshes", "materials", "accessors", "bufferViews"}) {
    const auto found = document.tree().find(key);
    if (found == document.tree().end()) continue;
    if (found->size() > max_elements) {
      throw files::ContentError(fmt::format("{}:/{}: has {} elements, accepted are {}; split the file",
                                            document.path().string(), key, found->size(), max_elements));
    }
    out[key] = plain(*found);
  }
  if (!out.contains("accessors") || !out["accessors"].is_array()) return out;
  const std::set<std::size_t> used = used_accessors(out);
  for (std::size_t i = 0; i < out["accessors"].size(); ++i) {
    // An accessor that can be neither a position nor an index.
    if (!used.contains(i)) out["accessors"][i] = {{"componentType", 5126}, {"count", 1}, {"type", "MAT4"}};
  }
  return out;
}

/// A library of meshes that no node places: each stands where it was modelled.
void place_unplaced(tinygltf::Model& model) {
  const auto places = [](const tinygltf::Node& node) { return node.mesh != -1; };
  if (!model.scenes.empty() || std::ranges::any_of(model.nodes, places)) return;
  for (std::size_t i = 0; i < model.meshes.size(); ++i) {
    tinygltf::Node& node = model.nodes.emplace_back();
    node.mesh = static_cast<int>(i);
    node.name = model.meshes[i].name;
  }
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return files::printable(text, 200);
}

}  // namespace

GltfContainer::GltfContainer(std::span<const std::byte> bytes, const fs::path& name, const GltfLimits& limits)
    : model_(std::make_unique<tinygltf::Model>()) {
  if (bytes.size() > limits.file_bytes) {
    throw files::ContentError(fmt::format("{}: {} bytes, the limit is {}; decimate the meshes", name.string(),
                                          bytes.size(), limits.file_bytes));
  }
  const Chunks chunks = split(bytes, name.string());
  document_ = std::make_unique<files::JsonFile>(name, chunks.json,
                                                files::JsonLimits{.bytes = limits.json_bytes,
                                                                  .depth = limits.json_depth,
                                                                  .values = limits.json_values,
                                                                  .duplicate_keys = true});
  check_version(*document_);
  check_extensions(*document_);
  TypeCheck(*document_).run();
  buffers_ = std::make_unique<GltfBuffers>(*document_, chunks.binary, limits.file_bytes);

  tinygltf::TinyGLTF parser;
  parser.SetFsCallbacks({&file_exists, &same_path, &read_nothing, &write_nothing, nullptr});
  std::string error;
  std::string warning;
  bool good = false;
  try {
    nlohmann::json json = geometry(*document_, limits.instances);
    decompress_draco(*document_, json, *buffers_, limits);
    const std::string text = json.dump();
    good = parser.LoadASCIIFromString(model_.get(), &error, &warning, text.data(),
                                      static_cast<unsigned int>(text.size()), "");
  } catch (const files::ContentError&) {
    throw;
  } catch (const std::exception& e) {
    error += e.what();
  }
  if (!good) {
    throw files::ContentError(fmt::format("{}:/: is not valid glTF 2.0: {}; export it again", name.string(),
                                          error.empty() ? "the parser gave up" : one_line(error)));
  }
  place_unplaced(*model_);
}

GltfContainer::~GltfContainer() = default;

}  // namespace stylet::gltf
