#include "engine/gltf/gltf_buffers.h"

#include "engine/files/json_scan.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>
#include <string_view>

namespace stylet::gltf {
namespace {

namespace fs = std::filesystem;

/// "a%20b" -> "a b"
std::string percent_decoded(std::string_view uri) {
  std::string out;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    unsigned value = 0;
    if (uri[i] == '%' && i + 2 < uri.size() &&
        std::from_chars(&uri[i] + 1, &uri[i] + 3, value, 16).ptr == &uri[i] + 3) {
      out += static_cast<char>(value);
      i += 2;
    } else {
      out += uri[i];
    }
  }
  return out;
}

/// Empty where it is not base64.
std::optional<std::vector<std::byte>> base64_decoded(std::string_view text) {
  for (int padding = 0; padding < 2 && text.ends_with('='); ++padding) text.remove_suffix(1);
  std::vector<std::byte> out;
  out.reserve(text.size() / 4 * 3 + 2);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    std::uint32_t digit = 0;
    if (c >= 'A' && c <= 'Z') {
      digit = static_cast<std::uint32_t>(c - 'A');
    } else if (c >= 'a' && c <= 'z') {
      digit = static_cast<std::uint32_t>(c - 'a' + 26);
    } else if (c >= '0' && c <= '9') {
      digit = static_cast<std::uint32_t>(c - '0' + 52);
    } else if (c == '+' || c == '/') {
      digit = c == '+' ? 62 : 63;
    } else {
      return std::nullopt;
    }
    bits = bits << 6 | digit;
    count += 6;
    if (count >= 8) {
      count -= 8;
      out.push_back(static_cast<std::byte>(bits >> count & 0xFF));
    }
  }
  return out;
}

std::vector<std::byte> as_vector(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
  return {bytes.begin(), bytes.end()};
}

/// A scheme (http://, file:/): it names no file of the folder.
bool has_scheme(const std::string& uri) {
  const std::size_t colon = uri.find(':');
  return colon != std::string::npos && colon > 1 && uri.find('/') > colon;
}

/// Whether a file of the folder is meant (symbolic links are followed first).
bool inside(const fs::path& path, const fs::path& folder) {
  std::error_code error;
  const fs::path real = fs::weakly_canonical(path, error);
  if (error) return false;
  const fs::path real_folder = fs::weakly_canonical(folder, error);
  if (error) return false;
  const auto [end, rest] = std::mismatch(real_folder.begin(), real_folder.end(), real.begin(), real.end());
  return end == real_folder.end();
}

}  // namespace

GltfBuffers::GltfBuffers(const files::JsonFile& document, std::span<const std::byte> binary, std::size_t max_bytes)
    : file_(document.path()), binary_(binary) {
  const auto list = document.tree().find("buffers");
  if (list == document.tree().end() || !list->is_array()) return;
  for (std::size_t i = 0; i < list->size(); ++i) {
    const auto& json = (*list)[i];
    if (!json.is_object() || !json.contains("byteLength")) fail(i, "has no byteLength; export it again");
    const double length = json["byteLength"].get<double>();  // a whole number: TypeCheck has looked
    Buffer& buffer = buffers_.emplace_back();
    buffer.length = length < 1e15 ? static_cast<std::size_t>(length) : std::numeric_limits<std::size_t>::max();
    const auto uri = json.find("uri");
    if (uri == json.end()) continue;
    if (!uri->is_string()) fail(i, "its uri is no text; export it again");
    buffer.has_uri = true;
    buffer.loaded = load(i, uri->get_ref<const std::string&>(), max_bytes);
    if (buffer.loaded.size() > max_bytes) fail(i, "the buffers are larger than accepted; decimate the meshes");
    max_bytes -= buffer.loaded.size();
    bytes(i);
  }
}

void GltfBuffers::fail(std::size_t index, const std::string& what) const {
  throw files::ContentError(fmt::format("{}:/buffers/{}: {}", file_.string(), index, what));
}

std::vector<std::byte> GltfBuffers::load(std::size_t index, const std::string& uri, std::size_t max_bytes) const {
  if (uri.starts_with("data:")) {
    const std::size_t comma = uri.find(',');
    if (comma == std::string::npos) fail(index, "its data URI has no data; export it again");
    if (!std::string_view(uri).substr(0, comma).ends_with(";base64")) {
      return as_vector(percent_decoded(std::string_view(uri).substr(comma + 1)));
    }
    auto bytes = base64_decoded(std::string_view(uri).substr(comma + 1));
    if (!bytes) fail(index, "its base64 is broken; export it again");
    return std::move(*bytes);
  }
  const std::string name = percent_decoded(uri);
  if (has_scheme(name)) {
    fail(index, fmt::format("{} is no file; put it into the folder of the glTF file", files::printable(name)));
  }
  const fs::path folder = file_.has_parent_path() ? file_.parent_path() : fs::path(".");
  if (name.empty() || name.find('\0') != std::string::npos || !inside(folder / name, folder)) {
    fail(index, fmt::format("{} is not in the folder of the glTF file; put it there", files::printable(name)));
  }
  try {
    return as_vector(files::read_file(folder / name, max_bytes));
  } catch (const files::ContentError& error) {
    fail(index, files::one_line(error.what()));
  }
}

std::span<const std::byte> GltfBuffers::bytes(std::size_t index) const {
  const Buffer& buffer = buffers_[index];
  std::span<const std::byte> all = buffer.loaded;
  if (!buffer.has_uri) {
    if (index != 0 || binary_.data() == nullptr)
      fail(index, "has no uri, and no BIN chunk is there for it; export it again");
    all = binary_;
  }
  if (buffer.length > all.size()) {
    fail(index, fmt::format("declares {} bytes, there are {}; copy or export it again", buffer.length, all.size()));
  }
  return all.first(buffer.length);
}

std::size_t GltfBuffers::add(std::vector<std::byte> bytes) {
  const std::size_t length = bytes.size();
  buffers_.push_back({.loaded = std::move(bytes), .length = length, .has_uri = true});
  return buffers_.size() - 1;
}

}  // namespace stylet::gltf
