// What a contact knows of the mesh where it is: continuous where it passes from one tetrahedron to the next.
#include "physics/contact/subgrid_compliance.h"
#include "physics/contact/track_points.h"
#include "physics/tissue/tissue_model.h"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <vector>

namespace stylet::physics {
namespace {

using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr double kEdge = 0.01;
constexpr double kVolume = kEdge * kEdge * kEdge / 6;
constexpr double kRadius = 0.6e-3;

/// Two tetrahedra on one face: the second twice as large, four times as stiff and more compressible.
TissueModel unlike_neighbours() {
  TetMesh mesh;
  mesh.nodes = {Vector3d::Zero(), kEdge * Vector3d::UnitX(), kEdge * Vector3d::UnitY(), kEdge * Vector3d::UnitZ(),
                -2 * kEdge * Vector3d::UnitZ()};
  mesh.tets = {{0, 1, 2, 3}, {0, 2, 1, 4}};
  const std::vector<ElasticMaterial> materials{{10e3, 0.45}, {40e3, 0.3}};
  const std::vector<int> fixed{0, 1, 2};
  return {std::move(mesh), materials, fixed, 0.02};
}

TissuePatch patch_of(const TissueModel& model) {
  TissuePatch patch;
  patch.body_count = 1;
  BodyPatch& body = patch.bodies[0];
  body.node_count = static_cast<int>(model.mesh.nodes.size());
  for (std::size_t n = 0; n < model.mesh.nodes.size(); ++n) body.surroundings[n] = model.surroundings[n];
  body.tet_count = model.tet_count();
  for (std::size_t t = 0; t < model.mesh.tets.size(); ++t) body.tet_nodes[t] = model.mesh.tets[t];
  return patch;
}

SubgridSite site(const TissuePatch& patch, int tet, const Vector4d& barycentric) {
  TrackPoint point;
  point.body = 0;
  point.patch_tet = tet;
  point.place.barycentric = barycentric;
  return site_in_patch(patch, point);
}

TEST(SubgridSite, IsTheMeanOfTheTetrahedraAroundANode) {
  const TissueModel model = unlike_neighbours();
  const TissuePatch patch = patch_of(model);
  const SubgridSite first = site(patch, 0, Vector4d::Unit(3));  // a node of the first alone
  EXPECT_NEAR(first.tet_volume, kVolume, 1e-12 * kVolume);
  EXPECT_NEAR(first.material.young_modulus, 10e3, 1e-6);
  EXPECT_NEAR(first.material.poisson_ratio, 0.45, 1e-12);
  for (int corner = 0; corner < 3; ++corner) {
    const SubgridSite shared = site(patch, 1, Vector4d::Unit(corner));
    EXPECT_NEAR(shared.tet_volume, 1.5 * kVolume, 1e-12 * kVolume);
    EXPECT_NEAR(shared.material.young_modulus, 30e3, 1e-6);  // by volume: (10 + 2 * 40)/3
    EXPECT_NEAR(shared.material.poisson_ratio, 0.35, 1e-12);
  }
}

TEST(SubgridSite, ComplianceHasNoStepOnTheFaceBetweenUnlikeTetrahedra) {
  const TissueModel model = unlike_neighbours();
  const TissuePatch patch = patch_of(model);
  // Along one line through the face, from either side: the corners of the face are 0 1 2 in one, 0 2 1 in the other.
  const auto before = [&](double gap) { return site(patch, 0, Vector4d(0.5 - gap, 0.3, 0.2, gap)); };
  const auto behind = [&](double gap) { return site(patch, 1, Vector4d(0.5 - gap, 0.2, 0.3, gap)); };
  const auto steps = [&](double gap) {
    const ShaftCompliance a = shaft_compliance(before(gap), kRadius, kEdge);
    const ShaftCompliance b = shaft_compliance(behind(gap), kRadius, kEdge);
    return std::array{
        b.lateral / a.lateral - 1, b.axial / a.axial - 1,
        channel_tip_compliance(behind(gap), kRadius) / channel_tip_compliance(before(gap), kRadius) - 1,
        surface_tip_compliance(behind(gap), kRadius) / surface_tip_compliance(before(gap), kRadius) - 1};
  };
  for (const double step : steps(0)) EXPECT_NEAR(step, 0, 1e-12);
  const auto near = steps(1e-3), nearer = steps(1e-4);
  for (std::size_t i = 0; i < near.size(); ++i) {  // and it goes to zero with the distance, to first order
    EXPECT_NE(near[i], 0);
    EXPECT_NEAR(nearer[i] / near[i], 0.1, 0.01);
  }
}

TEST(SubgridSite, OfAPointOutsideIsTakenOnTheFace) {
  const TissueModel model = unlike_neighbours();
  const TissuePatch patch = patch_of(model);
  const SubgridSite outside = site(patch, 0, Vector4d(0.5, 0.4, 0.4, -0.3));
  EXPECT_NEAR(outside.tet_volume, 1.5 * kVolume, 1e-12 * kVolume);
  EXPECT_NEAR(outside.material.young_modulus, 30e3, 1e-6);
}

}  // namespace
}  // namespace stylet::physics
