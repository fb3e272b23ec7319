#include "engine/files/error.h"
#include "engine/mesh/decimation.h"
#include "engine/mesh/solid.h"
#include "engine/mesh/surface_mesh.h"
#include "tests/mesh/shapes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace stylet::mesh {
namespace {

using test::append_flipped;
using test::icosphere;

std::string refusal(const TriangleMesh& mesh) {
  try {
    solid_surface(mesh, "organ.glb:meshes/3");
  } catch (const files::ContentError& error) {
    return error.what();
  }
  return "";
}

TriangleMesh split_into_soup(const TriangleMesh& mesh) {
  TriangleMesh soup;
  for (const auto& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.vertices.size());
    for (const std::uint32_t v : t) soup.vertices.push_back(mesh.vertices[v]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

TEST(Surface, WeldingASoupGivesBackTheClosedSphere) {
  const TriangleMesh sphere = icosphere({0.1, 0, 0}, 0.05, 3);
  const TriangleMesh soup = split_into_soup(sphere);
  EXPECT_FALSE(inspect(soup).closed());
  const SurfaceReport report = inspect(solid_surface(soup, "sphere"));
  EXPECT_EQ(report.vertices, static_cast<int>(sphere.vertices.size()));
  EXPECT_EQ(report.triangles, static_cast<int>(sphere.triangles.size()));
  EXPECT_TRUE(report.closed());
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.euler_characteristic(), 2);
}

TEST(Surface, MixedWindingIsTurnedOutward) {
  TriangleMesh sphere = icosphere({0, 0.2, 0}, 0.05, 3);
  const double volume = inspect(sphere).volume;
  std::mt19937 random(7);
  for (auto& t : sphere.triangles) {
    if (random() % 2) std::swap(t[0], t[1]);
  }
  EXPECT_GT(inspect(sphere).misoriented_edges, 0);
  const SurfaceReport report = inspect(solid_surface(sphere, "sphere"));
  EXPECT_TRUE(report.oriented());
  EXPECT_NEAR(report.volume, volume, 1e-12 * volume);
}

TEST(Surface, DegenerateAndDuplicateTrianglesAreDropped) {
  TriangleMesh sphere = icosphere({0, 0, 0}, 0.05, 2);
  const std::size_t count = sphere.triangles.size();
  sphere.triangles.push_back({3, 3, 5});
  const auto first = sphere.triangles[0];
  sphere.triangles.push_back({first[1], first[0], first[2]});
  sphere.vertices.push_back({9, 9, 9});
  const TriangleMesh clean = solid_surface(sphere, "sphere");
  EXPECT_EQ(clean.triangles.size(), count);
  EXPECT_LT(inspect(clean).bounds.max().maxCoeff(), 0.06);
}

TEST(Surface, OpenSurfaceIsRefusedWithItsBoundaryEdges) {
  TriangleMesh sphere = icosphere({0, 0, 0}, 0.05, 2);
  sphere.triangles.erase(sphere.triangles.begin() + 17);
  const std::string message = refusal(sphere);
  EXPECT_THAT(message, testing::StartsWith("organ.glb:meshes/3: "));
  EXPECT_THAT(message, testing::HasSubstr("open (3 boundary edges)"));
  EXPECT_THAT(message, testing::Not(testing::HasSubstr("\n")));
}

TEST(Surface, DoubleWalledShellIsWatertightButNotSolid) {
  TriangleMesh shell = icosphere({0, 0, 0}, 0.080, 3);
  append_flipped(shell, icosphere({0, 0, 0}, 0.0799, 3));
  // The inner wall, as an orientation of its own, would be turned outward and double the volume: join the two walls
  // by a tunnel as the real capsules are.
  auto& triangles = shell.triangles;
  const std::size_t inner = triangles.size() / 2;
  const std::array<std::uint32_t, 3> top = triangles[0];
  const auto offset = static_cast<std::uint32_t>(shell.vertices.size() / 2);
  triangles.erase(triangles.begin() + static_cast<std::ptrdiff_t>(inner));
  triangles.erase(triangles.begin());
  for (int i = 0; i < 3; ++i) {
    const std::uint32_t a = top[i];
    const std::uint32_t b = top[(i + 1) % 3];
    triangles.push_back({a, b, b + offset});
    triangles.push_back({a, b + offset, a + offset});
  }
  EXPECT_TRUE(inspect(clean_surface(shell, "shell")).closed());
  EXPECT_THAT(refusal(shell), testing::HasSubstr("is closed but encloses almost nothing"));
}

TEST(Surface, NonManifoldEdgesAndPinchedVerticesAreRefused) {
  TriangleMesh fin = icosphere({0, 0, 0}, 0.05, 2);
  fin.vertices.push_back({0.1, 0, 0});
  const auto t = fin.triangles[0];
  fin.triangles.push_back({t[0], t[1], static_cast<std::uint32_t>(fin.vertices.size() - 1)});
  EXPECT_NE(refusal(fin), "");

  TriangleMesh kiss = icosphere({0, 0, 0}, 0.05, 2);
  const TriangleMesh other = icosphere({0, 0, 0}, 0.05, 2);
  const Eigen::Vector3d touch = kiss.vertices[0];
  TriangleMesh mirrored = other;
  for (auto& x : mirrored.vertices) x = 2 * touch - x;  // point reflection: shares exactly the vertex 0
  append(kiss, mirrored);
  EXPECT_THAT(refusal(kiss), testing::HasSubstr("touches itself in 1 vertices"));
}

TEST(Surface, NonFiniteVertexAndWildIndexAreNamed) {
  TriangleMesh sphere = icosphere({0, 0, 0}, 0.05, 1);
  sphere.vertices[5].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(sphere), testing::HasSubstr("vertex 5 is not finite"));
  sphere = icosphere({0, 0, 0}, 0.05, 1);
  sphere.triangles[2][1] = 4000;
  EXPECT_THAT(refusal(sphere), testing::HasSubstr("triangle 2 names vertex 4000"));
  EXPECT_THAT(refusal(TriangleMesh{}), testing::HasSubstr("no triangle"));
}

TEST(Surface, NormalsOfASphereAreRadial) {
  const TriangleMesh sphere = icosphere({0.3, 0, -0.1}, 0.05, 4);
  const auto normals = smooth_normals(sphere);
  for (std::size_t v = 0; v < normals.size(); ++v) {
    const Eigen::Vector3d radial = (sphere.vertices[v] - Eigen::Vector3d(0.3, 0, -0.1)).normalized();
    EXPECT_GT(normals[v].cast<double>().dot(radial), 0.9995);
  }
}

TEST(Solid, DistanceToABoxIsExactInAllItsRegions) {
  TriangleMesh box;
  for (int i = 0; i < 8; ++i)
    box.vertices.push_back({i & 1 ? 0.03 : -0.03, i & 2 ? 0.02 : -0.02, i & 4 ? 0.01 : -0.01});
  box.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                   {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  const Solid solid(solid_surface(box, "box"));
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-0.06, 0.06);
  for (int i = 0; i < 4000; ++i) {
    const Eigen::Vector3d x(uniform(random), uniform(random), uniform(random));
    const Eigen::Vector3d q = x.cwiseAbs() - Eigen::Vector3d(0.03, 0.02, 0.01);
    const double exact = q.cwiseMax(0).norm() + std::min(0.0, q.maxCoeff());
    ASSERT_NEAR(solid.signed_distance(x), exact, 1e-14) << x.transpose();
  }
}

TEST(Solid, SegmentThroughASphereCrossesTwice) {
  const Solid solid(icosphere({0, 0, 0}, 0.05, 3));
  EXPECT_EQ(solid.crossings({-0.1, 0.003, 0.007}, {0.1, 0.004, 0.009}), 2);
  EXPECT_EQ(solid.crossings({0.001, 0.003, 0.007}, {0.1, 0.004, 0.009}), 1);
  EXPECT_EQ(solid.crossings({-0.1, 0.06, 0.007}, {0.1, 0.06, 0.009}), 0);
}

TEST(Decimation, OnTheVerticesAsTheyAreItIsTheSameSurface) {
  const TriangleMesh sphere = icosphere({0, 0, 0.1}, 0.05, 4);
  const DecimationLimits limits{.turn_deg = 20, .aspect = 8, .error = 3e-4};
  const TriangleMesh moved = decimate(sphere, limits);
  TriangleMesh kept = sphere;
  kept.triangles = decimated_triangles(sphere, limits);
  ASSERT_LT(kept.triangles.size(), sphere.triangles.size() / 2);
  const SurfaceReport a = inspect(moved), b = inspect(clean_surface(kept, "sphere"));
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_NEAR(a.volume, b.volume, 1e-12 * a.volume);
  EXPECT_TRUE(b.closed());
}

TEST(Decimation, CollapsesNoEdgeThatIsLong) {
  const TriangleMesh sphere = icosphere({0, 0, 0}, 0.05, 4);
  const auto triangles = [&](double edge) {
    return decimated_triangles(sphere, {.turn_deg = 20, .aspect = 8, .error = 1e-3, .edge = edge}).size();
  };
  EXPECT_EQ(triangles(1e-3), sphere.triangles.size()) << "all are longer";
  EXPECT_LT(triangles(0.01), sphere.triangles.size() / 4);
}

}  // namespace
}  // namespace stylet::mesh
