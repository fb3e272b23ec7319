// What lies inside an organ: which parts, which tetrahedra and which voxels.
#include "engine/import/organ_labels.h"
#include "engine/import/organ_files.h"
#include "engine/import/organ_source.h"
#include "engine/mesh/tet_quality.h"
#include "tests/mesh/shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <sstream>

namespace stylet::import {
namespace {

using mesh::test::ball_volume;
using mesh::test::icosphere;

SourcePart annotated(const std::string& name, mesh::TriangleMesh mesh, const std::string& id, const std::string& role,
                     const std::string& body = {}) {
  SourcePart out{.name = name, .place = "test:" + name, .mesh = std::move(mesh), .organ = {}, .tissue = {}};
  out.organ.id = id;
  out.organ.role = role;
  out.organ.body = body;
  return out;
}

const Eigen::Vector3d kLesion(0.015, 0, 0), kVessel(-0.015, 0.005, 0);
constexpr double kLesionRadius = 0.012, kVesselRadius = 0.010;

SourceFile liver_file() {
  return {.path = "liver.glb",
          .format = "glTF",
          .parts = {annotated("capsule", icosphere({0, 0, 0}, 0.04, 4), "Liver", ""),
                    annotated("veins", icosphere(kVessel, kVesselRadius, 3), "liver", "vessel"),
                    annotated("tumour", icosphere(kLesion, kLesionRadius, 3), "lesion", "target", "Liver")},
          .image = {},
          .assumptions = {},
          .warnings = {}};
}

TEST(AssignParts, WhatLiesInsideStaysApartAndNamesItsOrgan) {
  const std::vector<SourceFile> files{liver_file()};
  const std::vector<OrganParts> organs = assign_parts(files, {});
  ASSERT_EQ(organs.size(), 3u);
  EXPECT_EQ(organs[0].id, "liver");
  EXPECT_FALSE(organs[0].lies_inside());
  EXPECT_EQ(organs[1].id, "liver_vessel");
  EXPECT_EQ(organs[1].body, "liver");
  EXPECT_EQ(organs[1].role, "vessel");
  EXPECT_EQ(organs[2].id, "lesion");
  EXPECT_EQ(organs[2].body, "liver");
}

TEST(OrganLabels, TetrahedraAndVoxelsSayWhatLiesInside) {
  const std::vector<SourceFile> files{liver_file()};
  const std::vector<OrganParts> parts = assign_parts(files, {});
  const ImportProgress quiet = [](const std::string&, double) {};
  const ImportedOrgan liver = import_organ(parts[0], {}, quiet);
  std::vector<content::Tissue> tissues(4);
  const std::vector<double> young{0, 5e3, 1e3, 20e3};
  for (std::size_t t = 0; t < tissues.size(); ++t) {
    tissues[t].name = std::string("tissue ") + static_cast<char>('a' + t);
    tissues[t].mechanics.young_modulus = young[t];
  }
  std::vector<readers::Organ> inside(2);
  inside[0].id = "veins";
  inside[0].role = content::SurfaceRole::vessel;
  inside[0].tissue = 2;
  inside[0].mesh = parts[1].parts[0]->mesh;
  inside[1].id = "lesion";
  inside[1].role = content::SurfaceRole::target;
  inside[1].tissue = 3;
  inside[1].mesh = parts[2].parts[0]->mesh;
  const OrganLabels labels = label_organ(liver, 1, inside, tissues);

  // The mean modulus: as if each were mixed by volume.
  ASSERT_EQ(labels.tet_mechanics.size(), liver.mesh.tets.size());
  double sum = 0, volume = 0;
  for (std::size_t t = 0; t < liver.mesh.tets.size(); ++t) {
    const auto& tet = liver.mesh.tets[t];
    const auto node = [&](std::size_t c) { return liver.mesh.nodes[tet[c]]; };
    const double v = (node(1) - node(0)).dot((node(2) - node(0)).cross(node(3) - node(0))) / 6;
    volume += v;
    sum += v * labels.tet_mechanics[t].young_modulus;
    const Eigen::Vector3d centroid = (node(0) + node(1) + node(2) + node(3)) / 4;
    if (std::abs((centroid - kLesion).norm() - kLesionRadius) > 0.5e-3) {
      EXPECT_EQ(labels.tet_tissue[t], (centroid - kLesion).norm() < kLesionRadius ? 3 : 1);
    }
  }
  const double expected = young[1] * volume + (young[3] - young[1]) * ball_volume(kLesionRadius) +
                          (young[2] - young[1]) * ball_volume(kVesselRadius);
  EXPECT_NEAR(sum / expected, 1, 0.01);

  const std::vector<LabelReport> counts = count_labels(labels, tissues);
  ASSERT_EQ(counts.size(), 3u);
  EXPECT_EQ(counts[1].tissue, "tissue c");
  EXPECT_NEAR(counts[1].volume / ball_volume(kVesselRadius), 1, 0.03);
  EXPECT_EQ(counts[1].tetrahedra, 0u) << "vessels only change how the tetrahedra around them yield";
  EXPECT_NEAR(counts[2].volume / ball_volume(kLesionRadius), 1, 0.03);

  // The file, as a reader of legacy VTK takes it.
  const std::string file = labels_vtk("liver", labels.volume);
  std::istringstream in(file);
  std::string word;
  std::size_t count = 0;
  Eigen::Vector3d origin, spacing;
  Eigen::Vector3i n;
  while (in >> word && word != "DIMENSIONS") {
  }
  in >> n.x() >> n.y() >> n.z() >> word >> origin.x() >> origin.y() >> origin.z() >> word >> spacing.x() >>
      spacing.y() >> spacing.z() >> word >> count;
  ASSERT_EQ(count, static_cast<std::size_t>(n.prod()));
  const std::string last = "LOOKUP_TABLE default\n";
  const std::size_t start = file.find(last) + last.size();
  ASSERT_EQ(file.size(), start + count + 1);
  const auto at = [&](const Eigen::Vector3d& x) {
    const Eigen::Vector3i v = ((x - origin).array() / spacing.array()).round().cast<int>();
    return static_cast<int>(file[start + static_cast<std::size_t>(v.x() + n.x() * (v.y() + n.y() * v.z()))]);
  };
  EXPECT_EQ(at(kLesion), 3);
  EXPECT_EQ(at(kVessel), 2);
  EXPECT_EQ(at({0, -0.03, 0}), 1);
  EXPECT_EQ(at({0.039, 0.039, 0.039}), 0);
  EXPECT_EQ(labels_vtk("liver", label_organ(liver, 1, inside, tissues).volume), file);

  const std::string vtk = tetrahedra_vtk(liver, &labels);
  EXPECT_NE(vtk.find("SCALARS tissue unsigned_char 1\n"), std::string::npos);
  EXPECT_NE(vtk.find("SCALARS young_modulus_pa double 1\n"), std::string::npos);
  EXPECT_EQ(vtk.find(tetrahedra_vtk(liver)), 0u) << "the rest is as without";
}

}  // namespace
}  // namespace stylet::import
