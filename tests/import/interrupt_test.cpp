// Whatever an import is at, it asks often whether it is still wanted, and ends at the first no.
#include "engine/files/pulse.h"
#include "engine/gltf/gltf.h"
#include "engine/import/nifti.h"
#include "engine/import/obj.h"
#include "engine/import/organ_import.h"
#include "engine/import/organ_source.h"
#include "engine/import/stl.h"
#include "engine/import/thin_out.h"
#include "engine/mesh/decimation.h"
#include "engine/mesh/solid.h"
#include "engine/mesh/stuffing.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/mesh/surface_pieces.h"
#include "tests/gltf/glb.h"
#include "tests/import/file_bytes.h"
#include "tests/mesh/shapes.h"
#include "tests/support/sanitized.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace stylet::import::interrupted {
namespace {

using files::Pulse;
using mesh::TriangleMesh;
using mesh::test::icosphere;

constexpr double kRadius = 0.05;
constexpr int kLevels = support::kSanitized ? 5 : 7;  // 20 or 328 thousand triangles
constexpr std::size_t kTriangles = std::size_t{20} << (2 * kLevels);

const TriangleMesh& ball() {
  static const TriangleMesh mesh = icosphere({0, 0, 0}, kRadius, kLevels);
  return mesh;
}

double of_ball(const Eigen::Vector3d& x) {
  return x.norm() - kRadius;
}

using Work = std::function<void(const Pulse&)>;

/// Work that is told to end, and how many elements (triangles, voxels, lattice points) it goes through at least.
struct Stage {
  const char* name;
  std::size_t elements;
  std::function<Work()> prepare;  ///< what it works on is made by the one test that needs it
};

std::string obj_text() {
  std::string text;
  for (const Eigen::Vector3d& v : ball().vertices) text += fmt::format("v {} {} {}\n", v.x(), v.y(), v.z());
  for (const auto& t : ball().triangles) text += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return text;
}

std::string stl_text() {
  std::string text = "solid ball\n";
  for (const auto& t : ball().triangles) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const std::uint32_t v : t) {
      const Eigen::Vector3d& x = ball().vertices[v];
      text += fmt::format("vertex {} {} {}\n", x.x(), x.y(), x.z());
    }
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid\n";
}

constexpr int kVoxels = support::kSanitized ? 48 : 128;  // along an axis

/// A ball of label 1 in voxels of a millimetre.
LabelImage ball_image() {
  LabelImage image;
  image.size = Eigen::Vector3i::Constant(kVoxels);
  image.patient_from_voxel = Eigen::Affine3d(Eigen::Scaling(1e-3));
  const Eigen::Vector3d middle = Eigen::Vector3d::Constant(0.5 * (kVoxels - 1));
  for (int k = 0; k < kVoxels; ++k) {
    for (int j = 0; j < kVoxels; ++j) {
      for (int i = 0; i < kVoxels; ++i) {
        image.labels.push_back((Eigen::Vector3d(i, j, k) - middle).norm() < 0.4 * kVoxels ? 1 : 0);
      }
    }
  }
  return image;
}

std::string nifti_bytes() {
  std::string bytes(352, '\0');
  const auto put = [&](std::size_t at, auto value) { std::memcpy(bytes.data() + at, &value, sizeof value); };
  put(0, std::int32_t{348});
  for (int i = 0; i < 8; ++i) put(40 + 2 * i, static_cast<std::int16_t>(i == 0 ? 3 : i < 4 ? kVoxels : 1));
  put(70, std::int16_t{2});
  put(72, std::int16_t{8});
  for (int i = 0; i < 4; ++i) put(76 + 4 * i, 1.0F);
  put(108, 352.0F);
  bytes[123] = 2;
  std::memcpy(bytes.data() + 344, "n+1", 4);
  for (const std::uint16_t label : ball_image().labels) bytes += static_cast<char>(label);
  return bytes;
}

SourceFile labels_file() {
  SourceFile file{.path = "a.nii", .format = "NIfTI", .parts = {}, .image = {}, .assumptions = {}, .warnings = {}};
  file.image = ball_image();
  file.parts.push_back({.name = "ball", .place = "a.nii:ball", .mesh = {}, .organ = {}, .tissue = {}, .label = 1});
  return file;
}

/// @param open  a triangle is missing
SourceFile surface_file(bool open) {
  SourceFile file{.path = "a.stl", .format = "STL", .parts = {}, .image = {}, .assumptions = {}, .warnings = {}};
  TriangleMesh mesh = ball();
  if (open) mesh.triangles.pop_back();
  file.parts.push_back({.name = "ball", .place = "a.stl:ball", .mesh = std::move(mesh), .organ = {}, .tissue = {}});
  return file;
}

ImportProgress asking(const Pulse& pulse) {
  return [&pulse](const std::string&, double) { pulse.now(); };
}

void import_of(const SourceFile& file, const Pulse& pulse) {
  const std::vector<OrganParts> organs = assign_parts({file}, {{.id = "ball", .patterns = {"*"}}}, pulse);
  OrganParts organ = organs.front();
  organ.file = &file;
  organ.parts = {&file.parts.front()};
  (void)import_organ(organ, {.target_nodes = 500, .surface_cells = 40}, asking(pulse));
}

