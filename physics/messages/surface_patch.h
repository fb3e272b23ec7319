// The boundary of a deformable body as a patch carries it: there for every body, wherever the needle points.
#pragma once

#include "physics/messages/material.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <memory>
#include <vector>

namespace stylet::physics {

/// What never changes of a body's boundary. Every thread may read it.
struct SurfaceTopology {
  struct Face {
    std::array<int, 3> corners{};    ///< as indices into node_ids, counter-clockwise from outside
    int tet = -1;                    ///< the tetrahedron behind it
    int apex = 0;                    ///< its corner off the face; the face's are kFaceCorners[apex]
    std::array<int, 4> tet_nodes{};  ///< node ids of the tetrahedron
  };
  /// A box of the tree over the faces. Children come after their parents.
  struct Box {
    int left = -1;  ///< the right child is left + 1; -1: leaf
    int first = 0;  ///< its faces are [first, first + count)
    int count = 0;
  };
  std::vector<int> node_ids;                   ///< [nodes] ascending
  Eigen::Matrix3Xd rest_positions;             ///< [3 x nodes] m
  std::vector<NodeSurroundings> surroundings;  ///< [nodes]
  std::vector<Face> faces;                     ///< in the order of the leaves
  std::vector<Box> tree;                       ///< root first
};

/// Where it is: without needle force where the patch knows that, else as the simulation shows it.
struct SurfacePatch {
  std::shared_ptr<const SurfaceTopology> topology;  ///< null: not known; the same in all patches of a simulation
  Eigen::Matrix3Xd positions;                       ///< [3 x nodes] m
  std::vector<Eigen::AlignedBox3d> boxes;           ///< [tree] around the faces, see refit()
};

}  // namespace stylet::physics
