#include "tools/make_patient/patient.h"
#include "engine/gltf/gltf.h"
#include "engine/mesh/solid.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/mesh/tet_quality.h"
#include "engine/mesh/tetrahedralise.h"
#include "tests/support/sanitized.h"
#include "tools/make_patient/ablation_case.h"
#include "tools/make_patient/cyst_case.h"
#include "tools/make_patient/phantom.h"
#include "tools/make_patient/torso.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

namespace stylet::patient {
namespace {

using Eigen::Vector3d;
using mesh::Solid;
using mesh::SurfaceReport;

const std::filesystem::path kContent = std::filesystem::path(STYLET_SOURCE_DIR) / "content";

// As shipped: CommittedFilesAreWhatTheGeneratorMakes ties the file to the generator, which takes seconds.
const std::vector<Organ>& organs() {
  static const std::vector<Organ> shipped = [] {
    std::vector<Organ> read;
    for (gltf::GltfOrgan& o : gltf::read_gltf(kContent / "organs/abdomen.glb").organs) {
      read.push_back({o.name, o.organ.role, o.tissue ? o.tissue->preset : "", o.organ.body, std::move(o.mesh)});
    }
    return read;
  }();
  return shipped;
}

const Organ& organ(const std::string& name) {
  for (const Organ& o : organs()) {
    if (o.name == name) return o;
  }
  throw std::out_of_range(name);
}

std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

nlohmann::json tissue_table() {
  return nlohmann::json::parse(read_bytes(kContent / "tissues.json")).at("tissues");
}

// Of another machine's mathematical library the positions may differ by a rounding step of a micrometre, nothing
// else.
bool same_or_a_micrometre_apart(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i + 4 <= a.size(); i += 4) {
    if (std::memcmp(&a[i], &b[i], 4) == 0) continue;
    float x = 0;
    float y = 0;
    std::memcpy(&x, &a[i], 4);
    std::memcpy(&y, &b[i], 4);
    const auto coordinate = [](float f) { return f == 0 || (std::abs(f) > 5e-7F && std::abs(f) < 1); };  // no index
    if (!coordinate(x) || !coordinate(y) || std::abs(x - y) > 2.5e-6F) return false;
  }
  return true;
}

void expect_same(const mesh::TriangleMesh& made, const mesh::TriangleMesh& shipped) {
  EXPECT_EQ(made.triangles, shipped.triangles);
  ASSERT_EQ(made.vertices.size(), shipped.vertices.size());
  for (std::size_t i = 0; i < made.vertices.size(); ++i) {
    ASSERT_LT((made.vertices[i] - shipped.vertices[i]).norm(), 2.5e-6);  // rounded to micrometres, see above
  }
}

TEST(Patient, CommittedFilesAreWhatTheGeneratorMakes) {
  EXPECT_EQ(procedure_json(make_procedure()), read_bytes(kContent / "organs/abdomen.json"));
  if (support::kSanitized) {  // All organs take most of a minute.
    expect_same(tumour_surface(), organ("tumour").mesh);
    expect_same(torso::rib(torso::kFirstRib), organ("rib_right_" + std::to_string(torso::kFirstRib)).mesh);
    return;
  }
  gltf::TissueColours colours;
  const nlohmann::json table = tissue_table();
  for (const auto& [name, tissue] : table.items()) {
    colours[name] = tissue.at("colour").get<std::array<float, 4>>();
  }
  const auto glb = patient_glb(colours);
  const std::string made(reinterpret_cast<const char*>(glb.data()), glb.size());
  EXPECT_TRUE(same_or_a_micrometre_apart(made, read_bytes(kContent / "organs/abdomen.glb")))
      << "run stylet-make-patient and look at what changed";
}

TEST(Patient, PhantomTumourForAblationAndCystAreWhatTheGeneratorMakes) {
  const auto expect_made = [](const std::vector<Organ>& made, const char* file) {
    const gltf::GltfScene shipped = gltf::read_gltf(kContent / "organs" / file);
    ASSERT_EQ(made.size(), shipped.organs.size()) << file;
    for (std::size_t i = 0; i < made.size(); ++i) {
      EXPECT_EQ(made[i].name, shipped.organs[i].name);
      EXPECT_EQ(made[i].role, shipped.organs[i].organ.role);
      expect_same(made[i].mesh, shipped.organs[i].mesh);
      const SurfaceReport report = mesh::inspect(made[i].mesh);
      EXPECT_TRUE(report.closed() && report.oriented()) << made[i].name;
    }
  };
  expect_made(make_phantom(), "phantom.glb");
  expect_made(make_ablation_tumour(), "ablation_tumour.glb");
  EXPECT_EQ(procedure_json(make_ablation_procedure(), "ablation_tumour.glb", "ablation_tumour"),
            read_bytes(kContent / "organs/ablation_tumour.json"));
  expect_made(make_cyst(), "cyst.glb");
  EXPECT_EQ(procedure_json(make_cyst_procedure(), "cyst.glb", "cyst"), read_bytes(kContent / "organs/cyst.json"));
}

TEST(Patient, EverySurfaceIsClosedManifoldAndOutward) {
  for (const Organ& o : organs()) {
    SCOPED_TRACE(o.name);
    const SurfaceReport report = mesh::inspect(o.mesh);
    EXPECT_TRUE(report.closed());
    EXPECT_TRUE(report.oriented());
    EXPECT_EQ(report.components, o.name == "hepatic_veins" ? 2 : 1);
    EXPECT_NO_THROW(mesh::solid_surface(o.mesh, o.name));
  }
}

TEST(Patient, TissuesExistAndBodiesAreNodes) {
  const nlohmann::json table = tissue_table();
  std::set<std::string> names;
  for (const Organ& o : organs()) {
    EXPECT_TRUE(table.contains(o.tissue)) << o.tissue;
    EXPECT_TRUE(names.insert(o.name).second) << o.name << " twice";
  }
  for (const Organ& o : organs()) {
    if (o.body.empty()) continue;
    EXPECT_EQ(organ(o.body).role, "boundary") << o.name;
  }
}

TEST(Patient, SizesAreAnAdults) {
  const double litre = 1e-3;
  const SurfaceReport liver = mesh::inspect(organ("liver").mesh);
  EXPECT_GT(liver.volume, 1.2 * litre);
  EXPECT_LT(liver.volume, 1.8 * litre);
  EXPECT_LT(liver.bounds.min().x(), -0.11);  // right lobe under the ribs
  EXPECT_GT(liver.bounds.max().x(), 0.03);   // left lobe across the midline

  const auto longest = [](const mesh::TriangleMesh& mesh) {
    double longest2 = 0;
    for (const Vector3d& a : mesh.vertices) {
      for (const Vector3d& b : mesh.vertices) longest2 = std::max(longest2, (a - b).squaredNorm());
    }
    return std::sqrt(longest2);
  };
  const double kidney = longest(organ("kidney_right").mesh);
  EXPECT_GT(kidney, 0.100);
  EXPECT_LT(kidney, 0.120);
  const double gallbladder = longest(organ("gallbladder").mesh);
  EXPECT_GT(gallbladder, 0.070);
  EXPECT_LT(gallbladder, 0.090);

  const Procedure procedure = make_procedure();
  for (const Vector3d& x : organ("tumour").mesh.vertices) {
    EXPECT_GT((x - procedure.target).norm(), 0.010);
    EXPECT_LT((x - procedure.target).norm(), 0.0125);
  }
}

TEST(Patient, WhatTheLiverCarriesLiesInIt) {
  const Solid liver(organ("liver").mesh);
  for (const Vector3d& x : organ("tumour").mesh.vertices) EXPECT_LT(liver.signed_distance(x), -0.003);

  // Vessels leave the liver only at the porta hepatis and at the vena cava.
  const Solid vena_cava(organ("inferior_vena_cava").mesh);
  const Vector3d porta(-0.016, 0.0, -0.010);
  for (const char* name : {"portal_vein", "hepatic_veins"}) {
    SCOPED_TRACE(name);
    int outside = 0;
    const auto& vertices = organ(name).mesh.vertices;
    for (const Vector3d& x : vertices) {
      if (liver.contains(x)) continue;
      ++outside;
      const bool at_porta = std::string(name) == "portal_vein" && (x - porta).norm() < 0.045;
      EXPECT_TRUE(at_porta || vena_cava.signed_distance(x) < 0.012) << x.transpose();
    }
    EXPECT_LT(outside, 0.2 * static_cast<double>(vertices.size()));
  }
}

TEST(Patient, NeighboursDoNotOverlap) {
  // Half a millimetre is what two independently smoothed surfaces may share.
  const std::vector<std::pair<std::string, std::string>> pairs{{"liver", "kidney_right"},
                                                               {"liver", "gallbladder"},
                                                               {"liver", "inferior_vena_cava"},
                                                               {"liver", "diaphragm"},
                                                               {"liver", "abdominal_wall"},
                                                               {"liver", "intercostal_muscle"},
                                                               {"gallbladder", "liver"},
                                                               {"kidney_right", "liver"},
                                                               {"inferior_vena_cava", "liver"},
                                                               {"diaphragm", "intercostal_muscle"},
                                                               {"diaphragm", "rib_right_8"},
                                                               {"rib_right_9", "fat"},
                                                               {"hepatic_veins", "inferior_vena_cava"},
                                                               {"hepatic_veins", "portal_vein"},
                                                               {"portal_vein", "tumour"},
                                                               {"hepatic_veins", "tumour"},
                                                               {"portal_vein", "gallbladder"},
                                                               {"portal_vein", "inferior_vena_cava"}};
  for (const auto& [a, b] : pairs) {
    const Solid solid(organ(b).mesh);
    double deepest = 0;
    for (const Vector3d& x : organ(a).mesh.vertices) {
      if (solid.bounds().contains(x)) deepest = std::min(deepest, solid.signed_distance(x));
    }
    EXPECT_GT(deepest, -0.5e-3) << a << " in " << b;
  }
}

TEST(Patient, IntercostalGapsAreTwelveToEighteenMillimetres) {
  for (int rib = 7; rib < 11; ++rib) {
    const Solid upper(organ("rib_right_" + std::to_string(rib)).mesh);
    double gap = 1;
    for (const Vector3d& x : organ("rib_right_" + std::to_string(rib + 1)).mesh.vertices) {
      gap = std::min(gap, upper.signed_distance(x));
    }
    EXPECT_GT(gap, 0.012) << rib;
    EXPECT_LT(gap, 0.018) << rib;
  }
}

TEST(Patient, NeedleReachesTheTumourThroughTheWallAndTheLiverOnly) {
  const Procedure procedure = make_procedure();
  const double depth = (procedure.target - procedure.entry).norm();
  EXPECT_GT(depth, 0.040);
  EXPECT_LT(depth, 0.085);
  const Vector3d start = procedure.entry - 0.02 * (procedure.target - procedure.entry).normalized();
  for (const Organ& o : organs()) {
    const Solid solid(o.mesh);
    double nearest = 1;
    for (int i = 0; i <= 200; ++i) {
      nearest = std::min(nearest, solid.signed_distance(start + i / 200.0 * (procedure.target - start)));
    }
    SCOPED_TRACE(o.name);
    if (o.tissue == "bone" || o.tissue == "cartilage" || o.role == "vessel" || o.name.starts_with("gallbladder") ||
        o.name.starts_with("kidney")) {
      EXPECT_GT(nearest, 0.003);
    }
    if (o.name == "skin" || o.name == "fat" || o.name == "muscle" || o.name == "liver") {
      EXPECT_EQ(solid.crossings(start, procedure.target), o.name == "liver" ? 1 : 2);
    }
  }
}

TEST(Patient, TheTumourLiesDeepEnoughToBeFeltApartFromTheCapsule) {
  const Solid liver(organ("liver").mesh);
  double nearest = 1;
  for (const Vector3d& x : organ("tumour").mesh.vertices) nearest = std::min(nearest, -liver.signed_distance(x));
  EXPECT_GT(nearest, 0.015);
}

TEST(Patient, RibsAndTheMuscleBetweenThemAreInTheWall) {
  const Solid wall(organ("abdominal_wall").mesh);
  for (const char* name : {"rib_right_8", "rib_right_9", "rib_right_10", "intercostal_muscle"}) {
    const auto& vertices = organ(name).mesh.vertices;
    const auto inside = std::ranges::count_if(vertices, [&](const Vector3d& x) { return wall.contains(x); });
    EXPECT_GT(static_cast<double>(inside), 0.3 * static_cast<double>(vertices.size())) << name;
  }
}

TEST(Patient, NeedleLiesInTheImagePlaneAtTwentyToFortyDegreesToTheFace) {
  const Procedure procedure = make_procedure();
  const View& view = procedure.views.front();
  const Eigen::Matrix3d axes = view.orientation.toRotationMatrix();
  EXPECT_NEAR((axes.transpose() * axes - Eigen::Matrix3d::Identity()).norm(), 0, 1e-12);
  EXPECT_NEAR((procedure.entry - view.position).dot(axes.col(1)), 0, 1e-6);
  EXPECT_NEAR((procedure.target - view.position).dot(axes.col(1)), 0, 1e-6);
  const double to_face =
      std::asin((procedure.target - procedure.entry).normalized().dot(axes.col(2))) * 180 / 3.14159265358979;
  EXPECT_GT(to_face, 20);
  EXPECT_LT(to_face, 40);
  for (const View& v : procedure.views) {
    EXPECT_NEAR(Solid(organ("skin").mesh).signed_distance(v.position), 0, 0.3e-3) << v.name;
  }
}

TEST(Patient, DeformingBodiesBecomeSoundTetrahedra) {
  for (const char* name : {"liver", "abdominal_wall"}) {
    SCOPED_TRACE(name);
    mesh::TetrahedraliseSettings settings;
    settings.where = name;
    const physics::TetMesh mesh = mesh::tetrahedralise(organ(name).mesh, settings);
    EXPECT_GE(mesh.nodes.size(), 2000U);
    EXPECT_LE(mesh.nodes.size(), 2600U);
    const mesh::TetQuality quality = mesh::tet_quality(mesh);
    EXPECT_EQ(quality.inverted, 0);
    EXPECT_GE(quality.min_dihedral_deg, 12);
    const double volume = mesh::inspect(organ(name).mesh).volume;
    EXPECT_NEAR(quality.volume, volume, 0.05 * volume);
    const SurfaceReport boundary = mesh::inspect(mesh::boundary_surface(mesh).mesh);
    EXPECT_TRUE(boundary.closed());
    EXPECT_TRUE(boundary.oriented());
    EXPECT_EQ(boundary.components, 1);
    EXPECT_EQ(boundary.euler_characteristic(), 2);
    RecordProperty("nodes", static_cast<int>(mesh.nodes.size()));
    std::printf("%s: %zu nodes, %zu tetrahedra, dihedral %.1f to %.1f degrees, volume %.1f of %.1f ml\n", name,
                mesh.nodes.size(), mesh.tets.size(), quality.min_dihedral_deg, quality.max_dihedral_deg,
                quality.volume * 1e6, volume * 1e6);
  }
}

}  // namespace
}  // namespace stylet::patient
