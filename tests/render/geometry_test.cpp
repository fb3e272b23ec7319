// What is drawn, without a GPU: the needle's tube, the probe's body, the camera.
#include "engine/render/geometry.h"
#include "engine/content/scene.h"
#include "engine/render/camera.h"
#include "engine/render/needle_mesh.h"
#include "engine/render/probe_mesh.h"
#include "engine/render/rod_mesh.h"
#include "engine/render/thinning.h"
#include "tests/render/test_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace stylet::render {
namespace {

using Eigen::Quaternionf;
using Eigen::Vector3d;
using Eigen::Vector3f;

Vector3f position(const DrawnVertex& v) {
  return {v.position[0], v.position[1], v.position[2]};
}
Vector3f normal(const DrawnVertex& v) {
  return {v.normal[0], v.normal[1], v.normal[2]};
}

/// Nodes and frames of an arc of radius R in the x-z plane, starting along +z and bending towards +x.
struct Arc {
  std::vector<Vector3f> positions;
  std::vector<Quaternionf> orientations;
  Arc(float radius, float length, int beams) {
    for (int i = 0; i <= beams; ++i) {
      const float angle = length / radius * static_cast<float>(i) / static_cast<float>(beams);
      positions.emplace_back(radius * (1 - std::cos(angle)), 0, radius * std::sin(angle));
      orientations.emplace_back(Eigen::AngleAxisf(angle, Vector3f::UnitY()));
    }
  }
};

TEST(NeedleMesh, TubeStaysOnTheArcBetweenItsNodes) {
  const float radius = 0.2F, length = 0.15F;
  const Arc arc(radius, length, 8);
  NeedleMesh mesh(9, 0.00127, length);
  const auto vertices = mesh.shape(arc.positions, arc.orientations);
  // Every vertex of the shaft but the ground ones lies half a diameter from the circle's line.
  std::set<std::uint32_t> shaft(mesh.shaft_indices().begin(), mesh.shaft_indices().end());
  int checked = 0;
  for (std::uint32_t i : shaft) {
    const Vector3f p = position(vertices[i]);
    if (vertices[i].position[3] > length - 0.004F) continue;
    const float from_circle = std::hypot(p.x() - radius, p.z()) - radius;
    EXPECT_NEAR(std::hypot(from_circle, p.y()), 0.000635, 2e-6);  // a cubic strays from the arc by 1e-7 m here
    ++checked;
  }
  EXPECT_GT(checked, 500);
}

TEST(NeedleMesh, LengthAlongTheShaftIsArcLength) {
  const float length = 0.15F;
  const Arc arc(0.2F, length, 8);
  NeedleMesh mesh(9, 0.00127, length);
  const auto vertices = mesh.shape(arc.positions, arc.orientations);
  for (std::uint32_t i : mesh.shaft_indices()) {
    if (vertices[i].position[3] > length - 0.004F) continue;
    const Vector3f p = position(vertices[i]);
    EXPECT_NEAR(vertices[i].position[3], 0.2F * std::atan2(p.z(), 0.2F - p.x()), 5e-5);
  }
}

TEST(NeedleMesh, BevelLooksToPlusXAndItsPointIsAtMinusX) {
  const Arc straight(1e6F, 0.15F, 8);
  NeedleMesh mesh(9, 0.002, 0.15);
  const auto vertices = mesh.shape(straight.positions, straight.orientations);
  float farthest = -1;
  Vector3f point = Vector3f::Zero();
  for (std::uint32_t i : mesh.shaft_indices())
    if (position(vertices[i]).z() > farthest) {
      farthest = position(vertices[i]).z();
      point = position(vertices[i]);
    }
  EXPECT_NEAR(point.z(), 0.15, 1e-4);
  EXPECT_NEAR(point.x(), -0.001, 1e-4);
  const Vector3f face = normal(vertices[mesh.shaft_indices().back()]);
  EXPECT_NEAR(std::atan2(face.z(), face.x()), kBevelAngle, 1e-3);
}

TEST(NeedleMesh, TrianglesFaceOutward) {
  const Arc arc(0.3F, 0.15F, 8);
  NeedleMesh mesh(9, 0.00127, 0.15);
  const auto vertices = mesh.shape(arc.positions, arc.orientations);
  for (const auto indices : {mesh.shaft_indices(), mesh.hub_indices()})
    for (std::size_t t = 0; t < indices.size(); t += 3) {
      const Vector3f a = position(vertices[indices[t]]), b = position(vertices[indices[t + 1]]),
                     c = position(vertices[indices[t + 2]]);
      const Vector3f n =
          normal(vertices[indices[t]]) + normal(vertices[indices[t + 1]]) + normal(vertices[indices[t + 2]]);
      // Where a bent shaft is ground flush, slivers may lean; a triangle of the tube has 6e-7 m^2.
      EXPECT_GE((b - a).cross(c - a).dot(n), -3e-8F) << t;
    }
}

/// By the divergence theorem.
double volume(std::span<const DrawnVertex> vertices, std::span<const std::uint32_t> indices) {
  double sum = 0;
  for (std::size_t t = 0; t < indices.size(); t += 3) {
    const Vector3f a = position(vertices[indices[t]]), b = position(vertices[indices[t + 1]]),
                   c = position(vertices[indices[t + 2]]);
    sum += a.cross(b).dot(c) / 6;
  }
  return sum;
}
/// Of a disc's area in a polygon of twenty corners.
const double kTwentyCorners = 10 * std::sin(M_PI / 10) / M_PI;

TEST(RodMesh, RodsAreClosedAndFaceOutward) {
  RodMesh mesh(5);
  const std::vector<Rod> rods(3, {{0, 0.01F, 0}, {0.01F, 0.02F, 0.01F}, 0.001F});
  const auto vertices = mesh.shape(rods);
  const double expected = 3 * kTwentyCorners * M_PI * 1e-6 * std::sqrt(3e-4);
  EXPECT_NEAR(volume(vertices, mesh.indices().first(RodMesh::index_count(3))), expected, 1e-5 * expected);
  EXPECT_EQ(mesh.shape(std::vector<Rod>(50)).size(), mesh.vertex_count());
  EXPECT_EQ(mesh.indices().size(), RodMesh::index_count(5));
}

TEST(Syringe, ShowsTheVolumeThatItHolds) {
  RodMesh mesh(kSyringeParts);
  for (const float held : {0.0F, 10e-6F, 60e-6F, 90e-6F}) {
    const auto rods = syringe_rods({.capacity = 60e-6F, .held = held}, {0.1F, 0, 0}, Quaternionf::UnitRandom());
    const auto vertices = mesh.shape(rods);
    const double shown = volume(vertices, mesh.indices().first(RodMesh::index_count(1))) / kTwentyCorners;
    EXPECT_NEAR(shown, std::min(held, 60e-6F), 1e-9) << held;
    // In the barrel, an empty one too.
    const Rod& around = rods[static_cast<std::size_t>(SyringePart::barrel)];
    const Vector3f axis = (around.to - around.from).normalized();
    for (const DrawnVertex& vertex : vertices.first(vertices.size() / kSyringeParts)) {
      const Vector3f from = Vector3f(vertex.position[0], vertex.position[1], vertex.position[2]) - around.from;
      EXPECT_GE(from.dot(axis), 0);
      EXPECT_LE(from.dot(axis), (around.to - around.from).norm());
      EXPECT_LE((from - from.dot(axis) * axis).norm(), around.radius);
    }
    // Out to the last drop the seal stays in the barrel.
    const Rod& seal = rods[static_cast<std::size_t>(SyringePart::seal)];
    const Rod& barrel = rods[static_cast<std::size_t>(SyringePart::barrel)];
    EXPECT_LT((seal.to - barrel.from).norm(), (barrel.to - barrel.from).norm()) << held;
  }
}

TEST(ProbeMesh, BodyIsClosedAndItsFaceFollowsTheArray) {
  content::Probe probe;
  const ProbeMesh mesh = probe_body(probe);
  float lowest = 1, highest = -1;
  for (const Vector3f& p : mesh.positions) {
    lowest = std::min(lowest, p.z());
    highest = std::max(highest, p.z());
    // In front, nothing of the probe sticks out beyond its array's arc.
    if (p.z() < -0.04F) continue;
    EXPECT_LE(std::hypot(p.x(), p.z() + static_cast<float>(probe.radius)), probe.radius + 2e-4);
  }
  EXPECT_NEAR(highest, 0, 1e-4);
  EXPECT_LT(lowest, -0.12F);
  // Outward: the volume by the divergence theorem is positive, and of a hand-held thing.
  double volume = 0;
  for (std::size_t t = 0; t < mesh.indices.size(); t += 3)
    volume +=
        mesh.positions[mesh.indices[t]].cast<double>().dot(mesh.positions[mesh.indices[t + 1]].cast<double>().cross(
            mesh.positions[mesh.indices[t + 2]].cast<double>())) /
        6;
  EXPECT_GT(volume, 5e-5);
  EXPECT_LT(volume, 4e-4);
}

TEST(ProbeMesh, FanHoldsTheWholeSector) {
  content::Probe probe;
  const ProbeMesh mesh = probe_fan(probe);
  double area = 0;
  for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
    const Vector3f &a = mesh.positions[mesh.indices[t]], &b = mesh.positions[mesh.indices[t + 1]],
                   &c = mesh.positions[mesh.indices[t + 2]];
    EXPECT_EQ(a.y(), 0);
    area += 0.5 * static_cast<double>((b - a).cross(c - a).norm());
  }
  const double sector =
      0.5 * probe.field_of_view * (std::pow(probe.radius + probe.depth, 2) - std::pow(probe.radius, 2));
  EXPECT_GE(area, sector);
  EXPECT_LT(area, 1.01 * sector);
  content::Probe linear{.convex = false};
  double width = 0;
  for (const Vector3f& p : probe_fan(linear).positions) width = std::max(width, 2.0 * static_cast<double>(p.x()));
  EXPECT_NEAR(width, linear.width, 1e-6);
}

