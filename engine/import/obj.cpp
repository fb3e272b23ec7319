#include "engine/import/obj.h"

#include "engine/files/error.h"
#include "engine/import/text_scanner.h"

#include <fmt/format.h>

#include <cstdint>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

namespace stylet::import {
namespace {

using files::ContentError;

constexpr std::size_t kMostCorners = 1000;  // of one polygon

class ObjReader {
public:
  ObjReader(std::string_view text, const std::filesystem::path& name, const SurfaceLimits& limits,
            const files::Pulse& pulse)
      : scanner_(text), name_(name), limits_(limits), pulse_(pulse) {}

  SurfaceFile read() {
    while (scanner_.next_line()) {
      pulse_(8);
      const std::string_view keyword = scanner_.word();
      if (keyword == "v") {
        add_vertex();
      } else if (keyword == "f") {
        add_face();
      } else if (keyword == "o" || keyword == "g") {
        const std::string_view words = scanner_.remainder();
        current_ = words.empty() ? name_.stem().string() : std::string(words.substr(0, 200));
      } else if (keyword.starts_with('#')) {
        if (!file_.axes) file_.axes = stated_axes(std::string(keyword) + std::string(scanner_.remainder()));
      }
      // Everything else (normals, texture, materials, lines, curves) has no part in a surface.
    }
    if (file_.surfaces.empty()) {
      throw ContentError(fmt::format("{}: has no face; export the surface as triangles", name_.string()));
    }
    return std::move(file_);
  }

private:
  [[noreturn]] void fail(const std::string& what) const {
    throw ContentError(fmt::format("{}:{}: {}", name_.string(), scanner_.line_number(), what));
  }

  void add_vertex() {
    Eigen::Vector3d position;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = scanner_.word();
      const auto number = to_number(word);
      if (!number) fail(fmt::format("\"{}\" is no finite number; export it again", word.substr(0, 40)));
      position[axis] = *number;
    }
    if (!(position.cwiseAbs().array() <= limits_.coordinate).all()) {
      fail(fmt::format("lies at {:g} {:g} {:g}, accepted is within {:g}; check its unit", position.x(), position.y(),
                       position.z(), limits_.coordinate));
    }
    if (positions_.size() == limits_.elements) {
      fail(fmt::format("more than {} vertices; decimate it", limits_.elements));
    }
    positions_.push_back(position);
  }

  /// "7", "7/1", "7//3" or "7/1/3"; negative ones count back from the last vertex so far.
  std::uint32_t corner(std::string_view word) const {
    const auto written = to_integer(word.substr(0, word.find('/')));
    if (!written) fail(fmt::format("\"{}\" is no corner of a face; expected v, v/t or v/t/n", word.substr(0, 40)));
    const auto count = static_cast<long long>(positions_.size());
    const long long index = *written < 0 ? count + *written : *written - 1;
    if (index < 0 || index >= count) {
      fail(fmt::format("vertex {} does not exist; there are {} so far; export it again", *written, count));
    }
    return static_cast<std::uint32_t>(index);
  }

  void add_face() {
    corners_.clear();
    for (std::string_view word = scanner_.word(); !word.empty(); word = scanner_.word()) {
      if (word.starts_with('#')) break;
      if (corners_.size() == kMostCorners) fail(fmt::format("a face of more than {} corners", kMostCorners));
      corners_.push_back(corner(word));
    }
    if (corners_.size() < 3) fail(fmt::format("a face of {} corners; at least 3 are needed", corners_.size()));
    Group& group = group_named(current_.empty() ? name_.stem().string() : current_);
    mesh::TriangleMesh& mesh = file_.surfaces[group.surface].mesh;
    for (std::uint32_t& c : corners_) {
      const auto [at, is_new] = group.local.try_emplace(c, static_cast<std::uint32_t>(mesh.vertices.size()));
      if (is_new) mesh.vertices.push_back(positions_[c]);
      c = at->second;
    }
    for (std::size_t i = 1; i + 1 < corners_.size(); ++i) {
      const std::array<std::uint32_t, 3> triangle{corners_[0], corners_[i], corners_[i + 1]};
      if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) continue;
      if (++triangles_ > limits_.elements) fail(fmt::format("more than {} triangles; decimate it", limits_.elements));
      mesh.triangles.push_back(triangle);
    }
  }

  struct Group {
    std::size_t surface = 0;
    std::map<std::uint32_t, std::uint32_t> local;  // vertex of the file -> of the surface
  };

  Group& group_named(const std::string& name) {
    const auto found = groups_.find(name);
    if (found != groups_.end()) return found->second;
    if (file_.surfaces.size() == limits_.surfaces) {
      fail(fmt::format("more than {} groups; split the file", limits_.surfaces));
    }
    file_.surfaces.push_back({.name = name, .mesh = {}});
    return groups_.emplace(name, Group{.surface = file_.surfaces.size() - 1, .local = {}}).first->second;
  }

  TextScanner scanner_;
  const std::filesystem::path& name_;
  const SurfaceLimits& limits_;
  const files::Pulse& pulse_;
  SurfaceFile file_;
  std::vector<Eigen::Vector3d> positions_;
  std::vector<std::uint32_t> corners_;
  std::string current_;
  std::map<std::string, Group> groups_;
  std::size_t triangles_ = 0;
};

}  // namespace

SurfaceFile read_obj(std::span<const std::byte> bytes, const std::filesystem::path& name, const SurfaceLimits& limits,
                     const files::Pulse& pulse) {
  return ObjReader({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, name, limits, pulse).read();
}

}  // namespace stylet::import
