#include "engine/mesh/surface_pieces.h"

#include "engine/mesh/solid.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <numeric>

namespace stylet::mesh {
namespace {

constexpr std::size_t kMostPieces = 1000;  // pairs of them are looked at
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

}  // namespace

std::vector<TriangleMesh> connected_pieces(const TriangleMesh& surface, const files::Pulse& pulse) {
  std::vector<std::uint32_t> root(surface.vertices.size());
  std::iota(root.begin(), root.end(), 0U);
  const auto find = [&](std::uint32_t v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const auto& t : surface.triangles) {
    pulse();
    root[find(t[1])] = find(t[0]);
    root[find(t[2])] = find(t[0]);
  }
  std::vector<TriangleMesh> pieces;
  std::vector<std::uint32_t> piece_of(surface.vertices.size(), kNone);  // of the root
  std::vector<std::uint32_t> vertex_of(surface.vertices.size(), kNone);
  for (const auto& t : surface.triangles) {
    pulse();
    std::uint32_t& piece = piece_of[find(t[0])];
    if (piece == kNone) {
      piece = static_cast<std::uint32_t>(pieces.size());
      pieces.emplace_back();
    }
    TriangleMesh& mesh = pieces[piece];
    auto& corners = mesh.triangles.emplace_back();
    for (std::size_t c = 0; c < 3; ++c) {
      std::uint32_t& vertex = vertex_of[t[c]];
      if (vertex == kNone) {
        vertex = static_cast<std::uint32_t>(mesh.vertices.size());
        mesh.vertices.push_back(surface.vertices[t[c]]);
      }
      corners[c] = vertex;
    }
  }
  return pieces;
}

std::optional<OuterPieces> outer_pieces(const TriangleMesh& closed, const files::Pulse& pulse) {
  OuterPieces out{.pieces = connected_pieces(closed, pulse)};
  const std::size_t count = out.pieces.size();
  if (count == 1) return out;
  if (count > kMostPieces) return std::nullopt;
  std::vector<std::unique_ptr<Solid>> solids;
  for (const TriangleMesh& piece : out.pieces) solids.push_back(std::make_unique<Solid>(piece, pulse));
  std::vector<char> inner(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) {
      if (i == j || !solids[i]->bounds().intersects(solids[j]->bounds())) continue;
      const auto& vertices = out.pieces[i].vertices;
      const auto within = std::count_if(vertices.begin(), vertices.end(), [&](const Eigen::Vector3d& v) {
        pulse(files::Pulse::kDistance);
        return solids[j]->bounds().contains(v) && solids[j]->contains(v);
      });
      if (within == 0) continue;
      if (static_cast<std::size_t>(within) < vertices.size()) return std::nullopt;
      inner[i] = 1;
    }
  }
  std::vector<TriangleMesh> outer;
  for (std::size_t i = 0; i < count; ++i) {
    if (inner[i] == 0) outer.push_back(std::move(out.pieces[i]));
  }
  out.inner = static_cast<int>(count - outer.size());
  out.pieces = std::move(outer);
  return out;
}

}  // namespace stylet::mesh
