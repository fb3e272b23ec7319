// The body round organs that a segmentation has without it.
#include "engine/import/derived_body.h"
#include "engine/files/error.h"
#include "engine/import/organ_source.h"
#include "engine/import/scan_cut.h"
#include "engine/mesh/solid.h"
#include "engine/mesh/surface_mesh.h"
#include "tests/mesh/shapes.h"
#include "tests/support/label_torso.h"
#include "tests/support/sanitized.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace stylet::import {
namespace {

using Eigen::Vector3d;

constexpr double kVoxel = support::kSanitized ? 0.006 : 0.003;

SourceFile file_of(LabelImage image) {
  SourceFile file;
  file.path = "torso.nii";
  file.format = "NIfTI";
  for (const auto& [label, name] : image.names) file.parts.push_back({.name = name, .place = name, .label = label});
  file.image = std::move(image);
  return file;
}

DerivedBody derived(LabelImage image) {
  std::vector<SourceFile> files;
  files.push_back(file_of(std::move(image)));
  return derive_body(files, [] {});
}

/// Least distance of a labelled voxel's centre to the surface, m, positive inside; of those no nearer than `off` to
/// the ends of the body along it.
double clearance(const LabelImage& image, const mesh::TriangleMesh& surface, double low, double high) {
  const mesh::Solid solid(surface);
  double least = 1;
  std::size_t i = 0;
  for (int z = 0; z < image.size.z(); ++z) {
    for (int y = 0; y < image.size.y(); ++y) {
      for (int x = 0; x < image.size.x(); ++x, ++i) {
        const Vector3d p = image.patient_from_voxel * Vector3d(x, y, z);
        // Every third: the body is smooth.
        if (image.labels[i] == 0 || (x + y + z) % 3 != 0 || p.y() < low || p.y() > high) continue;
        least = std::min(least, -solid.signed_distance(p));
      }
    }
  }
  return least;
}

void expect_one_closed_piece(const mesh::TriangleMesh& surface) {
  const mesh::SurfaceReport report = mesh::inspect(surface);
  EXPECT_TRUE(report.closed());
  EXPECT_TRUE(report.oriented());
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.euler_characteristic(), 2) << "no handle, no cavity";
}

TEST(DerivedBody, HoldsAllOrgansWithAWallRoundThem) {
  // Ends before the spine and the vessels do: cut off towards head and feet.
  const LabelImage image = support::torso_labels(kVoxel);
  const DerivedBody body = derived(image);
  expect_one_closed_piece(body.surface);
  const mesh::SurfaceReport report = mesh::inspect(body.surface);
  // Away from the ends, where the scan cuts organs off and the body with them.
  EXPECT_GT(clearance(image, body.surface, 0.025, 0.275), 0.015);
  EXPECT_NEAR(report.bounds.min().y(), 0.0, 1e-3);
  EXPECT_NEAR(report.bounds.max().y(), 0.30, 1e-3);
  // Between the cage and the box round it with 30 mm.
  const double cage = std::numbers::pi * support::kCageWidth * support::kCageDepth * 0.30;
  EXPECT_GT(report.volume, 0.7 * cage);
  EXPECT_LT(report.volume, (2 * support::kCageWidth + 0.06) * (2 * support::kCageDepth + 0.06) * 0.30);
  const auto cuts = find_cuts(body.surface);
  ASSERT_EQ(cuts.size(), 2u);
  EXPECT_EQ(cuts[0].name(), "the feet");
  EXPECT_EQ(cuts[1].name(), "the head");
  EXPECT_NE(body.how.find("hull"), std::string::npos);
}

TEST(DerivedBody, ClosesRoundWhatLiesWithinTheScan) {
  const auto organs = support::torso_organs();
  const LabelImage image =
      support::labels_of({organs[2]}, kVoxel, {-0.20, 0.06, -0.15}, {0.20, 0.30, 0.15});  // liver
  const DerivedBody body = derived(image);
  expect_one_closed_piece(body.surface);
  EXPECT_GT(clearance(image, body.surface, 0, 1), 0.015) << "on all sides";
  const Vector3d size = mesh::inspect(body.surface).bounds.sizes();
  EXPECT_LT((size - Vector3d(0.18, 0.17, 0.18)).cwiseAbs().maxCoeff(), 0.012) << size.transpose();
}

TEST(DerivedBody, IsTheSameEachTimeAndHardlyAnotherWithFinerVoxels) {
  const DerivedBody one = derived(support::torso_labels(0.006));
  const DerivedBody again = derived(support::torso_labels(0.006));
  EXPECT_EQ(one.surface.vertices, again.surface.vertices);
  EXPECT_EQ(one.surface.triangles, again.surface.triangles);
  if (support::kSanitized) return;
  const DerivedBody fine = derived(support::torso_labels(0.003));
  const double volume = mesh::inspect(one.surface).volume;
  EXPECT_NEAR(mesh::inspect(fine.surface).volume, volume, 0.06 * volume);
  EXPECT_LT(static_cast<double>(fine.surface.triangles.size()),
            1.3 * static_cast<double>(one.surface.triangles.size()))
      << "its triangles do not go with the voxels";
}

TEST(DerivedBody, TakesALabelOfTheSkinAndFillsIt) {
  std::vector<support::TorsoOrgan> organs = support::torso_organs();
  const Vector3d radii(0.185, 1.0, 0.125);
  organs.insert(organs.begin(), {"skin", [&](const Vector3d& x) {
                                   return support::in_ellipsoid(x, Vector3d::Zero(), radii) &&
                                          !support::in_ellipsoid(x, Vector3d::Zero(), radii.array() - 0.008);
                                 }});
  const LabelImage image = support::labels_of(organs, kVoxel, {-0.20, 0.0, -0.15}, {0.20, 0.30, 0.15});
  const DerivedBody body = derived(image);
  expect_one_closed_piece(body.surface);
  // Of y from 0 to 0.3: the integral of pi a b (1 - y^2).
  const double whole = std::numbers::pi * radii.x() * radii.z() * (0.30 - std::pow(0.30, 3) / 3);
  EXPECT_NEAR(mesh::inspect(body.surface).volume, whole, 0.05 * whole);
  EXPECT_NE(body.how.find("\"skin\""), std::string::npos) << body.how;
}

TEST(DerivedBody, OfSurfacesToo) {
  SourceFile file{.path = "a.glb", .format = "glTF", .parts = {}, .image = {}, .assumptions = {}, .warnings = {}};
  file.parts.push_back({.name = "liver", .place = "liver", .mesh = mesh::test::icosphere({0, 0, 0}, 0.06, 3)});
  std::vector<SourceFile> files;
  files.push_back(std::move(file));
  const DerivedBody body = derive_body(files, [] {});
  expect_one_closed_piece(body.surface);
  EXPECT_TRUE(find_cuts(body.surface).size() == 2) << "flat towards head and feet";
  files.front().parts.clear();
  EXPECT_THROW(derive_body(files, [] {}), files::ContentError);
}

}  // namespace
}  // namespace stylet::import
