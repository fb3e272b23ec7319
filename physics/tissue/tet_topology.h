// Neighbours and surface of a tetrahedral mesh; finding where a point or a line is in it, in any deformed state.
#pragma once

#include "physics/tissue/tet_mesh.h"

#include <Eigen/Core>

#include <array>
#include <vector>

namespace stylet::physics {

/// A material point: it moves with its tetrahedron. x = sum barycentric[a] * x[tet node a].
struct TetPoint {
  int tet = -1;  ///< -1: nowhere
  Eigen::Vector4d barycentric = Eigen::Vector4d::Zero();
};

/// Where a line meets the surface.
struct SurfaceCrossing {
  double distance = 0;                               ///< along the line from its origin, m
  TetPoint point;                                    ///< on the boundary face of its tetrahedron
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, outward
  bool entering = true;                              ///< the line goes into the body here
};

/// Corners of face f, the one opposite node f, counter-clockwise from outside of a positively oriented tetrahedron.
inline constexpr std::array<std::array<int, 3>, 4> kFaceCorners{{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

class TetTopology {
public:
  explicit TetTopology(const TetMesh& mesh);

  /// The tetrahedron that holds `x`: a walk from `hint`, all tetrahedra if it fails. tet = -1: outside.
  /// @param positions  [3 x nodes] deformed, m
  TetPoint locate(const Eigen::Matrix3Xd& positions, const Eigen::Vector3d& x, int hint) const;
  /// The same on the way from a point near by that is in the body, or is not: that `x` is outside is learnt from the
  /// surface that the way crosses, for a third of what all tetrahedra cost.
  TetPoint follow(const Eigen::Matrix3Xd& positions, const Eigen::Vector3d& from, bool inside,
                  const Eigen::Vector3d& x, int hint) const;

  /// Barycentric coordinates of `x` in a tetrahedron; sums to 1. Zero if the tetrahedron is flat.
  Eigen::Vector4d barycentric(const Eigen::Matrix3Xd& positions, int tet, const Eigen::Vector3d& x) const;

  Eigen::Vector3d position(const Eigen::Matrix3Xd& positions, const TetPoint& point) const;

  /// Appends the crossings of the segment origin + s * direction, 0 <= s <= length, nearest first.
  /// A hit on an edge shared by two faces counts once.
  /// @param direction  unit
  void crossings(const Eigen::Matrix3Xd& positions, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                 double length, std::vector<SurfaceCrossing>& out) const;

  const std::array<int, 4>& nodes(int tet) const { return tets_[tet]; }
  /// Tetrahedron beyond face f of a tetrahedron, -1 at the surface.
  int neighbour(int tet, int face) const { return neighbours_[tet][face]; }

private:
  struct FaceOfTet {
    int tet = -1;
    int face = 0;
  };
  std::vector<std::array<int, 4>> tets_;
  std::vector<std::array<int, 4>> neighbours_;
  /// tet = -1: it led to the surface of a body that is not convex, or in a circle among inverted tetrahedra.
  TetPoint walk(const Eigen::Matrix3Xd& positions, const Eigen::Vector3d& x, int hint) const;

  // The surface; what a search reads of it, and what it tells of a hit.
  std::vector<std::array<int, 3>> surface_faces_;  // nodes, counter-clockwise from outside
  std::vector<FaceOfTet> surface_tets_;
  std::vector<int> surface_nodes_;  // ascending
};

}  // namespace stylet::physics
