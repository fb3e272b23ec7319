#include "engine/mesh/stuffing.h"
#include "engine/files/error.h"
#include "engine/mesh/solid.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/mesh/tet_manifold.h"
#include "engine/mesh/tet_quality.h"
#include "engine/mesh/tetrahedralise.h"
#include "tests/mesh/shapes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::mesh {
namespace {

using test::icosphere;

constexpr double kRadius = 0.05;
constexpr double kSphereVolume = 4.0 / 3 * std::numbers::pi * kRadius * kRadius * kRadius;

double sphere(const Eigen::Vector3d& x) {
  return x.norm() - kRadius;
}
const Eigen::AlignedBox3d kSphereBox(Eigen::Vector3d::Constant(-kRadius), Eigen::Vector3d::Constant(kRadius));

void expect_sound(const physics::TetMesh& mesh, int euler_characteristic) {
  const TetQuality quality = tet_quality(mesh);
  EXPECT_EQ(quality.inverted, 0);
  EXPECT_GE(quality.min_dihedral_deg, 12);
  const BoundarySurface boundary = boundary_surface(mesh);
  const SurfaceReport report = inspect(boundary.mesh);
  EXPECT_TRUE(report.closed());
  EXPECT_TRUE(report.oriented());
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.euler_characteristic(), euler_characteristic);
  EXPECT_NEAR(report.volume, quality.volume, 1e-9 * quality.volume);
  EXPECT_NO_THROW(solid_surface(boundary.mesh, "boundary"));  // no pinched vertex either
  std::vector<char> used(mesh.nodes.size(), 0);
  for (const auto& tet : mesh.tets) {
    for (const int node : tet) used[node] = 1;
  }
  EXPECT_EQ(std::count(used.begin(), used.end(), 0), 0);
}

TEST(TetQuality, RegularAndRightTetrahedraHaveTheirAngles) {
  const double degrees = 180 / std::numbers::pi;
  const DihedralRange regular = dihedral_range({1, 1, 1}, {1, -1, -1}, {-1, -1, 1}, {-1, 1, -1});
  EXPECT_NEAR(regular.min * degrees, std::acos(1.0 / 3) * degrees, 1e-9);
  EXPECT_NEAR(regular.max * degrees, std::acos(1.0 / 3) * degrees, 1e-9);
  const DihedralRange right = dihedral_range({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  EXPECT_NEAR(right.min * degrees, std::acos(1 / std::sqrt(3.0)) * degrees, 1e-9);
  EXPECT_NEAR(right.max * degrees, 90, 1e-9);
  EXPECT_EQ(dihedral_range({0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}).min, 0);
}

TEST(Stuffing, SphereIsSoundAtEveryCellSize) {
  for (const double cell : {0.031, 0.02, 0.013, 0.0101, 0.0077}) {
    SCOPED_TRACE(cell);
    expect_sound(stuff(sphere, kSphereBox, cell), 2);
  }
}

TEST(Stuffing, VolumeErrorFallsWithTheSquareOfTheCell) {
  // The boundary nodes lie on the sphere, its faces are chords: error ~ cell^2. Counted over a factor of four.
  const double coarse = 1 - tet_quality(stuff(sphere, kSphereBox, 0.020)).volume / kSphereVolume;
  const double fine = 1 - tet_quality(stuff(sphere, kSphereBox, 0.005)).volume / kSphereVolume;
  EXPECT_GT(coarse, 0);
  EXPECT_GT(fine, 0);
  const double order = std::log(coarse / fine) / std::log(4.0);
  EXPECT_GT(order, 1.7);
  EXPECT_LT(order, 2.6);
}

TEST(Stuffing, BoundaryNodesLieOnTheSurface) {
  const physics::TetMesh mesh = stuff(sphere, kSphereBox, 0.012);
  for (const int node : boundary_surface(mesh).nodes) {
    EXPECT_NEAR(mesh.nodes[node].norm(), kRadius, 1e-3 * 0.012);
  }
}

TEST(Stuffing, TorusKeepsItsHole) {
  const auto torus = [](const Eigen::Vector3d& x) {
    return std::hypot(std::hypot(x.x(), x.y()) - 0.04, x.z()) - 0.015;
  };
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-0.055, -0.055, -0.015), Eigen::Vector3d(0.055, 0.055, 0.015));
  expect_sound(stuff(torus, box, 0.008), 0);
}

