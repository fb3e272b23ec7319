// STL and OBJ from memory: what is in them, in which frame, and one line where they are wrong.
#include "engine/files/error.h"
#include "engine/import/obj.h"
#include "engine/import/stl.h"
#include "engine/mesh/surface_mesh.h"
#include "tests/import/file_bytes.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <string>

namespace stylet::import {
namespace {

using files::ContentError;
using test::bytes_of;

const std::vector<Eigen::Vector3d> kCorners{{0, 0, 0}, {10, 0, 0}, {0, 20, 0}, {0, 0, 30}};
const std::vector<std::array<std::uint32_t, 3>> kFaces{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

std::string binary_stl(const std::string& header = "tetrahedron") {
  return test::binary_stl({.vertices = kCorners, .triangles = kFaces}, header);
}

std::string text_stl(const std::string& name = "liver") {
  std::string out = "solid " + name + "\n";
  for (const auto& face : kFaces) {
    out += " facet normal 0 0 0\n  outer loop\n";
    for (const std::uint32_t c : face) {
      out += fmt::format("   vertex {} {:e} {}\r\n", kCorners[c].x(), kCorners[c].y(), kCorners[c].z());
    }
    out += "  endloop\n endfacet\n";
  }
  return out + "endsolid\n";
}

void expect_tetrahedron(const mesh::TriangleMesh& mesh) {
  const mesh::SurfaceReport report = mesh::inspect(mesh::clean_surface(mesh, "test"));
  EXPECT_EQ(report.vertices, 4);
  EXPECT_EQ(report.triangles, 4);
  EXPECT_TRUE(report.closed());
  EXPECT_TRUE(report.oriented());
  EXPECT_NEAR(report.volume, 10.0 * 20 * 30 / 6, 1e-9);
}

template <typename Read>
std::string refusal(const Read& read) {
  try {
    read();
  } catch (const ContentError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "";
}

TEST(Stl, BinaryAndTextHoldTheSameSolid) {
  const SurfaceFile binary = read_stl(bytes_of(binary_stl()), "a.stl");
  ASSERT_EQ(binary.surfaces.size(), 1u);
  EXPECT_EQ(binary.surfaces[0].name, "a");
  expect_tetrahedron(binary.surfaces[0].mesh);
  const SurfaceFile text = read_stl(bytes_of(text_stl()), "a.stl");
  ASSERT_EQ(text.surfaces.size(), 1u);
  EXPECT_EQ(text.surfaces[0].name, "liver");
  expect_tetrahedron(text.surfaces[0].mesh);
  EXPECT_FALSE(text.axes);
}

TEST(Stl, BinaryIsKnownByItsLengthThoughItsHeaderSaysSolid) {
  EXPECT_EQ(read_stl(bytes_of(binary_stl("solid made by a program")), "a.stl").surfaces.size(), 1u);
}

TEST(Stl, SaysWhichAxesItsHeaderNames) {
  EXPECT_EQ(read_stl(bytes_of(binary_stl("3D Slicer output. SPACE=LPS")), "a.stl").axes, Axes::lps);
  EXPECT_EQ(read_stl(bytes_of(text_stl("3D Slicer output. SPACE=RAS")), "b.stl").axes, Axes::ras);
}

TEST(Stl, RefusesWhatIsWrongInOneLine) {
  const auto stl = [](const std::string& text) { return refusal([&] { read_stl(bytes_of(text), "a.stl"); }); };
  EXPECT_NE(stl(binary_stl().substr(0, 200)).find("announces 4 triangles"), std::string::npos);
  EXPECT_NE(stl("").find("is no STL"), std::string::npos);
  EXPECT_NE(stl("solid x\nendsolid\n").find("no triangle"), std::string::npos);
  EXPECT_NE(stl("solid x\nfacet\nouter loop\nvertex 1 2 nan\n").find("a.stl:4: \"nan\" is no finite number"),
            std::string::npos);
  EXPECT_NE(stl("solid x\nfacet\nouter loop\nvertex 1 2 3\nendloop\n").find("a loop of 1 corners"),
            std::string::npos);
  EXPECT_NE(stl("solid x\nwhat is this\n").find("\"what\" is no word of an STL"), std::string::npos);
  std::string not_finite = binary_stl();
  const float nan = std::nanf("");
  std::memcpy(not_finite.data() + 84 + 12, &nan, sizeof nan);
  EXPECT_NE(stl(not_finite).find("triangle 0: a corner lies at nan"), std::string::npos);
  SurfaceLimits limits;
  limits.elements = 3;
  EXPECT_NE(refusal([&] { read_stl(bytes_of(binary_stl()), "a.stl", limits); }).find("more than 3 triangles"),
            std::string::npos);
}

TEST(Obj, ReadsObjectsPolygonsAndIndicesOfEveryKind) {
  const std::string text =
      "# SPACE=RAS\nmtllib x.mtl\no liver\nv 0 0 0\nv 10 0 0 1 1 1\nv 0 20 0\nv 0 0 30\nvn 0 0 1\nvt 0 0\n"
      "usemtl red\nf 1/1/1 3/1 2//1\nf 1 2 4\nf -3 -2 -1\nf 1 4 3 # the last\n"
      "g square\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nf 5 6 7 8\nl 1 2\n";
  const SurfaceFile file = read_obj(bytes_of(text), "a.obj");
  ASSERT_EQ(file.surfaces.size(), 2u);
  EXPECT_EQ(file.axes, Axes::ras);
  EXPECT_EQ(file.surfaces[0].name, "liver");
  expect_tetrahedron(file.surfaces[0].mesh);
  EXPECT_EQ(file.surfaces[1].name, "square");
  EXPECT_EQ(file.surfaces[1].mesh.triangles.size(), 2u);
  EXPECT_EQ(file.surfaces[1].mesh.vertices.size(), 4u);
}

TEST(Obj, RefusesWhatIsWrongWithItsLine) {
  const auto obj = [](const std::string& text) { return refusal([&] { read_obj(bytes_of(text), "a.obj"); }); };
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_NE(obj(points + "f 1 2 4\n").find("a.obj:4: vertex 4 does not exist; there are 3"), std::string::npos);
  EXPECT_NE(obj(points + "f 1 2 -4\n").find("vertex -4 does not exist"), std::string::npos);
  EXPECT_NE(obj(points + "f 0 1 2\n").find("vertex 0 does not exist"), std::string::npos);
  EXPECT_NE(obj(points + "f 1 2\n").find("a face of 2 corners"), std::string::npos);
  EXPECT_NE(obj(points + "f a b c\n").find("\"a\" is no corner"), std::string::npos);
  EXPECT_NE(obj(points + "f 99999999999999999999 1 2\n").find("is no corner"), std::string::npos);
  EXPECT_NE(obj("v 1 2 inf\n").find("a.obj:1: \"inf\" is no finite number"), std::string::npos);
  EXPECT_NE(obj("v 1 2\n").find("\"\" is no finite number"), std::string::npos);
  EXPECT_NE(obj(points).find("has no face"), std::string::npos);
}

TEST(Axes, TurnIntoThePatientFrameWithoutMirroring) {
  for (const Axes axes : {Axes::patient, Axes::ras, Axes::lps}) {
    const Eigen::Affine3d patient = patient_from_file(axes, 1e-3);
    EXPECT_NEAR(patient.linear().determinant(), 1e-9, 1e-20);
  }
  const Eigen::Vector3d left(1, 0, 0), superior(0, 1, 0), anterior(0, 0, 1);
  EXPECT_EQ(patient_from_file(Axes::ras, 1) * Eigen::Vector3d(-1, 0, 0), left);
  EXPECT_EQ(patient_from_file(Axes::ras, 1) * Eigen::Vector3d(0, 1, 0), anterior);
  EXPECT_EQ(patient_from_file(Axes::lps, 1) * Eigen::Vector3d(0, 0, 1), superior);
  EXPECT_EQ(patient_from_file(Axes::lps, 1) * Eigen::Vector3d(0, -1, 0), anterior);
}

}  // namespace
}  // namespace stylet::import
