// Broken glTF files made to do harm, and real organs, where STYLET_TEST_DATA has them.
#include "engine/gltf/draco_decoder.h"
#include "engine/gltf/gltf.h"
#include "engine/readers/scenario.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

namespace stylet::readers {
namespace {

std::filesystem::path test_data(const std::string& folder) {
  const char* root = std::getenv("STYLET_TEST_DATA");
  const std::filesystem::path path = root == nullptr ? "" : std::filesystem::path(root) / folder;
  std::error_code error;
  return root != nullptr && std::filesystem::is_directory(path, error) ? path : std::filesystem::path();
}

/// Empty: accepted.
std::string refusal(const std::filesystem::path& path) {
  try {
    const gltf::GltfScene scene = gltf::read_gltf(path);
    EXPECT_FALSE(scene.organs.empty()) << path;
    for (const gltf::GltfOrgan& organ : scene.organs) {
      for (const auto& triangle : organ.mesh.triangles) {
        for (const std::uint32_t vertex : triangle) EXPECT_LT(vertex, organ.mesh.vertices.size()) << path;
      }
    }
    return {};
  } catch (const files::ContentError& error) {
    return error.what();
  }
}

TEST(HostileFiles, GetTheVerdictTheCollectionExpects) {
  const auto folder = test_data("malformed/hostile");
  if (folder.empty()) GTEST_SKIP() << "STYLET_TEST_DATA has no malformed/hostile";
  std::ifstream table(folder / "EXPECT.tsv");
  std::string line;
  std::getline(table, line);
  int checked = 0;
  while (std::getline(table, line)) {
    std::istringstream row(line);
    std::string file;
    std::string expect;
    std::getline(row, file, '\t');
    std::getline(row, expect, '\t');
    if (!std::filesystem::exists(folder / file)) continue;
    const std::string error = refusal(folder / file);
    EXPECT_THAT(error, ::testing::Not(::testing::HasSubstr("\n"))) << file;
    // Files named geo_ are sound glTF of unsound surfaces: tests/import/hostile_surfaces_test.cpp.
    if (file.starts_with("geo_")) continue;
    if (expect == "accept") {
      EXPECT_EQ(error, "") << line;
    } else if (expect == "reject") {
      EXPECT_NE(error, "") << line;
    }
    ++checked;
  }
  EXPECT_GT(checked, 20);
}

TEST(HostileFiles, RealOrgansAreRead) {
  const auto folder = test_data("organs");
  if (folder.empty()) GTEST_SKIP() << "STYLET_TEST_DATA has no organs";
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".glb") continue;
    const std::string error = refusal(entry.path());
    const std::string name = entry.path().filename().string();
    if (name.find("meshopt") != std::string::npos) {
      EXPECT_THAT(error, ::testing::HasSubstr("EXT_meshopt_compression")) << name;
    } else if (name.find("draco") != std::string::npos && gltf::draco_decoder().empty()) {
      EXPECT_THAT(error, ::testing::HasSubstr(gltf::kWithoutDraco)) << name;
    } else {
      EXPECT_EQ(error, "") << name;
    }
  }
}

}  // namespace
}  // namespace stylet::readers
