#include "engine/gltf/gltf.h"

#include "engine/mesh/surface_mesh.h"
#include "tests/gltf/glb.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace stylet::gltf {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

using json = nlohmann::json;
using test::Glb;

/// A tetrahedron with its four faces outward.
mesh::TriangleMesh tetrahedron() {
  return {.vertices = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}},
          .triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
}

Glb one_tetrahedron() {
  Glb glb;
  glb.add("organ", tetrahedron());
  return glb;
}

GltfScene read(const std::string& bytes) {
  return read_gltf(test::as_bytes(bytes), "a.glb");
}

std::string gltf_error(const std::string& bytes) {
  try {
    read(bytes);
  } catch (const files::ContentError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Gltf, ReadsGeometryNamesAndAnnotations) {
  Glb glb;
  glb.add("liver_surface", tetrahedron(),
          {{"id", "liver"}, {"role", "boundary"}, {"deformable", true}, {"body", "liver"}},
          {{"version", 1},
           {"preset", "liver"},
           {"mechanics", {{"youngsModulus", 4000}, {"density", 1050}}},
           {"acoustics", {{"impedance_rayl", 1.7e6}}}});
  const GltfScene scene = read(glb.bytes());
  ASSERT_EQ(scene.organs.size(), 1u);
  const GltfOrgan& organ = scene.organs[0];
  EXPECT_EQ(organ.name, "liver_surface");
  EXPECT_EQ(organ.place, "nodes/0");
  EXPECT_EQ(organ.organ.id, "liver");
  EXPECT_EQ(organ.organ.role, "boundary");
  EXPECT_EQ(organ.organ.body, "liver");
  EXPECT_TRUE(organ.organ.deformable);
  ASSERT_TRUE(organ.tissue);
  EXPECT_EQ(organ.tissue->preset, "liver");
  EXPECT_EQ(organ.tissue->values,
            (std::map<std::string, double>{
                {"young_modulus_pa", 4000}, {"density_kg_per_m3", 1050}, {"impedance_rayl", 1.7e6}}));
  EXPECT_EQ(organ.mesh.triangles, tetrahedron().triangles);
  EXPECT_NEAR(mesh::inspect(organ.mesh).volume, 1e-3 / 6, 1e-9);
}

TEST(Gltf, UnknownAnnotationsAreNamedOnceAndBadValuesAreErrors) {
  Glb glb;
  glb.add("a", tetrahedron(), {{"id", "a"}, {"colour_of_the_day", 1}},
          {{"preset", "liver"}, {"mechanical", {{"density", 1}}}, {"mechanics", {{"youngModulus", 1}}}});
  glb.add("b", tetrahedron(), "liver");
  glb.json["meshes"][1]["primitives"][0]["material"] = 0;  // shared: said once
  const GltfScene scene = read(glb.bytes());
  EXPECT_THAT(scene.warnings, IsEmpty());
  EXPECT_THAT(
      scene.unknown_annotations,
      ElementsAre("a.glb:/nodes/0/extras/organ/colour_of_the_day: is not a known key; remove it (known: body, "
                  "deformable, id, "
                  "role)",
                  "a.glb:/materials/0/extras/tissue/mechanics/youngModulus: is not a known key; did you mean "
                  "\"youngsModulus\"?",
                  "a.glb:/materials/0/extras/tissue/mechanical: is not a known key; did you mean \"mechanics\"?",
                  "a.glb:/nodes/1/extras/organ: is not an object; write {\"id\": ...}"));

  glb.json["materials"][0]["extras"]["tissue"]["mechanics"] = {{"poissonsRatio", 0.7}};
  EXPECT_THAT(gltf_error(glb.bytes()),
              HasSubstr("a.glb:/materials/0/extras/tissue/mechanics/poisson_ratio: is 0.7, accepted is 0 to 0.499"));
  glb.json["materials"][0]["extras"]["tissue"] = {{"preset", "liver"}};
  glb.json["nodes"][0]["extras"]["organ"]["role"] = "villain";
  EXPECT_THAT(gltf_error(glb.bytes()),
              HasSubstr("a.glb:/nodes/0/extras/organ/role: is \"villain\", accepted is one of"));
}

TEST(Gltf, TransformsComposeAndMirrorsKeepTheOutside) {
  Glb glb = one_tetrahedron();
  glb.json["nodes"][0]["scale"] = {-2, 1, 1};
  glb.json["nodes"].push_back({{"name", "parent"},
                               {"children", {0}},
                               {"translation", {1, 2, 3}},
                               {"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}}});  // 90 degrees about Z
  glb.json["scenes"][0]["nodes"] = {1};
  const GltfScene scene = read(glb.bytes());
  const mesh::TriangleMesh& mesh = scene.organs.at(0).mesh;
  // x = 0.1 -> mirrored and scaled to -0.2 -> turned onto -y -> moved
  EXPECT_LT((mesh.vertices[1] - Eigen::Vector3d(1, 1.8, 3)).norm(), 1e-6);
  EXPECT_NEAR(mesh::inspect(mesh).volume, 2e-3 / 6, 1e-8) << "positive: still counter-clockwise from outside";
}

TEST(Gltf, StripsFansAndUnindexedTrianglesAgreeWithTriangles) {
  // The square 0123 as two triangles, its normal +z.
  const mesh::TriangleMesh square{.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}},
                                  .triangles = {{0, 1, 2}, {2, 1, 3}}};
  const auto area = [](const Glb& glb) {
    double z = 0;
    for (const GltfOrgan& organ : read(glb.bytes()).organs) {
      for (const auto& [a, b, c] : organ.mesh.triangles) {
        const auto& v = organ.mesh.vertices;
        z += 0.5 * (v[b] - v[a]).cross(v[c] - v[a]).z();
      }
    }
    return z;
  };
  Glb glb;
  glb.add("square", square);
  EXPECT_NEAR(area(glb), 1, 1e-6);
  json& primitive = glb.json["meshes"][0]["primitives"][0];
  primitive.erase("indices");
  primitive["mode"] = 5;
  EXPECT_NEAR(area(glb), 1, 1e-6) << "strip 0123";

  const mesh::TriangleMesh ring{.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, .triangles = {{0, 1, 2}}};
  Glb fan;
  fan.add("fan", ring);
  fan.json["meshes"][0]["primitives"][0].erase("indices");
  fan.json["meshes"][0]["primitives"][0]["mode"] = 6;
  EXPECT_NEAR(area(fan), 1, 1e-6);
}

TEST(Gltf, PointsAndLinesAreSkippedWithAWarning) {
  Glb glb = one_tetrahedron();
  json line = glb.json["meshes"][0]["primitives"][0];
  line["mode"] = 1;
  glb.json["meshes"][0]["primitives"].push_back(line);
  const GltfScene scene = read(glb.bytes());
  EXPECT_EQ(scene.organs.at(0).mesh.triangles.size(), 4u);
  EXPECT_THAT(scene.warnings, ElementsAre(HasSubstr("points or lines")));
}

TEST(Gltf, SparsePositionsAreApplied) {
  Glb glb = one_tetrahedron();
  const std::size_t at = glb.bin.size();
  const std::uint32_t index = 3;
  const float value[3] = {0, 0, 0.5F};
  glb.bin.append(reinterpret_cast<const char*>(&index), 4);
  glb.bin.append(reinterpret_cast<const char*>(value), 12);
  glb.json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", at}, {"byteLength", 4}});
  glb.json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", at + 4}, {"byteLength", 12}});
  glb.json["accessors"][0]["sparse"] = {
      {"count", 1}, {"indices", {{"bufferView", 2}, {"componentType", 5125}}}, {"values", {{"bufferView", 3}}}};
  EXPECT_NEAR(read(glb.bytes()).organs.at(0).mesh.vertices[3].z(), 0.5, 1e-7);
  glb.json["accessors"][0]["sparse"]["count"] = 5;
  EXPECT_THAT(gltf_error(glb.bytes()), HasSubstr("accessors/0/sparse/count"));
}

TEST(Gltf, MillimetresAreSuspected) {
  Glb glb = one_tetrahedron();
  glb.json["nodes"][0]["scale"] = {100, 100, 100};
  EXPECT_THAT(read(glb.bytes()).warnings, ElementsAre(HasSubstr("millimetres")));
}

/// One defect in a sound file, and what the message must hold.
struct Defect {
  const char* name;
  void (*make)(Glb&);
  const char* message;
};

class GltfDefect : public ::testing::TestWithParam<Defect> {};

TEST_P(GltfDefect, IsRefusedInOneLineWithItsPlace) {
  Glb glb = one_tetrahedron();
  ASSERT_NO_THROW(read(glb.bytes()));
  GetParam().make(glb);
  const std::string error = gltf_error(glb.bytes());
  EXPECT_THAT(error, HasSubstr(GetParam().message));
  EXPECT_THAT(error, ::testing::StartsWith("a.glb"));
  EXPECT_THAT(error, Not(HasSubstr("\n")));
}

void poke(Glb& glb, std::size_t at, float value) {
  std::memcpy(glb.bin.data() + at, &value, 4);
}
void poke(Glb& glb, std::size_t at, std::uint32_t value) {
  std::memcpy(glb.bin.data() + at, &value, 4);
}

constexpr Defect kDefects[] = {
    {"NoVersion", [](Glb& g) { g.json["asset"] = json::object(); }, ":/asset/version: is missing"},
    {"VersionOne", [](Glb& g) { g.json["asset"]["version"] = "1.0"; }, ":/asset/version: is \"1.0\""},
    {"MinVersion", [](Glb& g) { g.json["asset"]["minVersion"] = "3.0"; }, ":/asset/minVersion"},
    {"RequiredExtension", [](Glb& g) { g.json["extensionsRequired"] = {"FOO_bar"}; },
     ":/extensionsRequired: \"FOO_bar\" is not supported"},
    {"Meshopt", [](Glb& g) { g.json["extensionsRequired"] = {"EXT_meshopt_compression"}; },
     "without mesh compression"},
    {"DefaultScene", [](Glb& g) { g.json["scene"] = 9; }, ":/scene: is 9"},
    {"SceneNode", [](Glb& g) { g.json["scenes"][0]["nodes"] = {42}; }, ":/nodes/42"},
    {"EmptyScene", [](Glb& g) { g.json["scenes"][0]["nodes"] = json::array(); }, "no node has triangles"},
    {"SelfLoop", [](Glb& g) { g.json["nodes"][0]["children"] = {0}; }, ":/nodes/0: is reached twice"},
    {"TwoParents",
     [](Glb& g) {
       g.json["nodes"].push_back({{"children", {0}}});
       g.json["nodes"].push_back({{"children", {0}}});
       g.json["scenes"][0]["nodes"] = {1, 2};
     },
     ":/nodes/0: is reached twice"},
    {"DeepChain",
     [](Glb& g) {
       for (int i = 1; i < 20000; ++i) g.json["nodes"].push_back({{"children", {i - 1}}});
       g.json["scenes"][0]["nodes"] = {19999};
     },
     "is nested deeper than 256 nodes"},
    {"NodeMesh", [](Glb& g) { g.json["nodes"][0]["mesh"] = 3; }, ":/nodes/0/mesh: is 3"},
    {"NodeMeshNegative", [](Glb& g) { g.json["nodes"][0]["mesh"] = -7; }, ":/nodes/0/mesh: is -7"},
    {"ScaleZero",
     [](Glb& g) {
       g.json["nodes"][0]["scale"] = {0, 1, 1};
     },
     "its transform scales volumes by 0"},
    {"ScaleHuge",
     [](Glb& g) {
       g.json["nodes"][0]["scale"] = {1e30, 1e30, 1e30};
     },
     ":/nodes/0: its transform"},
    {"MatrixOfEight", [](Glb& g) { g.json["nodes"][0]["matrix"] = {1, 0, 0, 0, 1, 0, 0, 0}; },
     "/matrix: has 8 numbers, expected 16"},
    {"MatrixProjective",
     [](Glb& g) { g.json["nodes"][0]["matrix"] = {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; },
     "is not affine"},
    {"ZeroQuaternion",
     [](Glb& g) {
       g.json["nodes"][0]["rotation"] = {0, 0, 0, 0};
     },
     "/rotation: is a zero"},
    {"FarAway",
     [](Glb& g) {
       g.json["nodes"][0]["translation"] = {0, 500, 0};
     },
     "lies at 500"},
    {"NoPrimitives", [](Glb& g) { g.json["meshes"][0]["primitives"] = json::array(); }, ":/meshes/0/primitives"},
    {"NoPosition",
     [](Glb& g) {
       g.json["meshes"][0]["primitives"][0]["attributes"] = {{"NORMAL", 0}};
     },
     ":/meshes/0/primitives/0/attributes: has no POSITION"},
    {"PositionAccessor", [](Glb& g) { g.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 77; },
     ":/accessors/77"},
    {"ModeSeven", [](Glb& g) { g.json["meshes"][0]["primitives"][0]["mode"] = 7; }, "/mode: is 7"},
    {"OnlyLines", [](Glb& g) { g.json["meshes"][0]["primitives"][0]["mode"] = 1; }, "no node has triangles"},
    {"PositionVec2", [](Glb& g) { g.json["accessors"][0]["type"] = "VEC2"; }, "POSITION is not three floats"},
    {"PositionShort", [](Glb& g) { g.json["accessors"][0]["componentType"] = 5123; }, "POSITION is not three floats"},
    {"IndicesFloat", [](Glb& g) { g.json["accessors"][1]["componentType"] = 5126; }, "indices are not unsigned"},
    {"ElevenIndices", [](Glb& g) { g.json["accessors"][1]["count"] = 11; }, "has 11 indices"},
    {"CountZero", [](Glb& g) { g.json["accessors"][0]["count"] = 0; }, ":/accessors/0"},
    {"CountHuge", [](Glb& g) { g.json["accessors"][0]["count"] = 1000000000; }, ":/accessors/0/count"},
    {"CountOneTooMany", [](Glb& g) { g.json["accessors"][0]["count"] = 5; }, "leave their view"},
    {"CountWraps", [](Glb& g) { g.json["accessors"][0]["count"] = 1537228672809129302LL; }, ":/accessors/0/count"},
    {"NoViewHuge",
     [](Glb& g) {
       g.json["accessors"][0].erase("bufferView");
       g.json["accessors"][0]["count"] = 2000000000;
     },
     ":/accessors/0/count"},
    {"AccessorView", [](Glb& g) { g.json["accessors"][0]["bufferView"] = 99; }, ":/accessors/0/bufferView: is 99"},
    {"AccessorOffset", [](Glb& g) { g.json["accessors"][0]["byteOffset"] = 4; }, "leave their view"},
    {"AccessorOffsetHuge", [](Glb& g) { g.json["accessors"][0]["byteOffset"] = 9223372036854775807LL; },
     ":/accessors/0/byteOffset: is 9223372036854775807, expected"},
    {"AccessorOffsetLarge", [](Glb& g) { g.json["accessors"][0]["byteOffset"] = 9007199254740992LL; },
     "leave their view"},
    {"ViewBuffer", [](Glb& g) { g.json["bufferViews"][0]["buffer"] = 5; }, ":/bufferViews/0/buffer: is 5"},
    {"ViewTooLong", [](Glb& g) { g.json["bufferViews"][0]["byteLength"] = 100000; }, ":/bufferViews/0"},
    {"ViewOffsetPast", [](Glb& g) { g.json["bufferViews"][0]["byteOffset"] = 100000; }, ":/bufferViews/0"},
    {"StrideFour", [](Glb& g) { g.json["bufferViews"][0]["byteStride"] = 4; }, "/byteStride: is 4"},
    {"StrideNegative", [](Glb& g) { g.json["bufferViews"][0]["byteStride"] = -12; },
     ":/bufferViews/0/byteStride: is -12"},
    {"StrideOverruns", [](Glb& g) { g.json["bufferViews"][0]["byteStride"] = 252; }, "leave their view"},
    {"IndexOneTooLarge", [](Glb& g) { poke(g, 48, std::uint32_t{4}); }, "index 0 is 4, the mesh has 4 vertices"},
    {"IndexRestart", [](Glb& g) { poke(g, 48, std::uint32_t{0xFFFFFFFF}); }, "index 0 is 4294967295"},
    {"PositionNaN", [](Glb& g) { poke(g, 0, std::numeric_limits<float>::quiet_NaN()); }, "position 0 is not finite"},
    {"PositionInf", [](Glb& g) { poke(g, 12, -std::numeric_limits<float>::infinity()); }, "position 1 is not finite"},
    {"PositionHuge", [](Glb& g) { poke(g, 12, 3e38F); }, "vertex 1 lies at"},
    {"Material", [](Glb& g) { g.json["meshes"][0]["primitives"][0]["material"] = 2; }, "its material is 2"},
    {"DeepExtras",
     [](Glb& g) {
       json deep = json::array();
       for (int i = 0; i < 400; ++i) deep = json::array({deep});
       g.json["extras"] = deep;
     },
     "nested deeper than 128 levels"},
    {"IndicesAsText", [](Glb& g) { g.json["meshes"][0]["primitives"][0]["indices"] = "1"; },
     ":/meshes/0/primitives/0/indices: is \"1\", expected a whole number"},
    {"ViewThatWraps", [](Glb& g) { g.json["accessors"][0]["bufferView"] = 4294967296.0; },
     ":/accessors/0/bufferView: is 4294967296.0, expected a whole number from 0 to 2147483647"},
    {"OffsetBeyondAll", [](Glb& g) { g.json["bufferViews"][0]["byteOffset"] = 1e19; },
     ":/bufferViews/0/byteOffset: is 1e+19, expected a whole number"},
    {"PositionNegative", [](Glb& g) { g.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = -1; },
     ":/meshes/0/primitives/0/attributes/POSITION: is -1"},
    {"MeshAsText", [](Glb& g) { g.json["nodes"][0]["mesh"] = "0"; }, ":/nodes/0/mesh: is \"0\""},
    {"ChildrenAsText", [](Glb& g) { g.json["nodes"][0]["children"] = "1"; },
     ":/nodes/0/children: is \"1\", expected a list"},
    {"ScaleAsText",
     [](Glb& g) {
       g.json["nodes"][0]["scale"] = {"1", 1, 1};
     },
     ":/nodes/0/scale/0: is \"1\", expected a number"},
    {"NodesAsText", [](Glb& g) { g.json["nodes"] = "none"; }, ":/nodes: is \"none\", expected a list"},
    {"MeshesAsObject", [](Glb& g) { g.json["meshes"] = json::object(); }, ":/meshes: is an object, expected a list"},
    {"SceneAsText", [](Glb& g) { g.json["scene"] = "0"; }, ":/scene: is \"0\""},
    {"PrimitiveAsNumber", [](Glb& g) { g.json["meshes"][0]["primitives"] = {7}; },
     ":/meshes/0/primitives/0: is 7, expected an object"},
    {"ScalesThatUnderflowTogether",
     [](Glb& g) {
       g.json["nodes"][0]["scale"] = {1e-4, 1e-4, 1e-4};
       g.json["nodes"].push_back({{"children", {0}}, {"scale", {1e-4, 1e-4, 1e-4}}});
       g.json["scenes"][0]["nodes"] = {1};
     },
     ":/nodes/0: with its parents its transform scales volumes by 1e-24"},
    {"MeshesWithoutNodes",
     [](Glb& g) {
       g.json.erase("nodes");
       g.json["scenes"][0]["nodes"] = json::array();
     },
     ":/scenes: the file has 1 mesh(es), but no node that places one"},
    {"TraversingUri",
     [](Glb& g) {
       g.json["buffers"] = {{{"byteLength", 4}, {"uri", "../../../../../../etc/passwd"}}};
     },
     "is not in the folder of the glTF file"},
    {"AbsoluteUri",
     [](Glb& g) {
       g.json["buffers"] = {{{"byteLength", 4}, {"uri", "/etc/passwd"}}};
     },
     "is not in the folder of the glTF file"},
    {"EscapedUri",
     [](Glb& g) {
       g.json["buffers"] = {{{"byteLength", 4}, {"uri", "%2e%2e/%2e%2e/%2e%2e/%2e%2e/etc/passwd"}}};
     },
     "is not in the folder of the glTF file"},
    {"FileUri",
     [](Glb& g) {
       g.json["buffers"] = {{{"byteLength", 4}, {"uri", "file:///etc/passwd"}}};
     },
     "a.glb:/buffers/0: file:///etc/passwd is no file"},
    {"EndlessUri", [](Glb& g) { g.json["buffers"] = {{{"byteLength", 4}, {"uri", "/dev/zero"}}}; },
     "is not in the folder of the glTF file"}};

INSTANTIATE_TEST_SUITE_P(Each, GltfDefect, ::testing::ValuesIn(kDefects),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(Gltf, NamesDoNothingToATerminal) {
  Glb glb = one_tetrahedron();
  glb.json["nodes"][0]["name"] = "liver\x1B[2J\nstylet: all is well\u009B31m";
  EXPECT_EQ(read(glb.bytes()).organs[0].name, "liver?[2J?stylet: all is well?31m");
  glb.json["buffers"] = {{{"byteLength", 4}, {"uri", "gone\x1B[2J\u009B.bin"}}};
  EXPECT_THAT(gltf_error(glb.bytes()), ::testing::AllOf(HasSubstr("gone?[2J?.bin"), Not(HasSubstr("\x1B"))));
}

TEST(Gltf, WhatTrianglesDoNotNeedIsNotLookedAt) {
  Glb glb = one_tetrahedron();
  glb.json["images"] = {{{"uri", "gone.png"}}, "no image", {{"bufferView", 99}}};
  glb.json["animations"] = {{{"channels", {{{"sampler", 7}}}}}};
  glb.json["skins"] = {{{"joints", {42}}}};
  glb.json["accessors"].push_back({{"componentType", 1}, {"count", 1}, {"type", "VEC5"}});
  glb.json["buffers"] = {{{"byteLength", glb.bin.size()}}, {{"byteLength", 1000}}};  // as of an optional compression
  EXPECT_EQ(read(glb.bytes()).organs.size(), 1U);
}

TEST(Gltf, MeshesThatNothingPlacesAreTakenWhereTheyLie) {
  Glb glb = one_tetrahedron();
  glb.json["meshes"][0]["name"] = "lonely";
  glb.json.erase("scenes");
  glb.json.erase("scene");
  glb.json["nodes"] = {{{"name", "empty"}}};
  const GltfScene scene = read(glb.bytes());
  ASSERT_EQ(scene.organs.size(), 1U);
  EXPECT_EQ(scene.organs[0].name, "lonely");
}

TEST(Gltf, EveryTruncationOfAFileIsRefused) {
  const std::string bytes = one_tetrahedron().bytes();
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_NE(gltf_error(bytes.substr(0, length)), "no error") << length;
  }
}

TEST(Gltf, ExternalBuffersComeFromTheFolderOfTheFileOnly) {
  support::TemporaryFolder folder;
  Glb glb = one_tetrahedron();
  std::filesystem::create_directory(folder.path() / "organs");
  folder.write("organs/data.bin", glb.bin);
  folder.write("outside.bin", glb.bin);
  std::filesystem::create_symlink(folder.path() / "outside.bin", folder.path() / "organs" / "link.bin");
  const auto with = [&](const std::string& uri) {
    json document = glb.json;
    document["buffers"] = {{{"byteLength", glb.bin.size()}, {"uri", uri}}};
    return folder.write("organs/a.gltf", document.dump());
  };
  EXPECT_EQ(read_gltf(with("data.bin")).organs.size(), 1u);
  EXPECT_THROW(read_gltf(with("../outside.bin")), files::ContentError);
  EXPECT_THROW(read_gltf(with((folder.path() / "outside.bin").string())), files::ContentError);
  EXPECT_THROW(read_gltf(with("link.bin")), files::ContentError) << "a link leads out of the folder";
  EXPECT_THROW(read_gltf(with("gone.bin")), files::ContentError);
}

}  // namespace
}  // namespace stylet::gltf