TEST(Stuffing, SharpEdgesAndThinPartsStayAboveTheAngleBound) {
  // A wedge that thins out below the cell size: pinches and slivers would show here.
  const auto wedge = [](const Eigen::Vector3d& x) {
    const double top = (x - Eigen::Vector3d(-0.06, 0, 0)).dot(Eigen::Vector3d(-0.15, 0.05, 0.98).normalized());
    return std::max({top, -x.z() - 0.004, x.norm() - 0.08});
  };
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-0.081, -0.081, -0.005), Eigen::Vector3d(0.081, 0.081, 0.04));
  for (const double cell : {0.014, 0.011, 0.009, 0.007}) {
    SCOPED_TRACE(cell);
    expect_sound(stuff(wedge, box, cell), 2);
  }
}

TEST(Stuffing, MeasuresLittleMoreThanTheSurfaceOfAThinThingInALargeBox) {
  // A ring of 8 mm in a box of half a metre: 4 million lattice points, of which some hundred thousand lie near it.
  constexpr double kCell = 4e-3;
  const Eigen::AlignedBox3d box(Eigen::Vector3d::Constant(-0.25), Eigen::Vector3d::Constant(0.25));
  const auto ring = [](const Eigen::Vector3d& x) {
    return std::hypot(std::hypot(x.x(), x.y()) - 0.2, x.z()) - 0.008;
  };
  std::size_t asked = 0;
  const physics::TetMesh mesh = stuff(
      [&](const Eigen::Vector3d& x) {
        ++asked;
        return ring(x);
      },
      box, kCell, 0);
  const double points = 2 * std::pow(0.5 / kCell, 3);
  EXPECT_LT(static_cast<double>(asked), 0.12 * points);
  // What lies deep inside or far outside has the sign of its neighbourhood: the same mesh as where every point is
  // measured, which a distance that nowhere says "far" makes sure of.
  const physics::TetMesh whole =
      stuff([&](const Eigen::Vector3d& x) { return std::clamp(ring(x), -2 * kCell, 2 * kCell); }, box, kCell, 0);
  EXPECT_TRUE(mesh.nodes == whole.nodes);
  EXPECT_TRUE(mesh.tets == whole.tets);
}

TEST(Stuffing, SameInputGivesTheSameBits) {
  const physics::TetMesh a = stuff(sphere, kSphereBox, 0.011);
  const physics::TetMesh b = stuff(sphere, kSphereBox, 0.011);
  EXPECT_TRUE(a.nodes == b.nodes);
  EXPECT_TRUE(a.tets == b.tets);
}

TEST(Stuffing, OnlyTheLargestPartStays) {
  const auto two = [](const Eigen::Vector3d& x) {
    return std::min(sphere(x), (x - Eigen::Vector3d(0.09, 0, 0)).norm() - 0.025);
  };
  const Eigen::AlignedBox3d box(Eigen::Vector3d::Constant(-kRadius), Eigen::Vector3d(0.115, kRadius, kRadius));
  const physics::TetMesh mesh = stuff(two, box, 0.01);
  expect_sound(mesh, 2);
  for (const auto& x : mesh.nodes) EXPECT_LT(x.x(), 0.055);
}

