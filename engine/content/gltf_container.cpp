#include "engine/content/gltf_container.h"

#include <fmt/format.h>
#include <tiny_gltf.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>

namespace stylet::content {
namespace {

namespace fs = std::filesystem;

/// What the parser may read from disk: regular files in the asset's folder, up to a budget.
struct AssetFolder {
  fs::path folder;
  std::size_t budget = 0;
};

/// The file a URI of the asset means; empty where it leads out of the folder or to something odd (symbolic links are
/// followed first).
fs::path inside(const std::string& path, const AssetFolder& asset) {
  if (path.find("://") != std::string::npos || path.find('\0') != std::string::npos) return {};
  std::error_code error;
  const fs::path real = fs::weakly_canonical(path, error);
  if (error) return {};
  const fs::path folder = fs::weakly_canonical(asset.folder.empty() ? fs::path(".") : asset.folder, error);
  if (error) return {};
  const auto [end, rest] = std::mismatch(folder.begin(), folder.end(), real.begin(), real.end());
  if (end != folder.end()) return {};
  return fs::is_regular_file(real, error) ? real : fs::path();
}

bool file_exists(const std::string& path, void* user) {
  return !inside(path, *static_cast<AssetFolder*>(user)).empty();
}

std::string same_path(const std::string& path, void*) {
  return path;
}

bool read_whole_file(std::vector<unsigned char>* out, std::string* error, const std::string& path, void* user) {
  auto& asset = *static_cast<AssetFolder*>(user);
  const fs::path real = inside(path, asset);
  try {
    if (real.empty()) throw ContentError("it is not in the folder of the glTF file");
    const std::string bytes = read_file(real, asset.budget);
    asset.budget -= bytes.size();
    out->assign(bytes.begin(), bytes.end());
    return true;
  } catch (const std::exception& e) {
    if (error != nullptr) *error += e.what();
    return false;
  }
}

bool write_nothing(std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
  return false;
}

/// Organs need no textures, and one that does not decode must not cost the mesh.
bool skip_image(tinygltf::Image*, const int, std::string*, std::string*, int, int, const unsigned char*, int, void*) {
  return true;
}

std::uint32_t word(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

/// The JSON text of a file: the whole of it, or the first chunk of a GLB, whose frame is checked.
std::string_view json_text(std::span<const std::byte> bytes, const std::string& name, bool& binary) {
  const auto* chars = reinterpret_cast<const char*>(bytes.data());
  binary = bytes.size() >= 4 && std::memcmp(chars, "glTF", 4) == 0;
  if (!binary) return {chars, bytes.size()};
  const auto fail = [&](const std::string& what) -> std::string_view {
    throw ContentError(fmt::format("{}:/: {}", name, what));
  };
  if (bytes.size() < 20) return fail("is cut off inside the GLB header; copy or export it again");
  if (word(bytes, 4) != 2)
    return fail(fmt::format("is GLB version {}, accepted is 2; export it again", word(bytes, 4)));
  const std::size_t length = word(bytes, 8);
  if (length > bytes.size() || length < 20) {
    return fail(fmt::format("its header says {} bytes, there are {}; copy or export it again", length, bytes.size()));
  }
  const std::size_t json_length = word(bytes, 12);
  if (word(bytes, 16) != 0x4E4F534A) return fail("its first chunk is not JSON; export it again");
  if (json_length > length - 20) return fail("its JSON chunk is cut off; copy or export it again");
  return {chars + 20, json_length};
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

void check_version(JsonFile& document) {
  const auto& json = document.tree();
  if (!json.is_object() || !json.contains("asset") || !json["asset"].is_object()) {
    throw ContentError(fmt::format("{}:/asset: is missing; this is not a glTF 2.0 file", document.path().string()));
  }
  const auto& asset = json["asset"];
  if (major_version(asset, "version") != 2) {
    throw ContentError(fmt::format("{}:/asset/version: is {}, accepted is 2.x; export as glTF 2.0",
                                   document.path().string(),
                                   asset.contains("version") ? asset["version"].dump().substr(0, 40) : "missing"));
  }
  if (asset.contains("minVersion") &&
      (!asset["minVersion"].is_string() || asset["minVersion"].get<std::string>() != "2.0")) {
    throw ContentError(fmt::format("{}:/asset/minVersion: is {}, this program reads 2.0; export as glTF 2.0",
                                   document.path().string(), asset["minVersion"].dump().substr(0, 40)));
  }
}

/// Geometry is read without extensions but for quantisation; what only concerns looks is harmless.
void check_extensions(JsonFile& document) {
  const auto& json = document.tree();
  if (!json.contains("extensionsRequired")) return;
  const auto& list = json["extensionsRequired"];
  const auto fail = [&](const std::string& what) {
    throw ContentError(fmt::format("{}:/extensionsRequired: {}", document.path().string(), what));
  };
  if (!list.is_array()) fail("is not an array; export it again");
  for (const auto& entry : list) {
    if (!entry.is_string()) fail("holds something that is no text; export it again");
    const std::string name = entry.get<std::string>();
    if (name == "KHR_mesh_quantization" || name == "KHR_texture_transform" || name == "KHR_texture_basisu" ||
        name == "EXT_texture_webp" || name.starts_with("KHR_materials_")) {
      continue;
    }
    const bool compressed = name == "KHR_draco_mesh_compression" || name == "EXT_meshopt_compression";
    fail(fmt::format("{} is not supported; export {}", nlohmann::json(name).dump().substr(0, 80),
                     compressed ? "without mesh compression" : "without it"));
  }
}

/// tinygltf takes a negative or fractional offset, length, stride or count for an absent one.
void check_unsigned(JsonFile& document) {
  for (const char* list : {"bufferViews", "accessors", "buffers"}) {
    const auto found = document.tree().find(list);
    if (found == document.tree().end() || !found->is_array()) continue;
    for (std::size_t i = 0; i < found->size(); ++i) {
      if (!(*found)[i].is_object()) continue;
      for (const char* key : {"byteOffset", "byteLength", "byteStride", "count"}) {
        const auto value = (*found)[i].find(key);
        if (value == (*found)[i].end() || value->is_number_unsigned()) continue;
        // Some exporters write 12.0.
        if (value->is_number_float() && value->get<double>() >= 0 &&
            value->get<double>() == std::floor(value->get<double>())) {
          continue;
        }
        throw ContentError(fmt::format("{}:/{}/{}/{}: is {}, expected a whole number from 0; export it again",
                                       document.path().string(), list, i, key, value->dump().substr(0, 40)));
      }
    }
  }
}

std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text.size() > 200 ? text.substr(0, 197) + "..." : text;
}

}  // namespace

GltfContainer::GltfContainer(std::span<const std::byte> bytes, const fs::path& name, const GltfLimits& limits)
    : model_(std::make_unique<tinygltf::Model>()) {
  if (bytes.size() > limits.file_bytes) {
    throw ContentError(fmt::format("{}: {} bytes, the limit is {}; decimate the meshes", name.string(), bytes.size(),
                                   limits.file_bytes));
  }
  bool binary = false;
  const std::string_view text = json_text(bytes, name.string(), binary);
  document_ = std::make_unique<JsonFile>(
      name, text, JsonLimits{.bytes = limits.file_bytes, .depth = limits.json_depth, .duplicate_keys = true});
  check_version(*document_);
  check_extensions(*document_);
  check_unsigned(*document_);

  AssetFolder asset{.folder = name.parent_path(), .budget = limits.file_bytes};
  tinygltf::TinyGLTF parser;
  parser.SetFsCallbacks({&file_exists, &same_path, &read_whole_file, &write_nothing, &asset});
  parser.SetImageLoader(&skip_image, nullptr);
  std::string error;
  std::string warning;
  bool good = false;
  try {
    const auto length = static_cast<unsigned int>(bytes.size());
    good = binary ? parser.LoadBinaryFromMemory(model_.get(), &error, &warning,
                                                reinterpret_cast<const unsigned char*>(bytes.data()), length,
                                                asset.folder.string())
                  : parser.LoadASCIIFromString(model_.get(), &error, &warning,
                                               reinterpret_cast<const char*>(bytes.data()), length,
                                               asset.folder.string());
  } catch (const std::exception& e) {
    error += e.what();
  }
  if (!good) {
    throw ContentError(fmt::format("{}:/: is not valid glTF 2.0: {}; export it again", name.string(),
                                   error.empty() ? "the parser gave up" : one_line(error)));
  }
}

GltfContainer::~GltfContainer() = default;

}  // namespace stylet::content
