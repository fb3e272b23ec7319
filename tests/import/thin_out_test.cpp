// Fewer triangles: where they may be saved, and what must stay as it was.
#include "engine/import/thin_out.h"

#include "engine/mesh/surface_mesh.h"
#include "tests/mesh/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace stylet::import {
namespace {

using mesh::inspect;
using mesh::SurfaceReport;
using mesh::TriangleMesh;
using mesh::test::icosphere;

constexpr double kRadius = 0.04;  // m
constexpr double kError = 0.05e-3;

TEST(ThinOut, ABallStaysOneWithinTheError) {
  const TriangleMesh ball = icosphere({0, 0, 0}, kRadius, 5);
  const TriangleMesh thin = thin_out(ball, kError);
  EXPECT_LT(thin.triangles.size(), ball.triangles.size() / 2);
  const SurfaceReport report = inspect(thin);
  EXPECT_TRUE(report.closed() && report.oriented());
  EXPECT_EQ(report.euler_characteristic(), 2);
  EXPECT_NEAR(report.volume / inspect(ball).volume, 1, 0.003);
  double farthest = 0;
  for (const auto& t : thin.triangles) {
    const Eigen::Vector3d middle = (thin.vertices[t[0]] + thin.vertices[t[1]] + thin.vertices[t[2]]) / 3;
    farthest =
        std::max({farthest, std::abs(middle.norm() - kRadius), std::abs(thin.vertices[t[0]].norm() - kRadius)});
  }
  std::printf("%zu of %zu triangles, at most %.3f mm off the ball\n", thin.triangles.size(), ball.triangles.size(),
              farthest * 1e3);
  EXPECT_LT(farthest, 2 * kError);
  EXPECT_EQ(thin_out(ball, kError).triangles, thin.triangles);
}

TEST(ThinOut, AFlatDiscKeepsItsRim) {
  TriangleMesh disc = icosphere({0, 0, 0}, kRadius, 4);
  std::erase_if(disc.triangles, [&](const auto& t) {
    return std::ranges::any_of(t, [&](std::uint32_t v) { return disc.vertices[v].z() < 0; });
  });
  for (Eigen::Vector3d& x : disc.vertices) x.z() = 0;
  disc = mesh::clean_surface(disc, "disc");
  const TriangleMesh thin = thin_out(disc, kError);
  EXPECT_LT(thin.triangles.size(), disc.triangles.size() / 2);
  EXPECT_EQ(inspect(thin).boundary_edges, inspect(disc).boundary_edges);
  EXPECT_NEAR(inspect(thin).area, inspect(disc).area, 1e-9 * inspect(disc).area);
}

TEST(ThinOut, WhatIsNoManifoldComesBackAsItIs) {
  TriangleMesh fin = icosphere({0, 0, 0}, kRadius, 3);
  const auto& t = fin.triangles.front();
  fin.vertices.push_back(2 * fin.vertices[t[0]]);
  fin.triangles.push_back({t[0], t[1], static_cast<std::uint32_t>(fin.vertices.size() - 1)});
  const TriangleMesh thin = thin_out(fin, kError);
  EXPECT_EQ(thin.triangles, fin.triangles);
}

}  // namespace
}  // namespace stylet::import