TEST(GradedStuffing, FinerAtTheTargetSoundAndTheSameAtTheSurface) {
  const Eigen::Vector3d target(0.012, 0, 0.004);
  const auto edge_near_target = [&](const physics::TetMesh& mesh) {
    double sum = 0;
    int count = 0;
    for (const auto& tet : mesh.tets) {
      const auto node = [&](std::size_t c) { return mesh.nodes[tet[c]]; };
      if (((node(0) + node(1) + node(2) + node(3)) / 4 - target).norm() > 0.005) continue;
      for (std::size_t a = 0; a < 4; ++a) {
        for (std::size_t b = 0; b < a; ++b, ++count) sum += (node(a) - node(b)).norm();
      }
    }
    return sum / count;
  };
  const physics::TetMesh uniform = stuff(sphere, kSphereBox, 0.009);
  for (const double factor : {2.0, 4.0}) {
    SCOPED_TRACE(factor);
    const physics::TetMesh mesh = stuff_graded(sphere, kSphereBox, 0.009, 6, {.target = target, .factor = factor});
    expect_sound(mesh, 2);
    EXPECT_LT(edge_near_target(mesh), (factor > 2 ? 0.5 : 0.65) * edge_near_target(uniform));
    EXPECT_NEAR(static_cast<double>(mesh.nodes.size()), static_cast<double>(uniform.nodes.size()),
                0.05 * static_cast<double>(uniform.nodes.size()));
    // Nodes of the boundary, most of which smoothing leaves where they are.
    std::size_t same = 0;
    const BoundarySurface boundary = boundary_surface(mesh);
    for (const Eigen::Vector3d& v : boundary_surface(uniform).mesh.vertices) {
      same += std::any_of(boundary.mesh.vertices.begin(), boundary.mesh.vertices.end(),
                          [&](const Eigen::Vector3d& w) { return (v - w).norm() < 1e-4; })
                  ? 1
                  : 0;
    }
    EXPECT_GT(static_cast<double>(same), 0.9 * static_cast<double>(boundary.mesh.vertices.size()));
  }
}

TEST(GradedStuffing, ATargetCloseToTheSurfaceIsSoundToo) {
  for (const double cell : {0.016, 0.009}) {
    expect_sound(stuff_graded(sphere, kSphereBox, cell, 6, {.target = {0.045, 0, 0}, .factor = 3}), 2);
  }
}

TEST(TetManifold, TetrahedraThatShareAnEdgeOrAVertexAreParted) {
  // Two cubes' worth of corners: the second tetrahedron of each pair touches the first in an edge, or in a vertex.
  physics::TetMesh edge{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0.1}, {0, -0.5, 0.1}},
                        {{0, 1, 2, 3}, {0, 4, 5, 3}}};
  keep_manifold_part(edge);
  ASSERT_EQ(edge.tets.size(), 1U);
  EXPECT_EQ(edge.nodes.size(), 4U);
  EXPECT_TRUE(inspect(boundary_surface(edge).mesh).closed());
}

TEST(Tetrahedralise, FindsTheCellForTheWantedNodes) {
  const TriangleMesh surface = icosphere({0.1, -0.2, 0}, 0.07, 4);
  for (const int wanted : {600, 2300}) {
    TetrahedraliseSettings settings;
    settings.target_nodes = wanted;
    const physics::TetMesh mesh = tetrahedralise(surface, settings);
    EXPECT_NEAR(static_cast<double>(mesh.nodes.size()), wanted, 0.1 * wanted);
    expect_sound(mesh, 2);
  }
}

TEST(Tetrahedralise, TurnsBackToALargerCellWhereTheVolumeIsBetterThanAsked) {
  // 1.6 mm thick: a cell that finds little of it, and half that cell misses 5 % where 15 % are accepted.
  constexpr double kThin = 0.0008;
  const SolidShape ring{
      .distance = [](const Eigen::Vector3d& x) { return std::hypot(std::hypot(x.x(), x.y()) - 0.02, x.z()) - kThin; },
      .box = {Eigen::Vector3d(-0.0208, -0.0208, -kThin), Eigen::Vector3d(0.0208, 0.0208, kThin)},
      .volume = 2 * std::numbers::pi * std::numbers::pi * 0.02 * kThin * kThin};
  const FilledPieces filled = fill_pieces({&ring, 1}, {.target_nodes = 0, .volume_error = 0.15});
  const double missed = std::abs(filled.volumes[0] / ring.volume - 1);
  EXPECT_LE(missed, 0.15);
  EXPECT_GT(missed, 0.075);
  EXPECT_LT(filled.mesh.nodes.size(), 3000u) << "5656 without a step back";
}

