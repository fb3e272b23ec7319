// Dirty spheres whose volume is known: patches apart, walls doubled, triangles turned, a hole.
#include "engine/import/enclosed_solid.h"
#include "tests/mesh/shapes.h"
#include "tests/support/sanitized.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace stylet::import {
namespace {

using mesh::TriangleMesh;
using mesh::test::append_flipped;
using mesh::test::icosphere;

// Under a sanitizer a sphere of half the size: an eighth of the nodes, triangles as large.
constexpr double kRadius = support::kSanitized ? 0.015 : 0.03;
constexpr int kLevel = support::kSanitized ? 3 : 4;
constexpr double kSpacing = 0.5e-3;
constexpr EnclosedSolid::Limits kLimits{.nodes = support::kSanitized ? 0.5e6 : 8e6,
                                        .work = support::kSanitized ? 2e6 : 100e6};
const Eigen::Vector3d kCentre(0.1, -0.2, 0.05);

/// Enclosed by the faceted sphere, m^3.
double volume_of(const TriangleMesh& mesh) {
  double six = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    six += (mesh.vertices[a] - kCentre).dot((mesh.vertices[b] - kCentre).cross(mesh.vertices[c] - kCentre));
  }
  return std::abs(six) / 6;
}

/// Every second triangle turned round, every third one drawn twice, patches moved apart by `apart` at most.
TriangleMesh dirty_sphere(double apart) {
  const TriangleMesh sphere = icosphere(kCentre, kRadius, kLevel);
  TriangleMesh soup;
  for (std::size_t t = 0; t < sphere.triangles.size(); ++t) {
    auto [a, b, c] = sphere.triangles[t];
    if (t % 2 == 0) std::swap(a, b);
    const Eigen::Vector3d middle = (sphere.vertices[a] + sphere.vertices[b] + sphere.vertices[c]) / 3;
    const double size = (sphere.vertices[a] - middle).norm();
    for (int copy = 0; copy < (t % 3 == 0 ? 2 : 1); ++copy) {
      const auto first = static_cast<std::uint32_t>(soup.vertices.size());
      for (const std::uint32_t v : {a, b, c}) {
        // Shrunk towards its middle: a slit along every edge.
        const double shrink = std::max(0.0, 1 - apart / size);
        soup.vertices.push_back(middle + shrink * (sphere.vertices[v] - middle));
      }
      soup.triangles.push_back({first, first + 1, first + 2});
    }
  }
  return soup;
}

TEST(EnclosedSolid, DirtySphereHasItsVolumeAndDistance) {
  const TriangleMesh clean = icosphere(kCentre, kRadius, kLevel);
  const EnclosedSolid solid(dirty_sphere(0), 1e-3, kSpacing);
  EXPECT_NEAR(solid.volume() / volume_of(clean), 1, 0.01);
  EXPECT_NEAR(solid.depth(), kRadius, kSpacing);
  for (const double r : {0.2, 0.5, 0.8, 0.9, 0.97, 1.0, 1.03, 1.1, 1.4}) {
    for (const Eigen::Vector3d& direction :
         {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(0.6, 0.3, -0.74).normalized()}) {
      const double expected = (r - 1) * kRadius;
      EXPECT_NEAR(solid.signed_distance(kCentre + r * kRadius * direction), expected, 0.3 * kSpacing) << r;
    }
  }
  EXPECT_GT(solid.signed_distance(kCentre + Eigen::Vector3d(1, 1, 1)), 0);
}

TEST(EnclosedSolid, ClosesSlitsUpToTheGapAndNoWider) {
  const TriangleMesh clean = icosphere(kCentre, kRadius, kLevel);
  const TriangleMesh slit = dirty_sphere(0.4e-3);  // slits of up to 0.8 mm
  const EnclosedSolid closed(slit, 2e-3, kSpacing);
  EXPECT_NEAR(closed.volume() / volume_of(clean), 1, 0.02);
  TriangleMesh hole = clean;  // one without its cap: an opening of 0.4 radii
  std::erase_if(hole.triangles,
                [&](const auto& t) { return (hole.vertices[t[0]] - kCentre).normalized().z() > std::cos(0.2); });
  const EnclosedSolid open(hole, 2.0 / 15 * kRadius, kSpacing);
  EXPECT_LT(open.depth(), 3e-3);  // the wall's own closing
  const EnclosedSolid bridged(hole, 8.0 / 15 * kRadius, kSpacing);
  EXPECT_NEAR(bridged.volume() / volume_of(clean), 1, 0.03);
}

