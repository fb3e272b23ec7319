// Whole organs: which parts they are made of, what comes out, and why some are refused.
#include "engine/import/organ_import.h"
#include "engine/files/error.h"
#include "engine/gltf/gltf.h"
#include "engine/gltf/gltf_writer.h"
#include "engine/import/organ_files.h"
#include "engine/import/organ_picture.h"
#include "engine/import/scene_survey.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/mesh/tet_quality.h"
#include "tests/mesh/shapes.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <sstream>
#include <string_view>

namespace stylet::import {
namespace {

using files::ContentError;
using mesh::TriangleMesh;
using mesh::test::append_flipped;
using mesh::test::ball_volume;
using mesh::test::icosphere;

const ImportProgress kQuiet = [](const std::string&, double) {};

SourcePart part(const std::string& name, TriangleMesh mesh, const std::string& organ = {}) {
  SourcePart out{.name = name, .place = "test:" + name, .mesh = std::move(mesh), .organ = {}, .tissue = {}};
  out.organ.id = organ;
  return out;
}

SourceFile file_of(std::vector<SourcePart> parts) {
  return {.path = "thing.glb",
          .format = "glTF",
          .parts = std::move(parts),
          .image = {},
          .assumptions = {},
          .warnings = {}};
}

// Of spheres that are enclosed, m: a grid for them has a thirtieth of the nodes under a sanitizer.
constexpr double kOrganRadius = support::kSanitized ? 0.01 : 0.04;
constexpr int kOrganLevel = support::kSanitized ? 3 : 4;

/// A new surface of a fifth of the cells.
constexpr double kSurfaceCells = support::kSanitized ? 40 : 70;

/// The part of a sphere on one side of a plane through its middle, cut along its edges.
TriangleMesh half_sphere(double sign) {
  TriangleMesh mesh = icosphere({0, 0, 0}, kOrganRadius, kOrganLevel);
  std::erase_if(mesh.triangles, [&](const auto& t) {
    const double z = mesh.vertices[t[0]].z() + mesh.vertices[t[1]].z() + mesh.vertices[t[2]].z();
    return sign * z < 0 || (sign < 0 && z == 0);
  });
  return mesh;
}

std::string refusal(const OrganParts& organ, const ImportSettings& settings = {}) {
  try {
    import_organ(organ, settings, kQuiet);
  } catch (const ContentError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "";
}

void expect_sound(const ImportedOrgan& organ) {
  EXPECT_EQ(organ.report.quality.inverted, 0);
  EXPECT_GE(organ.report.quality.min_dihedral_deg, 12);
  EXPECT_LE(std::abs(organ.report.volume_error()), 0.03);
  EXPECT_TRUE(mesh::inspect(organ.surface).closed());
  EXPECT_TRUE(mesh::inspect(organ.surface).oriented());
}

TEST(AssignParts, ByAnnotationByPatternOrByWhatIsClosed) {
  const std::vector<SourceFile> annotated{
      file_of({part("a", icosphere({0, 0, 0}, 0.01, 1), "liver"), part("b", icosphere({1, 0, 0}, 0.01, 1), "liver"),
               part("c", icosphere({2, 0, 0}, 0.01, 1))})};
  std::vector<OrganParts> organs = assign_parts(annotated, {});
  ASSERT_EQ(organs.size(), 1u);
  EXPECT_EQ(organs[0].parts.size(), 2u);

  organs = assign_parts(annotated, {{.id = "x", .patterns = {"A", "?"}}});
  ASSERT_EQ(organs.size(), 1u);
  EXPECT_EQ(organs[0].id, "x");

  const std::vector<SourceFile> plain{file_of({part("Left Half", half_sphere(1)), part("right", half_sphere(-1)),
                                               part("Gall Bladder", icosphere({1, 0, 0}, 0.01, 2))})};
  organs = assign_parts(plain, {});
  ASSERT_EQ(organs.size(), 2u);
  EXPECT_EQ(organs[0].id, "gall_bladder");
  EXPECT_EQ(organs[1].id, "thing");
  EXPECT_EQ(organs[1].parts.size(), 2u);

  try {
    assign_parts(plain, {{.id = "x", .patterns = {"spleen*"}}});
    ADD_FAILURE();
  } catch (const ContentError& error) {
    EXPECT_NE(std::string(error.what()).find("there are Left Half, right, Gall Bladder"), std::string::npos);
  }
}

TEST(ImportOrgan, ClosedSurfaceKeepsItsVolume) {
  const std::vector<SourceFile> files{file_of({part("ball", icosphere({0.1, 0, 0}, 0.04, 4))})};
  const ImportedOrgan organ = import_organ(assign_parts(files, {})[0], {}, kQuiet);
  EXPECT_EQ(organ.report.from, SolidFrom::closed_surface);
  EXPECT_NEAR(organ.report.volume, 4.0 / 3 * std::numbers::pi * std::pow(0.04, 3), 0.01 * organ.report.volume);
  expect_sound(organ);
}

TEST(ImportOrgan, PatchesAreWeldedToOneSolid) {
  const std::vector<SourceFile> files{file_of({part("upper", half_sphere(1)), part("lower", half_sphere(-1))})};
  const ImportedOrgan organ = import_organ(assign_parts(files, {})[0], {}, kQuiet);
  EXPECT_EQ(organ.report.from, SolidFrom::closed_surface);
  EXPECT_EQ(organ.report.parts, 2);
  expect_sound(organ);
}

TEST(ImportOrgan, PatchesThatDoNotQuiteMeetAreEnclosed) {
  TriangleMesh lower = half_sphere(-1);
  constexpr double kSlit = 0.4e-3;
  for (Eigen::Vector3d& v : lower.vertices) v.z() -= kSlit;
  const std::vector<SourceFile> files{file_of({part("upper", half_sphere(1)), part("lower", lower)})};
  const ImportedOrgan organ = import_organ(assign_parts(files, {})[0], {.surface_cells = kSurfaceCells}, kQuiet);
  EXPECT_EQ(organ.report.from, SolidFrom::enclosure);
  EXPECT_LE(organ.report.gap, 2e-3);
  const double expected = std::numbers::pi * kOrganRadius * kOrganRadius * (4.0 / 3 * kOrganRadius + kSlit);
  EXPECT_NEAR(organ.report.volume, expected, 0.02 * expected);
  EXPECT_EQ(organ.report.notes.size(), 1u);
  expect_sound(organ);
}

TEST(ImportOrgan, NodesComeWithinFivePerCent) {
  TriangleMesh egg = icosphere({0, 0, 0}, 0.04, 4);  // in a ball, nodes come by whole shells of the lattice
  for (Eigen::Vector3d& v : egg.vertices) v = v.cwiseProduct(Eigen::Vector3d(1, 0.83, 0.61));
  const std::vector<SourceFile> files{file_of({part("egg", egg)})};
  const int wanted = support::kSanitized ? 800 : 3000;
  const ImportedOrgan organ = import_organ(assign_parts(files, {})[0], {.target_nodes = wanted}, kQuiet);
  std::printf("  %zu nodes for %d\n", organ.report.nodes, wanted);
  EXPECT_NEAR(static_cast<double>(organ.report.nodes), wanted, 0.05 * wanted);
}

TEST(ImportOrgan, RefusesWhatHasNoInsideAndSaysWhy) {
  TriangleMesh cup = half_sphere(1);
  TriangleMesh inner = half_sphere(1);
  for (Eigen::Vector3d& v : inner.vertices) v *= 0.995;
  append_flipped(cup, inner);  // a thin cup, open at its rim
  for (Eigen::Vector3d& v : cup.vertices) v *= 0.01 / kOrganRadius;
  const std::vector<SourceFile> files{file_of({part("cup", cup)})};
  const std::string why = refusal(assign_parts(files, {})[0]);
  EXPECT_NE(why.find("has no inside"), std::string::npos) << why;
  EXPECT_NE(why.find("open edges"), std::string::npos) << why;
  // The widest that was tried, a twentieth of its size at most.
  const std::size_t gaps = why.find("with gaps of ");
  ASSERT_NE(gaps, std::string::npos) << why;
  EXPECT_LE(std::stod(why.substr(gaps + 13)) * 1e-3, 0.05 * 3 * 0.01) << why;
}

/// Closed parts of the boundary of its tetrahedra; each is a ball's.
int filled_balls(const ImportedOrgan& organ) {
  const mesh::SurfaceReport boundary = mesh::inspect(mesh::boundary_surface(organ.mesh).mesh);
  EXPECT_TRUE(boundary.closed());
  EXPECT_EQ(boundary.euler_characteristic(), 2 * boundary.components);
  return boundary.components;
}

TEST(ImportOrgan, EveryPieceOfAFewCellsIsFilled) {
  // Two balls closer to each other than a cell, and a crumb.
  TriangleMesh balls = icosphere({0, 0, 0}, 0.04, 4);
  append(balls, icosphere({0.0665, 0, 0}, 0.025, 4));
  append(balls, icosphere({0, 0.05, 0}, 0.001, 2));
  const std::vector<SourceFile> files{file_of({part("balls", balls)})};
  const OrganParts parts = assign_parts(files, {})[0];
  const ImportedOrgan organ = import_organ(parts, {}, kQuiet);
  expect_sound(organ);
  EXPECT_EQ(organ.report.from, SolidFrom::closed_surface);
  EXPECT_EQ(filled_balls(organ), 2);
  ASSERT_EQ(organ.report.pieces.size(), 3u);
  EXPECT_NEAR(organ.report.pieces[1].volume, ball_volume(0.025), 0.01 * ball_volume(0.025));
  EXPECT_NEAR(organ.report.pieces[1].tetrahedra, ball_volume(0.025), 0.08 * ball_volume(0.025));
  EXPECT_EQ(organ.report.pieces[2].tetrahedra, 0);
  EXPECT_NEAR(organ.report.volume - organ.report.filled_volume(), ball_volume(0.001), 0.1 * ball_volume(0.001));
  ASSERT_EQ(organ.report.notes.size(), 1u);
  EXPECT_NE(organ.report.notes[0].find("in 3 pieces; tetrahedra fill 2"), std::string::npos);
  EXPECT_NE(report_text(organ, parts).find("none, left out"), std::string::npos);
  // Asked for cells that only the larger ball has a few of.
  EXPECT_EQ(filled_balls(import_organ(parts, {.cell = 0.03}, kQuiet)), 1);
}

TEST(ImportOrgan, PiecesOfLabelsAndOfWhatIsEnclosedAreFilled) {
  LabelImage image;
  image.size = {66, 36, 36};
  image.patient_from_voxel.linear() = Eigen::Vector3d::Constant(0.4e-3).asDiagonal();
  const Eigen::Vector3d centre = image.patient_from_voxel * Eigen::Vector3d(17, 17, 17);
  for (int k = 0; k < image.size.z(); ++k) {
    for (int j = 0; j < image.size.y(); ++j) {
      for (int i = 0; i < image.size.x(); ++i) {
        const Eigen::Vector3d x = image.patient_from_voxel * Eigen::Vector3d(i, j, k) - centre;
        image.labels.push_back(x.norm() < 0.006 || (x - Eigen::Vector3d(0.0125, 0, 0)).norm() < 0.005 ? 5 : 0);
      }
    }
  }
  SourceFile labels = file_of({});
  labels.image = image;
  labels.parts = {part("label_5", {})};
  labels.parts[0].label = 5;

  TriangleMesh open = half_sphere(1);
  append(open, half_sphere(-1));
  for (Eigen::Vector3d& v : open.vertices) v *= 0.006 / kOrganRadius;
  open.triangles.pop_back();
  const TriangleMesh one = open;
  append(open, one);
  for (std::size_t v = one.vertices.size(); v < open.vertices.size(); ++v) {
    open.vertices[v] = open.vertices[v] * (0.005 / 0.006) + Eigen::Vector3d(0.0125, 0, 0);
  }
  for (const SourceFile& file : {labels, file_of({part("open", open)})}) {
    const std::vector<SourceFile> files{file};
    const ImportedOrgan organ = import_organ(assign_parts(files, {})[0], {.surface_cells = 40}, kQuiet);
    expect_sound(organ);
    EXPECT_NE(organ.report.from, SolidFrom::closed_surface);
    EXPECT_EQ(filled_balls(organ), 2);
    EXPECT_EQ(mesh::inspect(organ.surface).components, 2);
    ASSERT_EQ(organ.report.pieces.size(), 2u);
    for (const PieceReport& piece : organ.report.pieces) {
      const double expected = ball_volume(piece.volume > ball_volume(0.0055) ? 0.006 : 0.005);
      EXPECT_NEAR(piece.volume, expected, 0.02 * expected);
    }
  }
}

TEST(ImportOrgan, WallsInsideAreFilledAndOverlapsCountOnce) {
  TriangleMesh hollow = icosphere({0, 0, 0}, 0.01, 3);
  append(hollow, icosphere({0, 0, 0}, 0.009, 3));
  TriangleMesh two = icosphere({0, 0, 0}, 0.01, 4);
  append(two, icosphere({0.01, 0, 0}, 0.01, 4));
  const std::vector<SourceFile> files{file_of({part("hollow", hollow), part("two", two)})};
  const std::vector<OrganParts> organs = assign_parts(files, {});
  const ImportedOrgan filled = import_organ(organs.at(0), {}, kQuiet);
  expect_sound(filled);
  EXPECT_NEAR(filled.report.volume, ball_volume(0.01), 0.02 * ball_volume(0.01));
  EXPECT_EQ(filled.report.pieces.size(), 1u);
  EXPECT_EQ(filled.report.notes.size(), 1u);

  const ImportedOrgan joined = import_organ(organs.at(1), {.surface_cells = 40}, kQuiet);
  expect_sound(joined);
  EXPECT_EQ(joined.report.from, SolidFrom::enclosure);
  const double lens = std::numbers::pi * 5 / 12 * std::pow(0.01, 3);  // of two equal balls a radius apart
  EXPECT_NEAR(joined.report.volume, 2 * ball_volume(0.01) - lens, 0.02 * ball_volume(0.01));
}

TEST(ImportOrgan, AnOpenTubeIsSlenderNotEmpty) {
  // 1.8 mm wide, 100 mm long, open at both ends, as a ureter that was cut off.
  TriangleMesh tube;
  constexpr std::uint32_t kRound = 24, kAlong = 101;
  constexpr double kTube = 0.9e-3;
  for (std::uint32_t i = 0; i < kAlong; ++i) {
    for (std::uint32_t j = 0; j < kRound; ++j) {
      const double turn = 2 * std::numbers::pi * j / kRound;
      tube.vertices.emplace_back(kTube * std::cos(turn), 1e-3 * i, kTube * std::sin(turn));
      if (i == 0) continue;
      const std::uint32_t a = i * kRound + j, b = i * kRound + (j + 1) % kRound;
      tube.triangles.push_back({a, b, a - kRound});
      tube.triangles.push_back({b, b - kRound, a - kRound});
    }
  }
  const std::vector<SourceFile> files{file_of({part("tube", tube)})};
  const ImportedOrgan organ = import_organ(assign_parts(files, {})[0], {}, kQuiet);
  expect_sound(organ);
  const double expected = std::numbers::pi * kTube * kTube * 0.1;
  EXPECT_NEAR(organ.report.volume, expected, 0.05 * expected);
}

TEST(ImportOrgan, LabelsBecomeASolidWhereTheyAre) {
  // A ball of voxels, 1.5 x 2 x 2.5 mm, axes of a scanner.
  LabelImage image;
  image.size = {60, 50, 40};
  image.patient_from_voxel.linear() = Eigen::Vector3d(1.5e-3, 2e-3, 2.5e-3).asDiagonal();
  image.patient_from_voxel.translation() << -0.03, 0.02, 0.01;
  const Eigen::Vector3d centre = image.patient_from_voxel * Eigen::Vector3d(30, 25, 20);
  for (int k = 0; k < image.size.z(); ++k) {
    for (int j = 0; j < image.size.y(); ++j) {
      for (int i = 0; i < image.size.x(); ++i) {
        const Eigen::Vector3d x = image.patient_from_voxel * Eigen::Vector3d(i, j, k);
        image.labels.push_back((x - centre).norm() < 0.03 ? 5 : (x - centre).norm() < 0.035 ? 7 : 0);
      }
    }
  }
  SourceFile file = file_of({});
  file.format = "NIfTI";
  file.image = image;
  file.parts = {part("label_5", {}), part("label_7", {})};
  file.parts[0].label = 5;
  file.parts[1].label = 7;
  const std::vector<SourceFile> files{file};
  for (const auto& [patterns, radius] : {std::pair{std::vector<std::string>{"label_5"}, 0.03},
                                         std::pair{std::vector<std::string>{"label_*"}, 0.035}}) {
    const ImportedOrgan organ = import_organ(assign_parts(files, {{.id = "ball", .patterns = patterns}})[0],
                                             {.surface_cells = kSurfaceCells}, kQuiet);
    EXPECT_EQ(organ.report.from, SolidFrom::labels);
    EXPECT_NEAR(organ.report.volume, 4.0 / 3 * std::numbers::pi * std::pow(radius, 3), 0.01 * organ.report.volume);
    expect_sound(organ);
    double worst = 0;
    for (const Eigen::Vector3d& v : organ.surface.vertices) {
      worst = std::max(worst, std::abs((v - centre).norm() - radius));
    }
    EXPECT_LT((centre_of(organ.surface) - centre).norm(), 0.05e-3);
    EXPECT_LT(worst, 1.6e-3) << "smoother than the voxels";
  }
}

/// Voxels of one label where `inside` says so, in a file of one part.
SourceFile labels_where(const Eigen::Vector3i& size, double voxel, const std::function<bool(int, int, int)>& inside) {
  LabelImage image;
  image.size = size;
  image.patient_from_voxel.linear() = Eigen::Vector3d::Constant(voxel).asDiagonal();
  for (int k = 0; k < size.z(); ++k) {
    for (int j = 0; j < size.y(); ++j) {
      for (int i = 0; i < size.x(); ++i) image.labels.push_back(inside(i, j, k) ? 5 : 0);
    }
  }
  SourceFile file = file_of({});
  file.format = "NIfTI";
  file.image = std::move(image);
  file.parts = {part("label_5", {})};
  file.parts[0].label = 5;
  return file;
}

struct VoxelShape {
  const char* name;
  double voxel;  // m
  std::function<bool(int, int, int)> inside;
};

void PrintTo(const VoxelShape& shape, std::ostream* out) {
  *out << shape.name;
}

class CoarseLabels : public testing::TestWithParam<VoxelShape> {};

TEST_P(CoarseLabels, ComeInWithTheVolumeOfTheirVoxels) {
  const std::vector<SourceFile> files{labels_where({40, 40, 40}, GetParam().voxel, GetParam().inside)};
  const auto voxels = static_cast<double>(files[0].image->counts().at(5));
  ASSERT_GT(voxels, 8);
  const ImportedOrgan organ = import_organ(assign_parts(files, {})[0], {}, kQuiet);
  expect_sound(organ);
  const double expected = voxels * std::pow(GetParam().voxel, 3);
  EXPECT_NEAR(organ.report.quality.volume, expected, 0.03 * expected);
  EXPECT_NEAR(mesh::inspect(organ.surface).volume, expected, 0.03 * expected);
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, CoarseLabels,
    testing::Values(
        VoxelShape{"Ball", 1e-3,
                   [](int i, int j, int k) { return Eigen::Vector3d(i - 20, j - 20, k - 20).norm() < 6; }},
        VoxelShape{"SmallBall", 3e-3,
                   [](int i, int j, int k) { return Eigen::Vector3d(i - 20, j - 20, k - 20).norm() < 2.1; }},
        VoxelShape{"NineVoxels", 1e-3, [](int i, int j, int k) { return i / 3 == 6 && j / 3 == 6 && k == 20; }},
        VoxelShape{"Thread", 1e-3, [](int i, int j, int k) { return i > 10 && i < 30 && j == 20 && k == 20; }},
        VoxelShape{"Staircase", 1e-3,
                   [](int i, int j, int k) { return i > 5 && i < 35 && (i == j || i == j + 1) && k == 20; }},
        VoxelShape{"Sheet", 3e-3,
                   [](int i, int j, int k) { return std::hypot(i - 20.0, j - 20.0) < 12 && k / 2 == 10; }},
        // A trunk and what branches off it: what swells the one must not hide what the other lost.
        VoxelShape{"TrunkAndTwig", 3e-3,
                   [](int i, int j, int k) {
                     return (std::hypot(j - 20.0, k - 20.0) < 4 && i > 5 && i < 35) ||
                            (std::hypot(i - 20.0, k - 20.0) < 1.5 && j > 20 && j < 38);
                   }}),
    [](const auto& shape) { return shape.param.name; });

TEST(ImportOrgan, EndsInEveryPartOfTheWorkWhenAskedTo) {
  TriangleMesh open = half_sphere(1);
  append(open, half_sphere(-1));
  open.triangles.pop_back();
  for (Eigen::Vector3d& v : open.vertices) v *= 0.006 / kOrganRadius;
  const SourceFile labels = labels_where(
      {40, 40, 40}, 1e-3, [](int i, int j, int k) { return Eigen::Vector3d(i - 20, j - 20, k - 20).norm() < 15; });
  struct Enough {};
  for (const SourceFile& file : {labels, file_of({part("open", open)})}) {
    const std::vector<SourceFile> files{file};
    const OrganParts parts = assign_parts(files, {})[0];
    // Millions of steps take seconds: it asks tens of times, in each of its tasks.
    std::map<std::string, int> calls;
    import_organ(parts, {.surface_cells = 40},
                 [&](const std::string& task, double) { ++calls[task.substr(0, task.find(','))]; });
    const auto called = [&](const std::string& task) { return calls[parts.id + ": " + task]; };
    EXPECT_GE(called(file.image ? "distance to its voxels" : "looking for its inside"), 30);
    EXPECT_GE(called("new surface"), 10);
    EXPECT_GE(called("tetrahedra"), 1);
    int all = 0;
    for (const auto& [task, count] : calls) all += count;
    for (const int after : {1, all / 3, all}) {
      int count = 0;
      EXPECT_THROW(import_organ(parts, {.surface_cells = 40},
                                [&](const std::string&, double) {
                                  if (++count == after) throw Enough();
                                }),
                   Enough);
      EXPECT_EQ(count, after) << "nothing is done after that";
    }
  }
}

TEST(ImportOrgan, NoiseIsRefusedBeforeAnyWork) {
  std::minstd_rand random(1);
  const std::vector<SourceFile> files{
      labels_where({64, 64, 64}, 1e-3, [&](int, int, int) { return random() % 2 == 0; })};
  int calls = 0;
  std::string said;
  try {
    import_organ(assign_parts(files, {})[0], {}, [&](const std::string&, double) { ++calls; });
  } catch (const ContentError& error) {
    said = error.what();
  }
  EXPECT_NE(said.find("as noise has"), std::string::npos) << said;
  EXPECT_LT(calls, 5);
}

TEST(AssignParts, ThousandsOfOrgansAreRefusedUnlessChosen) {
  std::vector<SourcePart> parts;
  for (int p = 0; p < 2001; ++p) parts.push_back(part("bone_" + std::to_string(p), icosphere({0, 0, 0}, 0.01, 0)));
  const std::vector<SourceFile> files{file_of(std::move(parts))};
  try {
    assign_parts(files, {});
    FAIL() << "2001 folders";
  } catch (const ContentError& error) {
    EXPECT_STREQ(error.what(),
                 "thing.glb: 2001 parts make more than 2000 organs; choose some with --organ, or join them");
  }
  EXPECT_EQ(assign_parts(files, {{.id = "bones", .patterns = {"bone_*"}}})[0].parts.size(), 2001u);
}

TEST(OrganFiles, HoldWhatWasMade) {
  const std::vector<SourceFile> files{file_of({part("ball", icosphere({0.1, 0, 0}, 0.04, 3))})};
  const OrganParts parts = assign_parts(files, {})[0];
  const ImportedOrgan organ = import_organ(parts, {}, kQuiet);

  std::istringstream vtk(tetrahedra_vtk(organ));
  std::string line, word;
  std::size_t nodes = 0, tets = 0;
  while (vtk >> word && word != "POINTS") std::getline(vtk, line);
  vtk >> nodes >> word;
  ASSERT_EQ(nodes, organ.mesh.nodes.size());
  for (const Eigen::Vector3d& expected : organ.mesh.nodes) {
    Eigen::Vector3d x;
    vtk >> x.x() >> x.y() >> x.z();
    ASSERT_EQ(x, expected);
  }
  vtk >> word >> tets >> word;
  ASSERT_EQ(tets, organ.mesh.tets.size());
  for (const auto& expected : organ.mesh.tets) {
    std::array<int, 5> t{};
    for (int& i : t) vtk >> i;
    ASSERT_EQ(t, (std::array{4, expected[0], expected[1], expected[2], expected[3]}));
  }

  const nlohmann::json report = nlohmann::json::parse(report_json(organ, parts));
  EXPECT_EQ(report["tetrahedra"]["nodes"], organ.mesh.nodes.size());
  EXPECT_NEAR(report["solid"]["volume_m3"].get<double>(), organ.report.volume, 1e-12);
  EXPECT_NE(report_text(organ, parts).find("closed surface"), std::string::npos);

  const picture::Picture picture = organ_picture(organ, 400, 240);
  std::size_t drawn = 0;
  for (std::size_t i = 0; i < picture.rgba.size(); i += 4) drawn += picture.rgba[i] < 200 ? 1 : 0;
  EXPECT_GT(drawn, 400u * 240 / 8);
  EXPECT_EQ(organ_picture(organ, 400, 240).rgba, picture.rgba);
}

// Another program reads the tetrahedra and writes them in a format of its own: the same nodes, the same volume.
TEST(OrganFiles, GmshReadsTheTetrahedra) {
  if (std::string_view(STYLET_GMSH).empty()) GTEST_SKIP() << "gmsh is not installed";
  const std::vector<SourceFile> files{file_of({part("ball", icosphere({0.1, 0, 0}, 0.04, 3))})};
  const ImportedOrgan organ = import_organ(assign_parts(files, {})[0], {}, kQuiet);
  const support::TemporaryFolder folder;
  folder.write("ball.vtk", tetrahedra_vtk(organ));
  const std::string command = std::string("'") + STYLET_GMSH + "' -save -format msh2 -o '" +
                              (folder / "ball.msh").string() + "' '" + (folder / "ball.vtk").string() + "' >'" +
                              (folder / "log").string() + "' 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0) << command;

  std::ifstream msh(folder / "ball.msh");
  std::size_t count = 0;
  const auto section = [&](const std::string& name) {
    for (std::string line; std::getline(msh, line) && line != name;) {
    }
    msh >> count;
  };
  section("$Nodes");
  ASSERT_EQ(count, organ.mesh.nodes.size());
  std::vector<Eigen::Vector3d> nodes(count);
  for (Eigen::Vector3d& x : nodes) msh >> count >> x.x() >> x.y() >> x.z();
  section("$Elements");
  ASSERT_EQ(count, organ.mesh.tets.size());
  double volume = 0;
  for (std::size_t t = 0; t < organ.mesh.tets.size(); ++t) {
    int id = 0, kind = 0, tags = 0, tag = 0;
    std::array<std::size_t, 4> n{};
    msh >> id >> kind >> tags;
    for (int k = 0; k < tags; ++k) msh >> tag;
    for (std::size_t& node : n) msh >> node;
    ASSERT_EQ(kind, 4);  // of Gmsh: a tetrahedron of four nodes
    const auto edge = [&](std::size_t k) { return nodes.at(n[k] - 1) - nodes.at(n[0] - 1); };
    const double tet = edge(1).cross(edge(2)).dot(edge(3)) / 6;
    EXPECT_GT(tet, 0);
    volume += tet;
  }
  EXPECT_NEAR(volume, mesh::tet_quality(organ.mesh).volume, 1e-9 * volume);
}

/// Real organs of several patches; volumes of the welded closed surface where one exists, else of the solid that
/// other tools found by other means, m^3.
struct KnownOrgan {
  const char* name;
  double volume;
  double tolerance;
};
class RealOrgan : public ::testing::TestWithParam<KnownOrgan> {};

TEST_P(RealOrgan, BecomesASolidOfItsVolume) {
  const char* data = std::getenv("STYLET_TEST_DATA");
  if (data == nullptr) GTEST_SKIP() << "STYLET_TEST_DATA is not set";
  if (support::kSanitized) GTEST_SKIP() << "minutes long with a sanitizer; the spheres above take the same ways";
  const KnownOrgan& known = GetParam();
  const std::vector<SourceFile> files{
      read_source(std::filesystem::path(data) / "organs/hubmap" / (std::string(known.name) + ".glb"), {})};
  const std::vector<OrganParts> organs = assign_parts(files, {});
  ASSERT_EQ(organs.size(), 1u);
  const ImportedOrgan organ = import_organ(organs[0], {}, kQuiet);
  expect_sound(organ);
  EXPECT_NEAR(organ.report.volume / known.volume, 1, known.tolerance);
}

// The liver has no closed surface: 1.68 l with openings of 4 mm closed.
INSTANTIATE_TEST_SUITE_P(Hubmap, RealOrgan,
                         ::testing::Values(KnownOrgan{"VH_M_Liver", 1.68e-3, 0.06},
                                           KnownOrgan{"VH_M_Spleen", 229.9e-6, 0.001},
                                           KnownOrgan{"VH_M_Pancreas", 77.2e-6, 0.03}),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace stylet::import
