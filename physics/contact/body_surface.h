// The boundary of a deformable body: triangles that move with the nodes, their normals, and what is near a point.
#pragma once

#include "physics/tissue/companion.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <span>
#include <vector>

namespace stylet::physics {

/// A point on a face: x = sum weights[a] * x[face node a].
struct SurfacePoint {
  int face = -1;  ///< -1: nowhere
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double distance = 0;     ///< from the point asked for, unsigned, m
  bool on_crease = false;  ///< on an edge or corner where the surface is not smooth at rest: its rim
};

/// Closest point of a triangle (Ericson, Real-Time Collision Detection, 5.1.5). Weights are >= 0 and sum to 1.
Eigen::Vector3d closest_weights(const Eigen::Vector3d& x, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                const Eigen::Vector3d& c);

/// Faces, areas and normals of one body, and a tree of boxes over the faces: its topology is that of the rest state,
/// the boxes are refitted by update().
class BodySurface {
public:
  explicit BodySurface(const TissueModel& model);

  /// Follows the body: boxes and areas, O(faces). Call before the queries below.
  /// @param positions  [3 x nodes] deformed, m
  /// @param companion  takes a part of the faces; the bits do not know of it
  void update(const Eigen::Matrix3Xd& positions, Companion* companion = nullptr);

  /// Boundary nodes, each farthest (at rest) from those before it: a prefix is an even sample of the surface.
  std::span<const int> nodes() const { return nodes_; }
  int face_count() const { return static_cast<int>(faces_.size()); }
  /// Nodes of a face, counter-clockwise from outside.
  const std::array<int, 3>& face(int f) const { return faces_[f]; }
  double rest_area(int f) const { return rest_areas_[f]; }

  /// The longest way that a boundary node has gone in each update, summed up, m: no node has gone further.
  double travel() const { return travel_; }

  // Of the last update():
  const Eigen::AlignedBox3d& bounds() const { return boxes_.front().box; }
  /// Unit, outward; area-weighted mean of the faces around.
  Eigen::Vector3d node_normal(int node) const;
  /// Normal at a surface point: interpolated between those of the face's corners, each the mean of the faces around
  /// that belong to the same smooth patch. So it is continuous where a point slides over an edge that is not a crease
  /// at rest. (A face's own would jump there, and a contact on the edge would never come to rest.)
  Eigen::Vector3d normal(const SurfacePoint& point) const;
  /// The nearest point within `range` on faces that look against `facing`; face = -1: none.
  /// @param near  a face that may be near, as it was a step ago: saves time and changes nothing; -1: none is known
  SurfacePoint closest(const Eigen::Vector3d& x, const Eigen::Vector3d& facing, double range, int near = -1) const;
  /// Appends the faces whose boxes meet `box`, in the order of the tree.
  void faces_in(const Eigen::AlignedBox3d& box, std::vector<int>& out) const;

private:
  /// A box of the tree. Children come after their parents, a leaf's faces are order_[first .. first + count).
  struct Box {
    Eigen::AlignedBox3d box;
    Eigen::AlignedBox3d areas;  // of the faces' normals times twice their areas
    int left = -1;              // the right child is left + 1; -1: leaf
    int first = 0;
    int count = 0;
  };
  /// Areas of a leaf's faces, and its boxes.
  void follow(Box& leaf);
  /// Of a face, as closest() looks at it.
  SurfacePoint point_on(int face, const Eigen::Vector3d& x, double& squared) const;
  void build_tree(const Eigen::Matrix3Xd& rest);
  void sort_nodes(const Eigen::Matrix3Xd& rest);
  void find_smooth_patches();

  std::vector<int> nodes_;
  std::vector<int> in_memory_;  // the same, ascending
  std::vector<std::array<int, 3>> faces_;
  std::vector<double> rest_areas_;
  std::vector<int> order_;  // faces as the leaves hold them
  std::vector<Box> boxes_;
  double travel_ = 0;
  Eigen::Matrix3Xd positions_;     // [3 x nodes], inside the body those at rest
  std::vector<int> around_start_;  // faces around node n: around_[around_start_[n] .. around_start_[n + 1])
  std::vector<int> around_;
  Eigen::Matrix3Xd face_areas_;  // [3 x faces], normal times twice the area
  // Corner k of face f, c = 3 f + k, is smooth with faces smooth_faces_[smooth_start_[c] .. smooth_start_[c + 1])
  std::vector<int> smooth_start_;
  std::vector<int> smooth_faces_;
  std::vector<char> creased_;  // [3 faces] the corner has other faces around it too
};

}  // namespace stylet::physics