TEST(EnclosedSolid, InnerWallsDoNotMatter) {
  TriangleMesh walls = icosphere(kCentre, kRadius, kLevel);
  append_flipped(walls, icosphere(kCentre, 0.97 * kRadius, kLevel));  // the inner side of a capsule
  append(walls, icosphere(kCentre + Eigen::Vector3d(kRadius / 3, 0, 0), kRadius / 4, 3));
  const EnclosedSolid solid(walls, 1e-3, kSpacing);
  EXPECT_NEAR(solid.volume() / volume_of(icosphere(kCentre, kRadius, kLevel)), 1, 0.01);
}

TEST(EnclosedSolid, SheetEnclosesNothing) {
  constexpr double kSide = support::kSanitized ? 0.04 : 0.1;
  TriangleMesh sheet;
  sheet.vertices = {{0, 0, 0}, {kSide, 0, 0}, {kSide, kSide, kSide / 10}, {0, kSide, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  const EnclosedSolid solid(sheet, 2e-3, kSpacing);
  EXPECT_LT(solid.depth(), 0.5 * kSpacing);
}

TEST(EnclosedSolid, GridGrowsCoarserRatherThanLarge) {
  const EnclosedSolid solid(icosphere(kCentre, 0.2, 3), 1e-4, 1e-4, kLimits);
  EXPECT_GT(solid.spacing(), 1e-3);
  EXPECT_GE(solid.gap(), 2 * solid.spacing() * (1 - 1e-12));
}

TEST(EnclosedSolid, SmallTrianglesKeepTheSpacingThatIsAskedFor) {
  // Edges from seven spacings to less than one.
  for (const int level : {2, 4, 5}) {
    const EnclosedSolid solid(icosphere(kCentre, 0.02, level), 2e-3, 0.8e-3);
    EXPECT_EQ(solid.spacing(), 0.8e-3) << level;
    EXPECT_EQ(solid.gap(), 2e-3) << level;
  }
}

TEST(EnclosedSolid, ManyLargeTrianglesGetACoarserGrid) {
  constexpr double kBox = 0.3;  // m
  std::mt19937 random(1);
  const auto coordinate = [&] { return kBox * static_cast<double>(random()) / std::mt19937::max(); };
  TriangleMesh soup;
  for (std::uint32_t t = 0; t < 2000; ++t) {
    for (int corner = 0; corner < 3; ++corner) {
      const double x = coordinate(), y = coordinate(), z = coordinate();
      soup.vertices.emplace_back(x, y, z);
    }
    soup.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  const EnclosedSolid solid(soup, 1e-3, kSpacing, kLimits);
  // Twice as coarse as the number of nodes alone would make it.
  EXPECT_GT(solid.spacing(), 2 * kBox / std::cbrt(kLimits.nodes));
  EXPECT_GE(solid.gap(), 2 * solid.spacing() * (1 - 1e-12));
  // So many walls leave no way in: the solid is the box, less what lies between the outermost of them.
  EXPECT_GT(solid.volume(), 0.5 * kBox * kBox * kBox);
  EXPECT_LT(solid.volume(), 1.05 * kBox * kBox * kBox);
  EXPECT_GT(solid.depth(), 0.3 * kBox);
  EXPECT_LT(solid.depth(), 0.51 * kBox);
  EXPECT_LT(solid.signed_distance(Eigen::Vector3d::Constant(kBox / 2)), 0);
  for (const double x : {-1.0, -0.01, 0.0, 0.1, 0.29, 0.31, 1.0}) {
    EXPECT_TRUE(std::isfinite(solid.signed_distance({x, 0.15, 0.3 - x}))) << x;
  }
}

}  // namespace
}  // namespace stylet::import
