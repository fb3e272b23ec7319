// The nodes around the needle's way that a patch is made of.
#include "physics/contact/corridor.h"

#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace stylet::physics {
namespace {

// Where a layer is cut thin, or an element of ten nodes in eight, the shaft goes through tetrahedra much flatter than
// they are wide: one that the patch lacks holds the track up for good.
TEST(Corridor, HasEveryTetrahedronThatTheNeedleGoesThroughHoweverFlat) {
  const TetMesh mesh = reference::kuhn_box({0, 0, 0}, {0.03, 0.03, 0.03}, {5, 5, 60});
  const TissueModel model(mesh, std::vector<ElasticMaterial>(mesh.tets.size(), {10e3, 0.45}),
                          reference::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; }));
  const Eigen::Matrix3Xd positions = rest_positions(model);
  constexpr double kRange = 0.012;
  for (const double slant : {0.0, 0.3, 0.6}) {
    const Eigen::Vector3d axis = Eigen::Vector3d(slant, 0.2 * slant, -1).normalized();
    NeedleState needle;
    needle.node_count = 2;
    needle.positions.col(1) = Eigen::Vector3d(0.0111, 0.0123, 0.0317);
    needle.positions.col(0) = needle.positions.col(1) - 0.1 * axis;
    const std::vector<int> nodes = corridor_nodes(model, positions, needle, 0, kRange, kMaxPatchNodes);
    const auto has = [&](int node) { return std::ranges::find(nodes, node) != nodes.end(); };
    int hint = -1, tets = 0;
    for (double s = 0; s < kRange - 0.5e-3; s += 1e-5) {
      const TetPoint at = model.topology.locate(positions, needle.positions.col(1) + s * axis, hint);
      if (at.tet < 0 || at.tet == hint) continue;
      hint = at.tet;
      ++tets;
      EXPECT_TRUE(std::ranges::all_of(model.topology.nodes(at.tet), has)) << "slant " << slant << ", " << s << " m";
    }
    EXPECT_GT(tets, 20);
  }
}

}  // namespace
}  // namespace stylet::physics
