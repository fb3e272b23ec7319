#include "tools/make_patient/sheet.h"

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

namespace stylet::patient {
namespace {

void add_quad(mesh::TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  // The shorter diagonal, so that curved parts look smooth.
  const auto& x = mesh.vertices;
  if ((x[a] - x[c]).squaredNorm() <= (x[b] - x[d]).squaredNorm()) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  } else {
    mesh.triangles.push_back({a, b, d});
    mesh.triangles.push_back({b, c, d});
  }
}

}  // namespace

mesh::TriangleMesh sheet(int columns, int rows, const SheetPoint& point) {
  mesh::TriangleMesh mesh;
  for (const bool outer : {true, false}) {
    for (int row = 0; row <= rows; ++row) {
      for (int column = 0; column <= columns; ++column) {
        mesh.vertices.push_back(point(static_cast<double>(column) / columns, static_cast<double>(row) / rows, outer));
      }
    }
  }
  const auto at = [&](int column, int row, bool outer) {
    return static_cast<std::uint32_t>((outer ? 0 : (rows + 1) * (columns + 1)) + row * (columns + 1) + column);
  };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      add_quad(mesh, at(column, row, true), at(column, row + 1, true), at(column + 1, row + 1, true),
               at(column + 1, row, true));
      add_quad(mesh, at(column, row, false), at(column + 1, row, false), at(column + 1, row + 1, false),
               at(column, row + 1, false));
    }
  }
  const auto rim = [&](int c0, int r0, int c1, int r1) {
    add_quad(mesh, at(c0, r0, true), at(c1, r1, true), at(c1, r1, false), at(c0, r0, false));
  };
  for (int column = 0; column < columns; ++column) {
    rim(column, 0, column + 1, 0);
    rim(column + 1, rows, column, rows);
  }
  for (int row = 0; row < rows; ++row) {
    rim(columns, row, columns, row + 1);
    rim(0, row + 1, 0, row);
  }
  return mesh;
}

mesh::TriangleMesh tube(std::span<const Ring> rings, int sides) {
  mesh::TriangleMesh mesh;
  for (const Ring& ring : rings) {
    for (int side = 0; side < sides; ++side) {
      const double angle = 2 * std::numbers::pi * side / sides;
      mesh.vertices.push_back(ring.centre + std::cos(angle) * ring.half_axis_1 + std::sin(angle) * ring.half_axis_2);
    }
  }
  const auto at = [&](std::size_t ring, int side) {
    return static_cast<std::uint32_t>(ring * sides + static_cast<std::size_t>(side % sides));
  };
  for (std::size_t ring = 0; ring + 1 < rings.size(); ++ring) {
    for (int side = 0; side < sides; ++side) {
      add_quad(mesh, at(ring, side), at(ring, side + 1), at(ring + 1, side + 1), at(ring + 1, side));
    }
  }
  const auto cap = [&](std::size_t ring, double direction) {
    const Ring& end = rings[ring];
    const Eigen::Vector3d along = end.half_axis_1.cross(end.half_axis_2).normalized();
    const double reach = 0.5 * std::min(end.half_axis_1.norm(), end.half_axis_2.norm());
    const auto tip = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(end.centre + direction * reach * along);
    for (int side = 0; side < sides; ++side) {
      if (direction > 0) {
        mesh.triangles.push_back({at(ring, side), at(ring, side + 1), tip});
      } else {
        mesh.triangles.push_back({at(ring, side + 1), at(ring, side), tip});
      }
    }
  };
  cap(0, -1);
  cap(rings.size() - 1, 1);
  return mesh;
}

}  // namespace stylet::patient
