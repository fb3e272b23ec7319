#include "engine/import/stl.h"

#include "engine/files/error.h"
#include "engine/import/text_scanner.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace stylet::import {
namespace {

using files::ContentError;

constexpr std::size_t kHeaderBytes = 80;
constexpr std::size_t kTriangleBytes = 50;  // normal and three corners as floats, two bytes nobody reads

static_assert(std::endian::native == std::endian::little, "STL is little-endian");

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::size_t declared_triangles(std::span<const std::byte> bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kHeaderBytes, sizeof count);
  return count;
}

/// Text files begin with "solid", but so do the headers of some binary ones: the length decides.
bool is_binary(std::span<const std::byte> bytes) {
  return bytes.size() >= kHeaderBytes + 4 &&
         bytes.size() - kHeaderBytes - 4 == kTriangleBytes * declared_triangles(bytes);
}

class StlReader {
public:
  StlReader(std::span<const std::byte> bytes, const std::filesystem::path& name, const SurfaceLimits& limits,
            const files::Pulse& pulse)
      : bytes_(bytes), name_(name), limits_(limits), pulse_(pulse) {}

  SurfaceFile read() {
    if (is_binary(bytes_)) {
      read_binary();
    } else if (text_of(bytes_).starts_with("solid")) {
      read_text();
    } else if (bytes_.size() >= kHeaderBytes + 4) {
      throw ContentError(fmt::format("{}: announces {} triangles, {} bytes, and has {} bytes; export it again",
                                     name_.string(), declared_triangles(bytes_),
                                     kHeaderBytes + 4 + kTriangleBytes * declared_triangles(bytes_), bytes_.size()));
    } else {
      throw ContentError(fmt::format("{}: is no STL: {} bytes", name_.string(), bytes_.size()));
    }
    std::erase_if(file_.surfaces, [](const SourceSurface& s) { return s.mesh.triangles.empty(); });
    if (file_.surfaces.empty()) {
      throw ContentError(fmt::format("{}: has no triangle; export the surface again", name_.string()));
    }
    return std::move(file_);
  }

private:
  void add_triangle(const std::array<Eigen::Vector3d, 3>& corners, const std::string& place) {
    mesh::TriangleMesh& mesh = file_.surfaces.back().mesh;
    if (++triangles_ > limits_.elements) {
      throw ContentError(
          fmt::format("{}:{}: more than {} triangles; decimate it", name_.string(), place, limits_.elements));
    }
    for (const Eigen::Vector3d& corner : corners) {
      if (!(corner.cwiseAbs().array() <= limits_.coordinate).all()) {
        throw ContentError(
            fmt::format("{}:{}: a corner lies at {:g} {:g} {:g}, accepted is within {:g}; export it "
                        "again",
                        name_.string(), place, corner.x(), corner.y(), corner.z(), limits_.coordinate));
      }
    }
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) return;
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), corners.begin(), corners.end());
    mesh.triangles.push_back({first, first + 1, first + 2});
  }

  void read_binary() {
    file_.axes = stated_axes(text_of(bytes_.first(kHeaderBytes)));
    file_.surfaces.push_back({.name = name_.stem().string(), .mesh = {}});
    const std::size_t count = declared_triangles(bytes_);
    for (std::size_t t = 0; t < count; ++t) {
      pulse_(8);
      std::array<float, 12> numbers;
      std::memcpy(numbers.data(), bytes_.data() + kHeaderBytes + 4 + t * kTriangleBytes, sizeof numbers);
      std::array<Eigen::Vector3d, 3> corners;
      for (std::size_t c = 0; c < 3; ++c) {
        corners[c] = Eigen::Map<const Eigen::Vector3f>(numbers.data() + 3 + 3 * c).cast<double>();
      }
      add_triangle(corners, fmt::format("triangle {}", t));
    }
  }

  void read_text() {
    TextScanner scanner(text_of(bytes_));
    std::array<Eigen::Vector3d, 3> corners;
    std::size_t corner = 0;
    while (scanner.next_line()) {
      pulse_(8);
      const std::string_view keyword = scanner.word();
      const auto place = [&] { return fmt::format("{}", scanner.line_number()); };
      if (keyword == "solid") {
        const std::string_view name = scanner.remainder();
        if (!file_.axes) file_.axes = stated_axes(name);
        if (file_.surfaces.size() == limits_.surfaces) {
          throw ContentError(
              fmt::format("{}:{}: more than {} solids; split the file", name_.string(), place(), limits_.surfaces));
        }
        file_.surfaces.push_back({.name = name.empty() || name.find('=') != std::string_view::npos
                                              ? name_.stem().string()
                                              : std::string(name.substr(0, 200)),
                                  .mesh = {}});
      } else if (keyword == "vertex") {
        if (corner == 3) {
          throw ContentError(
              fmt::format("{}:{}: a fourth corner; STL knows triangles only", name_.string(), place()));
        }
        for (int axis = 0; axis < 3; ++axis) {
          const std::string_view word = scanner.word();
          const auto number = to_number(word);
          if (!number) {
            throw ContentError(fmt::format("{}:{}: \"{}\" is no finite number; export it again", name_.string(),
                                           place(), word.substr(0, 40)));
          }
          corners[corner][axis] = *number;
        }
        ++corner;
      } else if (keyword == "endloop") {
        if (corner != 3) {
          throw ContentError(
              fmt::format("{}:{}: a loop of {} corners; STL knows triangles only", name_.string(), place(), corner));
        }
        corner = 0;
        add_triangle(corners, place());
      } else if (!keyword.empty() && keyword != "facet" && keyword != "outer" && keyword != "endfacet" &&
                 keyword != "endsolid") {
        throw ContentError(fmt::format("{}:{}: \"{}\" is no word of an STL; is the file damaged?", name_.string(),
                                       place(), keyword.substr(0, 40)));
      }
    }
    if (corner != 0) throw ContentError(fmt::format("{}: ends inside a triangle; export it again", name_.string()));
  }

  std::span<const std::byte> bytes_;
  const std::filesystem::path& name_;
  const SurfaceLimits& limits_;
  const files::Pulse& pulse_;
  SurfaceFile file_;
  std::size_t triangles_ = 0;
};

}  // namespace

bool looks_like_stl(std::span<const std::byte> bytes) {
  return is_binary(bytes) || text_of(bytes).starts_with("solid");
}

SurfaceFile read_stl(std::span<const std::byte> bytes, const std::filesystem::path& name, const SurfaceLimits& limits,
                     const files::Pulse& pulse) {
  return StlReader(bytes, name, limits, pulse).read();
}

}  // namespace stylet::import
