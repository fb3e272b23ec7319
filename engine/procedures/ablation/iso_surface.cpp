#include "engine/procedures/ablation/iso_surface.h"

#include <Eigen/Geometry>

#include <array>
#include <cstdint>
#include <unordered_map>
#include <utility>

namespace stylet::procedures::ablation {
namespace {

constexpr double kEnd = 1e-3;  // share of an edge that a vertex keeps from its ends: no triangle without area

class Marcher {
public:
  Marcher(const CellGrid& grid, std::span<const double> values, double level)
      : grid_(grid), values_(values), level_(level) {}

  void cube(int i, int j, int k) {
    std::array<std::size_t, 8> corner{};
    int above = 0;
    for (int c = 0; c < 8; ++c) {
      const std::size_t at = grid_.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
      corner[c] = at;
      above += inside(at) ? 1 : 0;
    }
    if (above == 0 || above == 8) return;
    // Kuhn: from corner 0 to corner 7, one axis after the other, in each order of the axes.
    constexpr std::array<std::array<std::size_t, 2>, 6> kWays{{{1, 3}, {3, 2}, {2, 6}, {6, 4}, {4, 5}, {5, 1}}};
    for (const auto& [a, b] : kWays) tetrahedron({corner[0], corner[a], corner[b], corner[7]});
  }

  mesh::TriangleMesh take() { return std::move(mesh_); }

private:
  bool inside(std::size_t cell) const { return values_[cell] > level_; }

  Eigen::Vector3d position(std::size_t cell) const {
    const auto x = static_cast<std::size_t>(grid_.size.x());
    const auto y = static_cast<std::size_t>(grid_.size.y());
    return grid_.centre(static_cast<int>(cell % x), static_cast<int>(cell / x % y), static_cast<int>(cell / (x * y)));
  }

  std::uint32_t vertex(std::size_t a, std::size_t b) {
    if (a > b) std::swap(a, b);
    const auto [found, added] = vertices_.try_emplace(a * grid_.count() + b, mesh_.vertices.size());
    if (added) {
      const double share = std::clamp((level_ - values_[a]) / (values_[b] - values_[a]), kEnd, 1 - kEnd);
      mesh_.vertices.push_back(position(a) + share * (position(b) - position(a)));
    }
    return static_cast<std::uint32_t>(found->second);
  }

  void tetrahedron(const std::array<std::size_t, 4>& cell) {
    std::array<std::size_t, 4> in{};
    std::array<std::size_t, 4> out{};
    std::size_t ins = 0;
    std::size_t outs = 0;
    for (const std::size_t c : cell) (inside(c) ? in[ins++] : out[outs++]) = c;
    if (ins == 0 || outs == 0) return;
    // Outward is from the mean of what is inside to the mean of what is not.
    Eigen::Vector3d way = Eigen::Vector3d::Zero();
    for (std::size_t n = 0; n < outs; ++n) way += position(out[n]) / static_cast<double>(outs);
    for (std::size_t n = 0; n < ins; ++n) way -= position(in[n]) / static_cast<double>(ins);
    if (ins == 2) {
      const std::array quad{vertex(in[0], out[0]), vertex(in[0], out[1]), vertex(in[1], out[1]),
                            vertex(in[1], out[0])};
      triangle(quad[0], quad[1], quad[2], way);
      triangle(quad[0], quad[2], quad[3], way);
    } else if (ins == 1) {
      triangle(vertex(in[0], out[0]), vertex(in[0], out[1]), vertex(in[0], out[2]), way);
    } else {
      triangle(vertex(in[0], out[0]), vertex(in[1], out[0]), vertex(in[2], out[0]), way);
    }
  }

  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, const Eigen::Vector3d& way) {
    const auto& v = mesh_.vertices;
    if ((v[b] - v[a]).cross(v[c] - v[a]).dot(way) < 0) std::swap(b, c);
    mesh_.triangles.push_back({a, b, c});
  }

  const CellGrid& grid_;
  std::span<const double> values_;
  double level_;
  std::unordered_map<std::uint64_t, std::size_t> vertices_;  // by edge; looked up only, so its order does not matter
  mesh::TriangleMesh mesh_;
};

}  // namespace

mesh::TriangleMesh iso_surface(const CellGrid& grid, std::span<const double> values, double level) {
  Marcher marcher(grid, values, level);
  for (int k = 0; k + 1 < grid.size.z(); ++k) {
    for (int j = 0; j + 1 < grid.size.y(); ++j) {
      for (int i = 0; i + 1 < grid.size.x(); ++i) marcher.cube(i, j, k);
    }
  }
  return marcher.take();
}

}  // namespace stylet::procedures::ablation
