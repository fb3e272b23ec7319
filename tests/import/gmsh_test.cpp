// Gmsh as a program: what it makes, and what is said where it cannot.
#include "engine/import/gmsh.h"
#include "engine/files/error.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/mesh/tet_quality.h"
#include "tests/mesh/shapes.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace stylet::import {
namespace {

using mesh::test::ball_volume;
using mesh::test::icosphere;

const std::function<void()> kWait = [] {};

template <typename Call>
std::string refusal_of(Call call) {
  try {
    call();
  } catch (const files::ContentError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "";
}

TEST(Gmsh, BoundaryNodesLieOnTheSurface) {
  if (std::string_view(STYLET_GMSH).empty()) GTEST_SKIP() << "gmsh is not installed";
  const Eigen::Vector3d centre(0.1, -0.2, 0.3);
  const physics::TetMesh mesh =
      gmsh_tetrahedra(icosphere(centre, 0.04, 4), {.cell = 0.01, .program = STYLET_GMSH, .where = "test"}, kWait);
  const mesh::TetQuality quality = mesh::tet_quality(mesh);
  EXPECT_EQ(quality.inverted, 0);
  EXPECT_GT(quality.min_dihedral_deg, 5);
  EXPECT_NEAR(quality.volume / ball_volume(0.04), 1, 0.04);
  const mesh::BoundarySurface boundary = mesh::boundary_surface(mesh);
  EXPECT_TRUE(mesh::inspect(boundary.mesh).closed());
  EXPECT_GT(boundary.mesh.vertices.size(), 100u);
  for (const Eigen::Vector3d& v : boundary.mesh.vertices) {
    EXPECT_NEAR((v - centre).norm(), 0.04, 0.15e-3);  // facets of the sphere are 0.1 mm below it
  }
}

TEST(Gmsh, AProgramThatIsMissingFailsHangsOrLeavesNothingIsSaidSo) {
  const mesh::TriangleMesh ball = icosphere({0, 0, 0}, 0.04, 2);
  const support::TemporaryFolder folder;
  const auto with = [&](const std::string& script, double seconds = 10) {
    const auto program = folder.write("fake", "#!/bin/sh\n" + script + "\n");
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    return refusal_of([&] {
      gmsh_tetrahedra(ball, {.cell = 0.01, .seconds = seconds, .program = program.string(), .where = "a.stl:ball"},
                      kWait);
    });
  };
  const std::string missing = refusal_of(
      [&] { gmsh_tetrahedra(ball, {.cell = 0.01, .program = "no-such-program", .where = "a.stl:ball"}, kWait); });
  EXPECT_NE(missing.find("a.stl:ball: cannot start 'no-such-program'"), std::string::npos) << missing;
  EXPECT_NE(missing.find("install gmsh"), std::string::npos) << missing;
  EXPECT_NE(with("echo 'Error   : it is raining'; exit 1").find("failed: it is raining"), std::string::npos);
  EXPECT_NE(with("exit 0").find("left no mesh"), std::string::npos);
  EXPECT_NE(with("exec sleep 60", 0.1).find("stopped after 0.1 s"), std::string::npos);
  // The caller may have enough of it.
  const auto program = folder.write("fake", "#!/bin/sh\nexec sleep 60\n");
  EXPECT_THROW(gmsh_tetrahedra(ball, {.cell = 0.01, .program = program.string(), .where = "ball"},
                               [] { throw std::runtime_error("enough"); }),
               std::runtime_error);
}

constexpr const char* kTwo =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n6\n1 0 0 0\n2 1 0 0\n3 0 1 0\n7 0 0 1\n8 0 0 -1\n9 5 5 "
    "5\n$EndNodes\n"
    "$Elements\n3\n1 2 2 0 1 1 2 3\n2 4 2 0 1 1 2 3 7\n3 4 2 0 1 1 2 3 8\n$EndElements\n";

TEST(Msh, TetrahedraAreTurnedPositiveAndUnusedNodesDropped) {
  const physics::TetMesh mesh = read_msh(kTwo, "test");
  EXPECT_EQ(mesh.nodes.size(), 5u);
  ASSERT_EQ(mesh.tets.size(), 2u);
  const mesh::TetQuality quality = mesh::tet_quality(mesh);
  EXPECT_EQ(quality.inverted, 0);
  EXPECT_NEAR(quality.volume, 2.0 / 6, 1e-12);
}

TEST(Msh, RefusesWhatIsNone) {
  const std::string good = kTwo;
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return refusal_of([&] { read_msh(text, "x.glb:liver"); });
  };
  for (const auto& [from, to] :
       {std::pair{"2.2 0 8", "4.1 0 8"}, std::pair{"2.2 0 8", "2.2 1 8"}, std::pair{"1 2 3 8\n", "1 2 3 99\n"},
        std::pair{"$Nodes\n6", "$Nodes\n-6"}, std::pair{"$Elements\n3", "$Elements\n4"},
        std::pair{"$Elements\n3", "$Elements\n1"}, std::pair{"$Nodes\n6", "$Nodes\n99999999999"},
        std::pair{"8 0 0 -1", "8 0 0 nan"}, std::pair{"8 0 0 -1", "8 1 1 0"}}) {
    const std::string why = changed(from, to);
    EXPECT_EQ(why.find("x.glb:liver: the mesh that Gmsh left"), 0u) << from << " " << to << " " << why;
  }
  for (std::size_t length = 0; length + 20 < good.size(); length += 7) {
    EXPECT_NE(refusal_of([&] { read_msh(good.substr(0, length), "x"); }), "") << length;
  }
}

}  // namespace
}  // namespace stylet::import
