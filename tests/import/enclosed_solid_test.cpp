// Dirty spheres whose volume is known: patches apart, walls doubled, triangles turned, a hole.
#include "engine/import/enclosed_solid.h"
#include "tests/content/shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace stylet::import {
namespace {

using content::TriangleMesh;
using content::test::append;
using content::test::icosphere;

constexpr double kRadius = 0.03;
constexpr double kSpacing = 0.5e-3;
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
  const TriangleMesh sphere = icosphere(kCentre, kRadius, 4);
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
  const TriangleMesh clean = icosphere(kCentre, kRadius, 4);
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
  const TriangleMesh clean = icosphere(kCentre, kRadius, 4);
  const TriangleMesh slit = dirty_sphere(0.4e-3);  // slits of up to 0.8 mm
  const EnclosedSolid closed(slit, 2e-3, kSpacing);
  EXPECT_NEAR(closed.volume() / volume_of(clean), 1, 0.02);
  TriangleMesh hole = clean;  // one without its cap: an opening of 12 mm
  std::erase_if(hole.triangles,
                [&](const auto& t) { return (hole.vertices[t[0]] - kCentre).normalized().z() > std::cos(0.2); });
  const EnclosedSolid open(hole, 4e-3, kSpacing);
  EXPECT_LT(open.depth(), 3e-3);  // the wall's own closing
  const EnclosedSolid bridged(hole, 16e-3, kSpacing);
  EXPECT_NEAR(bridged.volume() / volume_of(clean), 1, 0.03);
}

TEST(EnclosedSolid, InnerWallsDoNotMatter) {
  TriangleMesh walls = icosphere(kCentre, kRadius, 4);
  append(walls, icosphere(kCentre, 0.97 * kRadius, 4), true);  // the inner side of a capsule
  append(walls, icosphere(kCentre + Eigen::Vector3d(0.01, 0, 0), 0.008, 3));
  const EnclosedSolid solid(walls, 1e-3, kSpacing);
  EXPECT_NEAR(solid.volume() / volume_of(icosphere(kCentre, kRadius, 4)), 1, 0.01);
}

TEST(EnclosedSolid, SheetEnclosesNothing) {
  TriangleMesh sheet;
  sheet.vertices = {{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.1, 0.01}, {0, 0.1, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  const EnclosedSolid solid(sheet, 2e-3, kSpacing);
  EXPECT_LT(solid.depth(), 0.5 * kSpacing);
}

TEST(EnclosedSolid, GridGrowsCoarserRatherThanLarge) {
  const EnclosedSolid solid(icosphere(kCentre, 0.2, 3), 1e-4, 1e-4);
  EXPECT_GT(solid.spacing(), 1e-3);
  EXPECT_GE(solid.gap(), 2 * solid.spacing() * (1 - 1e-12));
}

}  // namespace
}  // namespace stylet::import