/// 100 x 100 mm.
SolidShape plate(double thickness) {
  const Eigen::Vector3d half(0.05, 0.05, thickness / 2);
  return {.distance = [half](const Eigen::Vector3d& x) { return (x.cwiseAbs() - half).maxCoeff(); },
          .box = {-half, half},
          .volume = 0.01 * thickness};
}

std::string refusal_of(const SolidShape& shape, const TetrahedraliseSettings& settings) {
  try {
    fill_pieces({&shape, 1}, settings);
  } catch (const files::ContentError& error) {
    return error.what();
  }
  return "";
}

TEST(Tetrahedralise, RefusesACellOfFarTooManyNodesAtOnce) {
  const SolidShape shape = plate(0.1);
  std::size_t looks = 0;
  SolidShape watched = shape;
  watched.distance = [&](const Eigen::Vector3d& x) {
    ++looks;
    return shape.distance(x);
  };
  EXPECT_THAT(
      refusal_of(watched, {.cell = 1e-3, .where = "cube"}),
      testing::MatchesRegex("cube: cells of 1 mm make about 3.5e\\+06 nodes of it, accepted are 2e\\+05; choose "
                            "cells of 2.6 mm or more"));
  EXPECT_EQ(looks, 0u) << "before anything is filled";
}

TEST(Tetrahedralise, EndsWhereItTakesTooMuchOrIsAskedTo) {
  const Solid ball(icosphere({0, 0, 0}, 0.05, 3));
  const SolidShape shape{.distance = [&](const Eigen::Vector3d& x) { return ball.signed_distance(x); },
                         .box = ball.bounds(),
                         .volume = kSphereVolume};
  const auto refusal = [&](const TetrahedraliseSettings& settings) -> std::string {
    try {
      fill_pieces({&shape, 1}, settings);
    } catch (const files::ContentError& error) {
      return error.what();
    }
    return "";
  };
  // The ball's surface is that of a polyhedron, which misses this of it however many nodes there are.
  const TetrahedraliseSettings precise{.target_nodes = 0, .volume_error = 1e-4, .where = "a.glb:liver"};
  TetrahedraliseSettings few = precise;
  few.most_nodes = 2000;
  EXPECT_THAT(refusal(few),
              testing::AllOf(testing::StartsWith("a.glb:liver: with a cell of"), testing::HasSubstr("accepted: 2000"),
                             testing::HasSubstr("give a cell size")));
  TetrahedraliseSettings cheap = precise;
  cheap.most_distances = 100'000;
  EXPECT_THAT(refusal(cheap),
              testing::AllOf(testing::HasSubstr("more than 1e+05 looks"), testing::HasSubstr("give a larger cell")));
  struct Enough {};
  int calls = 0;
  double last = 0;
  TetrahedraliseSettings watched = precise;
  watched.progress = [&](double cell, double share) {
    EXPECT_GT(cell, 0);
    EXPECT_GE(share, last);
    EXPECT_LE(share, 1);
    last = share;
    if (++calls == 20) throw Enough();
  };
  EXPECT_THROW(fill_pieces({&shape, 1}, watched), Enough);
  EXPECT_EQ(calls, 20);
  EXPECT_GT(last, 0) << "a bar that moves";
}

TEST(Tetrahedralise, RefusesWhatHasNoSolid) {
  TriangleMesh open = icosphere({0, 0, 0}, 0.05, 3);
  open.triangles.pop_back();
  TetrahedraliseSettings settings;
  settings.where = "organ.glb:liver";
  EXPECT_THROW(tetrahedralise(open, settings), files::ContentError);
  settings.cell = 0.3;  // a lattice that may miss the sphere altogether, or mesh it soundly: never anything else
  const TriangleMesh sphere_surface = icosphere({0, 0, 0}, 0.02, 3);
  EXPECT_THROW(tetrahedralise(sphere_surface, settings), files::ContentError);
  settings.cell = 1e-5;
  try {
    tetrahedralise(sphere_surface, settings);
    FAIL() << "a lattice of 1e11 points was accepted";
  } catch (const files::ContentError& error) {
    EXPECT_THAT(error.what(), testing::StartsWith("organ.glb:liver: a cell of 0.01 mm needs"));
  }
}

}  // namespace
}  // namespace stylet::mesh