TEST(Geometry, SkinIsSeenWhetherItIsTheOutsideOfTheWallOrALayerOfIt) {
  content::Scene scene = tests::make_test_scene();
  scene.tissues.push_back({.name = "fat", .colour = {0.86F, 0.66F, 0.25F, 0.3F}});
  content::Surface wall = scene.surfaces[1];  // some surface of the body
  ASSERT_EQ(wall.body, 0);
  wall.role = content::SurfaceRole::boundary;
  wall.name = "wall";
  wall.tissue = 1;
  content::Surface fat = wall, skin = wall;
  fat.name = "fat";
  fat.tissue = static_cast<int>(scene.tissues.size()) - 1;
  skin.name = "layer of skin";
  fat.role = skin.role = content::SurfaceRole::region;
  const auto covers = [&](std::vector<content::Surface> surfaces) {
    scene.surfaces = std::move(surfaces);
    std::vector<std::string> names;
    for (const Piece& piece : Geometry(scene).covers) names.push_back(piece.name);
    return names;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(covers({wall, fat}), (Names{"wall", "fat"})) << "nothing else shows the skin";
  EXPECT_EQ(covers({wall, skin, fat}), (Names{"layer of skin", "fat"}));
}

TEST(Eyes, WhatIsLookedAtIsInTheMiddleOfBothEyes) {
  const content::Camera camera{.eye = {0.3, 0.2, 0.5}, .look_at = {0.01, 0, -0.05}, .up = Vector3d::UnitY()};
  for (const Eye& eye : eyes_of(camera, 1.5, 2, {})) {
    const Vector3d pixel = project(eye, camera.look_at, 300, 200);
    EXPECT_NEAR(pixel.x(), 150, 1e-9);
    EXPECT_NEAR(pixel.y(), 100, 1e-9);
    EXPECT_NEAR(pixel.z(), (camera.look_at - camera.eye).norm(), 1e-12);
  }
}

TEST(Eyes, ParallelAxesGiveTheTextbookDisparity) {
  const content::Camera camera{
      .eye = Vector3d::Zero(), .look_at = -Vector3d::UnitZ(), .up = Vector3d::UnitY(), .vertical_fov = 0.8};
  const auto eyes =
      eyes_of(camera, 1, 2, {.eye_separation = 0.06, .convergence = std::numeric_limits<double>::infinity()});
  const double focal = 250 / std::tan(0.4);
  for (double z : {0.3, 0.5, 2.0}) {
    const Vector3d p(0.02, -0.01, -z);
    EXPECT_NEAR(project(eyes[0], p, 500, 500).x() - project(eyes[1], p, 500, 500).x(), focal * 0.06 / z, 1e-9);
  }
}

TEST(Eyes, LookingAlongUpStillGivesAPicture) {
  const content::Camera camera{.eye = {0, 1, 0}, .look_at = Vector3d::Zero(), .up = Vector3d::UnitY()};
  EXPECT_TRUE(eyes_of(camera, 1, 1, {})[0].clip_from_patient.allFinite());
}

/// A ball as rings of points, its two poles shared.
struct Ball {
  std::vector<Vector3f> positions;
  std::vector<std::uint32_t> indices;
  Ball(float radius, std::uint32_t rings, std::uint32_t sides) {
    const auto point = [&](double polar, double round) {
      return Vector3f(radius *
                      Vector3d(std::sin(polar) * std::cos(round), std::sin(polar) * std::sin(round), std::cos(polar))
                          .cast<float>());
    };
    positions.push_back(point(0, 0));
    for (std::uint32_t i = 1; i < rings; ++i)
      for (std::uint32_t j = 0; j < sides; ++j)
        positions.push_back(point(std::numbers::pi * i / rings, 2 * std::numbers::pi * j / sides));
    positions.push_back(point(std::numbers::pi, 0));
    const auto at = [&](std::uint32_t i, std::uint32_t j) {
      return i == 0       ? 0
             : i == rings ? static_cast<std::uint32_t>(positions.size() - 1)
                          : 1 + (i - 1) * sides + j % sides;
    };
    for (std::uint32_t i = 0; i < rings; ++i)
      for (std::uint32_t j = 0; j < sides; ++j) {
        if (i > 0) indices.insert(indices.end(), {at(i, j), at(i + 1, j), at(i, j + 1)});
        if (i + 1 < rings) indices.insert(indices.end(), {at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)});
      }
  }
};

