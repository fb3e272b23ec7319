// Meshes compressed by Draco; in a build without it, their refusal.
#include "engine/gltf/draco_decoder.h"
#include "engine/gltf/gltf.h"
#include "tests/gltf/glb.h"
#include "tests/support/sanitized.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <fstream>
#include <map>
#include <random>
#include <sstream>

namespace stylet::gltf {
namespace {

using ::testing::HasSubstr;

std::string refusal(const std::string& bytes) {
  try {
    read_gltf(test::as_bytes(bytes), "a.glb");
    return {};
  } catch (const files::ContentError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
}

/// Of the cone over the surface with its tip there: for a closed surface the volume inside.
double volume_of(const mesh::TriangleMesh& mesh, const Eigen::Vector3d& tip = Eigen::Vector3d::Zero()) {
  double six = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    six += (mesh.vertices[a] - tip).dot((mesh.vertices[b] - tip).cross(mesh.vertices[c] - tip));
  }
  return six / 6;
}

double area_of(const mesh::TriangleMesh& mesh) {
  double twice = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    twice += (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
  }
  return twice / 2;
}

constexpr int kBits = 12;

/// test::sphere({0, 0, 0.1}, 0.05, 4) by draco::Encoder of Draco 1.5.5 with positions of kBits, hexadecimal.
constexpr std::string_view kBall =
    "445241434f020201010000001a30002f00000c5f5bd56aab5a552d55aa500a01011001ff000001000903000002010101000d"
    "27752229166507078092b67194ff82fe0f4bb004004efb4a00d87fb004b5a7c11296028025d4a0064b01c012964f831a2c5b"
    "2900583e0d969e86fa2b00a0060b00b0a006e02ba801781a2c009efe0a80af9e0600965013c0575003f03458003cfd15005f"
    "3d0d00584f0300f55700400d16004efb3f000000000000ff0f0000cdcc4cbdcdcc4cbdcdcc4c3dcecccc3d0c";

std::string from_hexadecimal(std::string_view digits) {
  std::string bytes(digits.size() / 2, '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<char>(std::stoi(std::string(digits.substr(2 * i, 2)), nullptr, 16));
  }
  return bytes;
}

/// A ball whose triangles are in Draco data alone.
test::Glb compressed_ball() {
  const mesh::TriangleMesh ball = test::sphere({0, 0, 0.1}, 0.05, 4);
  test::Glb glb;
  glb.add("ball", ball);
  glb.bin = from_hexadecimal(kBall);
  glb.json["extensionsUsed"] = glb.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  glb.json["buffers"] = {{{"byteLength", glb.bin.size()}}};
  glb.json["bufferViews"] = {{{"buffer", 0}, {"byteLength", glb.bin.size()}}};
  for (auto& accessor : glb.json["accessors"]) accessor.erase("bufferView");
  glb.json["accessors"][0]["min"] = {-0.05, -0.05, 0.05};
  glb.json["accessors"][0]["max"] = {0.05, 0.05, 0.15};
  glb.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = {
      {"bufferView", 0}, {"attributes", {{"POSITION", 0}}}};
  return glb;
}

TEST(Draco, ABallComesBackWithinItsQuantisation) {
  if (draco_decoder().empty()) GTEST_SKIP() << kWithoutDraco;
  const mesh::TriangleMesh plain = test::sphere({0, 0, 0.1}, 0.05, 4);
  const std::string bytes = compressed_ball().bytes();
  const GltfScene scene = read_gltf(test::as_bytes(bytes), "a.glb");
  ASSERT_EQ(scene.organs.size(), 1U);
  const mesh::TriangleMesh& mesh = scene.organs[0].mesh;
  EXPECT_EQ(mesh.triangles.size(), plain.triangles.size());
  // Half a step of the grid each vertex, along the normal at most.
  const double step = 0.1 / ((1 << kBits) - 1);
  EXPECT_NEAR(volume_of(mesh), volume_of(plain), std::sqrt(3.0) * step / 2 * area_of(plain));
}

TEST(Draco, WhatItsAccessorsDeclareBoundsIt) {
  if (draco_decoder().empty()) GTEST_SKIP() << kWithoutDraco;
  const auto broken = [](auto&& change) {
    test::Glb glb = compressed_ball();
    change(glb.json);
    return refusal(glb.bytes());
  };
  const std::string counts = "hold other counts than its accessors declare";
  EXPECT_THAT(broken([](auto& json) { json["accessors"][0]["count"] = 3; }), HasSubstr(counts));
  EXPECT_THAT(broken([](auto& json) { json["accessors"][1]["count"] = 3; }), HasSubstr(counts));
  EXPECT_THAT(broken([](auto& json) { json["accessors"][0]["count"] = 4000000000U; }), HasSubstr("accepted is 1 to"));
  EXPECT_THAT(broken([](auto& json) { json["accessors"][0]["type"] = "VEC2"; }), HasSubstr("no VEC3"));
  EXPECT_THAT(broken([](auto& json) { json["accessors"][0]["componentType"] = 5123; }), HasSubstr("no floats"));
  EXPECT_THAT(broken([](auto& json) { json["bufferViews"][0]["byteLength"] = 1000000; }),
              HasSubstr("leave their buffer"));
  EXPECT_THAT(broken([](auto& json) { json["bufferViews"][0]["byteLength"] = 40; }), HasSubstr("are broken"));
  EXPECT_THAT(
      broken([](auto& json) {
        json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = 9;
      }),
      HasSubstr(counts));
}

// Damaged data decode to noise: without a range nothing tells them from an organ.
TEST(Draco, PositionsWithoutARangeAreRefused) {
  if (draco_decoder().empty()) GTEST_SKIP() << kWithoutDraco;
  const auto without = [](auto&& change) {
    test::Glb glb = compressed_ball();
    change(glb.json["accessors"][0]);
    return refusal(glb.bytes());
  };
  const auto place = HasSubstr(":/meshes/0/primitives/0/attributes/POSITION: its accessor has no min and max");
  EXPECT_THAT(without([](auto& accessor) { accessor.erase("min"); }), place);
  EXPECT_THAT(without([](auto& accessor) { accessor.erase("max"); }), place);
  EXPECT_THAT(without([](auto& accessor) { accessor["max"] = {0.05, 0.05}; }), place) << "of two numbers";
  EXPECT_THAT(without([](auto& accessor) { accessor["min"] = {0, "0", 0}; }), place) << "a text";
  EXPECT_THAT(without([](auto& accessor) { std::swap(accessor["min"], accessor["max"]); }), place) << "inside out";
}

TEST(Draco, DataThatManyPrimitivesShareCountForEach) {
  test::Glb glb = compressed_ball();
  glb.bin.resize(1 << 20);
  glb.json["buffers"][0]["byteLength"] = glb.json["bufferViews"][0]["byteLength"] = glb.bin.size();
  auto& primitives = glb.json["meshes"][0]["primitives"];
  for (int i = 0; i < 100; ++i) primitives.push_back(nlohmann::json(primitives[0]));
  EXPECT_THAT(refusal(glb.bytes()), HasSubstr(draco_decoder().empty() ? kWithoutDraco : "bytes of Draco data"));
}

TEST(Draco, DamagedDataAreRefusedOrHarmless) {
  if (draco_decoder().empty()) GTEST_SKIP() << kWithoutDraco;
  test::Glb sound = compressed_ball();
  ASSERT_EQ(refusal(sound.bytes()), "");
  // Of glTF +Y up: where the patient has them.
  Eigen::AlignedBox3d declared;
  const std::string whole = sound.bytes();
  const GltfScene as_it_was = read_gltf(test::as_bytes(whole), "a.glb");
  for (const Eigen::Vector3d& v : as_it_was.organs[0].mesh.vertices) declared.extend(v);
  std::mt19937 random(20240607);
  int refused = 0;
  constexpr int kCopies = support::kSanitized ? 40 : 200;
  for (int i = 0; i < kCopies; ++i) {
    test::Glb glb = sound;
    const std::size_t at = random() % glb.bin.size();
    if (i % 4 == 0) {
      std::fill(glb.bin.begin() + static_cast<std::ptrdiff_t>(at), glb.bin.end(), '\0');  // cut off
    } else {
      glb.bin[at] = static_cast<char>(glb.bin[at] ^ (1 << random() % 8));
    }
    const std::string bytes = glb.bytes();
    if (!refusal(bytes).empty()) {
      ++refused;
      continue;
    }
    const GltfScene read = read_gltf(test::as_bytes(bytes), "a.glb");
    for (const Eigen::Vector3d& v : read.organs[0].mesh.vertices) {
      ASSERT_LE(declared.exteriorDistance(v), 0.0025) << "noise was taken for an organ: byte " << at;
    }
  }
  EXPECT_GT(refused, kCopies / 10);
}

TEST(Draco, WithoutItAFileThatNeedsItIsRefusedWithAdvice) {
  if (!draco_decoder().empty()) GTEST_SKIP() << "this build has Draco";
  test::Glb glb = compressed_ball();
  EXPECT_THAT(refusal(glb.bytes()), HasSubstr("gltf-transform cp IN OUT"));
  glb.json.erase("extensionsRequired");
  EXPECT_THAT(refusal(glb.bytes()), HasSubstr("-DSTYLET_DRACO=ON")) << "zeros for positions would be worse";
}

TEST(Draco, PlainTrianglesBesideItAreTaken) {
  test::Glb glb;
  glb.add("ball", test::sphere({0, 0, 0.1}, 0.05, 4));
  glb.json["extensionsUsed"] = {"KHR_draco_mesh_compression"};
  glb.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = {
      {"bufferView", 99}, {"attributes", {{"POSITION", 0}}}};
  EXPECT_EQ(refusal(glb.bytes()), "");
}

/// The liver of HuBMAP in another encoding, held against the plain one.
class EncodedLiver : public ::testing::TestWithParam<std::string> {};

TEST_P(EncodedLiver, IsTheSameWithinItsQuantisation) {
  const char* root = std::getenv("STYLET_TEST_DATA");
  const auto folder = std::filesystem::path(root == nullptr ? "" : root) / "organs";
  if (!std::filesystem::exists(folder / "encodings" / GetParam()))
    GTEST_SKIP() << "STYLET_TEST_DATA has no " << GetParam();
  if (draco_decoder().empty() && GetParam().find("draco") != std::string::npos) {
    EXPECT_THROW(read_gltf(folder / "encodings" / GetParam()), files::ContentError);
    GTEST_SKIP() << kWithoutDraco;
  }
  const GltfScene plain = read_gltf(folder / "hubmap" / "VH_M_Liver.glb");
  const GltfScene encoded = read_gltf(folder / "encodings" / GetParam());
  std::map<std::string, const mesh::TriangleMesh*> parts;
  for (const GltfOrgan& organ : encoded.organs) parts[organ.name] = &organ.mesh;
  EXPECT_EQ(encoded.organs.size(), plain.organs.size());
  for (const GltfOrgan& organ : plain.organs) {
    ASSERT_TRUE(parts.contains(organ.name)) << organ.name;
    const mesh::TriangleMesh& mesh = *parts[organ.name];
    EXPECT_EQ(mesh.triangles.size(), organ.mesh.triangles.size()) << organ.name;
    Eigen::AlignedBox3d box;
    for (const auto& vertex : organ.mesh.vertices) box.extend(vertex);
    // 11 bits, the coarsest that encoders choose by themselves: half a step each vertex, along the normal at most.
    const double half_step = std::sqrt(3.0) * box.sizes().maxCoeff() / ((1 << 11) - 1) / 2;
    EXPECT_NEAR(area_of(mesh), area_of(organ.mesh), 0.02 * area_of(organ.mesh)) << organ.name;
    EXPECT_NEAR(volume_of(mesh, box.center()), volume_of(organ.mesh, box.center()), half_step * area_of(organ.mesh))
        << organ.name;
  }
}

INSTANTIATE_TEST_SUITE_P(Encodings, EncodedLiver, ::testing::Values("VH_M_liver_draco.glb", "VH_M_liver_quant.glb"),
                         [](const auto& test) { return test.index == 0 ? "Draco" : "Quantised"; });

}  // namespace
}  // namespace stylet::gltf
