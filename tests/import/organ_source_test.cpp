// What files may say about organs: names that would leave their folder, names that are no text, parts far apart.
#include "engine/import/organ_source.h"
#include "engine/files/error.h"
#include "engine/import/organ_files.h"
#include "tests/gltf/glb.h"
#include "tests/support/temporary_folder.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <string>

namespace stylet::import {
namespace {

using files::ContentError;
using gltf::test::Glb;
using gltf::test::sphere;
using mesh::TriangleMesh;
using support::TemporaryFolder;

/// A glTF file with a ball for each of these organ ids.
SourceFile annotated(const TemporaryFolder& folder, const std::string& name, const std::vector<std::string>& ids) {
  Glb glb;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    glb.add(fmt::format("part_{}", i), sphere({0.2 * static_cast<double>(i), 0, 0}, 0.03), {{"id", ids[i]}});
  }
  return read_source(folder.write(name, glb.bytes()), {});
}

std::string refusal(const std::vector<SourceFile>& files, const std::vector<OrganRequest>& requests) {
  try {
    assign_parts(files, requests);
  } catch (const ContentError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "";
}

TEST(AssignParts, IdsOfAFileBecomeHarmlessNames) {
  const TemporaryFolder folder;
  const std::vector<std::string> ids{"../../etc/x y",       "/root", ".hidden", "..", "Lebervene \xC3\xA4", "-rf *",
                                     std::string(500, 'a'), "nul\nl"};
  const std::vector<SourceFile> files{annotated(folder, "bad.glb", ids)};
  const std::vector<OrganParts> organs = assign_parts(files, {});
  ASSERT_EQ(organs.size(), ids.size());
  EXPECT_EQ(organs[0].id, "etc_x_y");
  for (const OrganParts& organ : organs) {
    EXPECT_FALSE(organ.id.empty());
    EXPECT_LE(organ.id.size(), 60u);
    EXPECT_EQ(organ.id.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_"), std::string::npos) << organ.id;
    // So a folder named after it is a child of the folder for the results.
    EXPECT_EQ(("out" / std::filesystem::path(organ.id)).lexically_normal().parent_path(), "out") << organ.id;
  }
}

TEST(AssignParts, IdsThatBecomeTheSameNameAreOneOrgan) {
  const TemporaryFolder folder;
  const std::vector<SourceFile> files{annotated(folder, "two.glb", {"Left lobe", "left_lobe"})};
  const std::vector<OrganParts> organs = assign_parts(files, {});
  ASSERT_EQ(organs.size(), 1u);
  EXPECT_EQ(organs[0].id, "left_lobe");
  EXPECT_EQ(organs[0].parts.size(), 2u);
}

TEST(AssignParts, AnOrganInTwoFilesIsRefusedWithBothNames) {
  const TemporaryFolder folder;
  const std::vector<SourceFile> files{annotated(folder, "first.glb", {"liver"}),
                                      annotated(folder, "second.glb", {"Liver"})};
  const auto expect_both = [](const std::string& why) {
    EXPECT_NE(why.find("organ liver:"), std::string::npos) << why;
    EXPECT_NE(why.find("first.glb"), std::string::npos) << why;
    EXPECT_NE(why.find("second.glb"), std::string::npos) << why;
  };
  expect_both(refusal(files, {}));
  expect_both(refusal(files, {{.id = "liver", .patterns = {"part_*"}}}));

  // Different organs of different files stand beside each other.
  const std::vector<SourceFile> apart{annotated(folder, "third.glb", {"liver"}),
                                      annotated(folder, "fourth.glb", {"spleen"})};
  const std::vector<OrganParts> organs = assign_parts(apart, {});
  ASSERT_EQ(organs.size(), 2u);
  EXPECT_EQ(organs[0].file, &apart[0]);
  EXPECT_EQ(organs[1].file, &apart[1]);
}

/// An OBJ file of one group, in metres.
std::string obj(const std::string& group, const TriangleMesh& mesh) {
  std::string out = "g " + group + "\n";
  for (const Eigen::Vector3d& v : mesh.vertices) out += fmt::format("v {} {} {}\n", v.x(), v.y(), v.z());
  for (const auto& [a, b, c] : mesh.triangles) out += fmt::format("f {} {} {}\n", a + 1, b + 1, c + 1);
  return out;
}

TEST(OrganFiles, ReportIsJsonWhateverThePartsAreCalled) {
  const TemporaryFolder folder;
  const std::string name = "lobe \xFF\xC3 \"one\"\\\x01";
  SourceSettings metres;
  metres.metres_per_unit = 1;
  const std::vector<SourceFile> files{
      read_source(folder.write("names.obj", obj(name, sphere({0, 0, 0}, 0.03))), metres)};
  EXPECT_EQ(files[0].parts[0].name, "lobe ?? \"one\"\\?");
  const std::vector<OrganParts> organs = assign_parts(files, {});
  ASSERT_EQ(organs.size(), 1u);
  const ImportedOrgan organ = import_organ(organs[0], {.cell = 0.02}, [](const std::string&, double) {});
  const nlohmann::json report = nlohmann::json::parse(report_json(organ, organs[0]));
  const auto part = report["source"]["parts"][0].get<std::string>();
  EXPECT_TRUE(part.starts_with("lobe ??")) << part;
  EXPECT_NE(part.find("\"one\""), std::string::npos) << part;
}

}  // namespace
}  // namespace stylet::import