std::string glb_bytes() {
  gltf::test::Glb glb;
  glb.add("ball", ball());
  return glb.bytes();
}

std::vector<Stage> stages() {
  constexpr std::size_t kImage = std::size_t{kVoxels} * kVoxels * kVoxels;
  constexpr double kCell = 2e-3;
  const auto cells = static_cast<std::size_t>(std::pow(2 * kRadius / kCell, 3));
  const auto reading = [](const char* name, std::size_t elements, std::string (*bytes)(), auto read) {
    return Stage{name, elements,
                 [bytes, read] { return [text = bytes(), read](const Pulse& p) { read(test::bytes_of(text), p); }; }};
  };
  const auto of_surface = [](const char* name, std::size_t elements, auto work) {
    return Stage{name, elements, [work] {
                   (void)ball();
                   return [work](const Pulse& p) { work(ball(), p); };
                 }};
  };
  const auto of_file = [](const char* name, std::size_t elements, auto file, auto work) {
    return Stage{name, elements, [file, work] { return [made = file(), work](const Pulse& p) { work(made, p); }; }};
  };
  const auto closed = [] { return surface_file(false); };
  const auto open = [] { return surface_file(true); };
  return {
      reading("Obj", kTriangles, obj_text, [](auto bytes, const Pulse& p) { (void)read_obj(bytes, "a.obj", {}, p); }),
      reading("StlText", kTriangles, stl_text,
              [](auto bytes, const Pulse& p) { (void)read_stl(bytes, "a.stl", {}, p); }),
      reading(
          "Stl", kTriangles, [] { return test::binary_stl(ball()); },
          [](auto bytes, const Pulse& p) { (void)read_stl(bytes, "a.stl", {}, p); }),
      reading("Nifti", kImage, nifti_bytes,
              [](auto bytes, const Pulse& p) { (void)read_nifti_labels(bytes, "a.nii", {}, p); }),
      reading("Gltf", kTriangles, glb_bytes,
              [](auto bytes, const Pulse& p) { (void)gltf::read_gltf(bytes, "a.glb", {}, p); }),
      of_surface("Welding", kTriangles,
                 [](const auto& mesh, const Pulse& p) { (void)mesh::clean_surface(mesh, "a", nullptr, p); }),
      of_surface("Inspecting", kTriangles, [](const auto& mesh, const Pulse& p) { (void)mesh::inspect(mesh, p); }),
      of_surface("Judging", 4 * kTriangles,
                 [](const auto& mesh, const Pulse& p) { (void)mesh::solid_surface(mesh, "a", p); }),
      of_surface("Pieces", kTriangles, [](const auto& mesh, const Pulse& p) { (void)mesh::outer_pieces(mesh, p); }),
      of_surface("Distances", kTriangles, [](const auto& mesh, const Pulse& p) { const mesh::Solid solid(mesh, p); }),
      of_surface("Decimation", kTriangles,
                 [](const auto& mesh, const Pulse& p) { (void)mesh::decimate(mesh, {.triangles = 1000}, p); }),
      of_surface("ThinningOut", kTriangles, [](const auto& mesh, const Pulse& p) { (void)thin_out(mesh, 1e-4, p); }),
      {"Stuffing", 12 * cells,
       [] {
         return [](const Pulse& p) {
           const Eigen::Vector3d corner = Eigen::Vector3d::Constant(kRadius);
           (void)mesh::stuff(of_ball, Eigen::AlignedBox3d(-corner, corner), kCell, 2, mesh::Parts::largest, p);
         };
       }},
      of_file("TellingApart", 4 * kTriangles, closed,
              [](const SourceFile& file, const Pulse& p) { (void)assign_parts({file}, {}, p); }),
      of_file("ClosedOrgan", 4 * kTriangles, closed, import_of),
      of_file("OpenOrgan", 4 * kTriangles, open, import_of),
      of_file("Labels", kImage, labels_file, import_of),
  };
}

struct Unwanted : std::exception {};

class Interrupt : public testing::TestWithParam<Stage> {};

// Counted in elements, not in seconds: what a machine needs for so many is milliseconds.
TEST_P(Interrupt, IsHeardWithinSoManyElementsAndEndsTheWork) {
  const Stage& stage = GetParam();
  const Work work = stage.prepare();
  std::size_t asked = 0;
  work([&] { ++asked; });
  EXPECT_GE(asked, stage.elements / Pulse::kOften) << "of " << stage.elements << " elements";
  ASSERT_GE(asked, 1u);
  for (const std::size_t at : {std::size_t{1}, (asked + 1) / 2, asked}) {
    std::size_t heard = 0;
    EXPECT_THROW(work([&] {
                   if (++heard >= at) throw Unwanted();
                 }),
                 Unwanted)
        << "at " << at << " of " << asked;
    EXPECT_EQ(heard, at) << "it went on";
  }
}

INSTANTIATE_TEST_SUITE_P(Import, Interrupt, testing::ValuesIn(stages()),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace stylet::import::interrupted