TEST(Thinned, ABallKeepsItsShapeInFewerTriangles) {
  constexpr float kRadius = 0.05F, kError = 0.4e-3F;
  const Ball ball(kRadius, 60, 120);
  const ThinnedSurface left = thinned(ball.positions, ball.indices, {.error = kError});
  EXPECT_LT(left.indices.size(), ball.indices.size() / 4);
  EXPECT_GT(left.indices.size(), 300U);
  EXPECT_TRUE(std::ranges::is_sorted(left.vertices));
  std::set<std::uint32_t> used(left.indices.begin(), left.indices.end());
  EXPECT_EQ(used.size(), left.vertices.size()) << "no vertex is left that nothing joins";
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (std::size_t t = 0; t + 2 < left.indices.size(); t += 3) {
    Vector3f middle = Vector3f::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      middle += ball.positions[left.vertices[left.indices[t + k]]] / 3;
      ++edges[{left.indices[t + k], left.indices[t + (k + 1) % 3]}];
    }
    EXPECT_NEAR(middle.norm(), kRadius, 3 * kError);  // the limit is an average over the planes that met there
  }
  for (const auto& [edge, times] : edges) {
    EXPECT_EQ(times, 1);
    EXPECT_EQ(edges.count({edge.second, edge.first}), 1U) << "closed, and turned as it was";
  }
}

TEST(Thinned, WithoutAnErrorNothingChanges) {
  const Ball ball(0.05F, 12, 20);
  const ThinnedSurface left = thinned(ball.positions, ball.indices, {});
  EXPECT_EQ(left.indices, ball.indices);
  EXPECT_EQ(left.vertices.size(), ball.positions.size());
}

}  // namespace
}  // namespace stylet::render
