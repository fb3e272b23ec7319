// The C API against the loops of C++, and against everything that a program can get wrong.
#include "physics/loops/haptic_loop.h"
#include "physics/loops/simulation_loop.h"
#include "tests/c_api/cube.h"
#include "tests/support/allocation_count.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace stylet::c_api {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kHapticSteps = 20;  // to a simulation step

/// In at 40 mm/s with a sway, from one side to the other.
stylet_pose hand(int step) {
  return {{0.047, 0.053 + 0.003 * std::sin(0.01 * step), -0.152 + 4e-5 * step}, {0, 0, 0, 1}};
}

physics::Coupling coupling_of(std::int32_t named) {
  switch (named) {
    case STYLET_COUPLING_PAPER_UPDATED:
      return physics::Coupling::paper_updated;
    case STYLET_COUPLING_PAPER_TRAJECTORY:
      return physics::Coupling::paper_trajectory;
    case STYLET_COUPLING_PAPER_FROZEN:
      return physics::Coupling::paper_frozen;
    default:
      return physics::Coupling::stylet;
  }
}

/// The cube in the loops of C++.
struct Loops {
  explicit Loops(const Cube& cube)
      : haptic(haptic_settings(cube), {.position = {0.047, 0.053, -0.152}}),
        simulation(bodies(cube), {.dt = 0.02, .lay_contacts = cube.settings.coupling != STYLET_COUPLING_STYLET}),
        patch(simulation.make_patch()) {}

  static physics::HapticLoopSettings haptic_settings(const Cube& cube) {
    physics::HapticLoopSettings settings;
    settings.coupling = coupling_of(cube.settings.coupling);
    auto tissues = std::make_shared<physics::TissueMap>();
    tissues->tissues[1] = {.puncture_force = 0.5, .cutting_force = 0.3, .friction_per_length = 10};
    settings.tissues = tissues;
    return settings;
  }
  static std::vector<physics::SimulationBody> bodies(const Cube& cube) {
    std::vector<physics::SimulationBody> all(1);
    all[0].mesh = cube.mesh;
    all[0].fixed_nodes = cube.fixed_nodes;
    for (std::size_t t = 0; t < cube.mesh.tets.size(); ++t) {
      const stylet_material& m = cube.materials[cube.body.tet_materials != nullptr ? t % 2 : 0];
      all[0].tet_materials.push_back({.young_modulus = m.young_modulus, .poisson_ratio = m.poisson_ratio});
    }
    return all;
  }

  physics::HapticLoop haptic;
  physics::SimulationLoop simulation;
  physics::TissuePatch patch;
};

class CApiCoupling : public testing::TestWithParam<std::int32_t> {};

TEST_P(CApiCoupling, GivesTheBitsOfTheLoops) {
  Cube cube;
  cube.settings.coupling = GetParam();
  cube.materials.push_back({20e3, 0.3});
  std::vector<std::int32_t> regions;
  for (std::size_t t = 0; t < cube.mesh.tets.size(); ++t) regions.push_back(t % 2);
  cube.body.materials = cube.materials.data();
  cube.body.material_count = 2;
  cube.body.tet_materials = regions.data();
  const Handle handle = create(cube);
  ASSERT_TRUE(handle) << stylet_last_error();
  Loops loops(cube);

  std::vector<double> tissue(cube.nodes.size());
  std::array<double, 3 * 9> positions{};
  std::array<double, 4 * 9> orientations{};
  std::array<stylet_contact, 96> contacts{};
  std::uint32_t punctures = 0;
  int most_contacts = 0;
  for (int step = 0; step < 700; ++step) {
    if (step % kHapticSteps == 0) {
      const physics::SimulationReport report = loops.simulation.step({.needle = &loops.haptic.state()}, loops.patch);
      ASSERT_EQ(stylet_physics_simulation_step(handle.get()), STYLET_OK);
      auto state = sized<stylet_tissue_state>();
      ASSERT_EQ(stylet_physics_tissue_state(handle.get(), &state), STYLET_OK);
      EXPECT_EQ(state.step, report.step);
      EXPECT_EQ(state.needle_step, report.needle_step);
      EXPECT_EQ(state.residual, report.residual_n);
      EXPECT_EQ(state.needle_force, report.force_n);
      EXPECT_EQ(state.flags, report.flags);
      ASSERT_EQ(state.node_count, cube.body.node_count);
      ASSERT_EQ(stylet_physics_tissue_nodes(handle.get(), tissue.data(), tissue.size() / 3), STYLET_OK);
      const Eigen::Matrix3Xd& nodes = loops.simulation.tissue().positions[0];
      ASSERT_TRUE(std::equal(tissue.begin(), tissue.end(), nodes.data())) << step;
      std::int32_t done = -1;
      ASSERT_EQ(stylet_physics_factorise(handle.get(), &done), STYLET_OK);
      EXPECT_EQ(done == 1, loops.simulation.worker().step());
    }
    const stylet_pose hub = hand(step);
    const physics::NeedleState& needle =
        loops.haptic.step({.position = {hub.position[0], hub.position[1], hub.position[2]}}, 1e-3, loops.patch);
    stylet_wrench wrench;
    ASSERT_EQ(stylet_physics_haptic_step(handle.get(), &hub, &wrench), STYLET_OK);
    auto state = sized<stylet_needle_state>();
    ASSERT_EQ(stylet_physics_needle_state(handle.get(), &state), STYLET_OK);
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_EQ(wrench.force[axis], needle.wrench.force[axis]) << step;
      ASSERT_EQ(wrench.moment[axis], needle.wrench.moment[axis]) << step;
      EXPECT_EQ(state.wrench.force[axis], wrench.force[axis]);
    }
    EXPECT_EQ(state.step, needle.step);
    EXPECT_EQ(state.tissue_step, needle.patch_epoch);
    EXPECT_EQ(state.tip_depth, needle.tip_depth);
    EXPECT_EQ(state.hand_work, needle.hand_work);
    EXPECT_EQ(state.tip, static_cast<int>(needle.tip));
    EXPECT_EQ(state.puncture_count, needle.puncture_count);
    EXPECT_EQ(state.flags, needle.flags);
    ASSERT_EQ(state.node_count, 9);
    ASSERT_EQ(stylet_physics_needle_nodes(handle.get(), positions.data(), orientations.data(), 9), STYLET_OK);
    EXPECT_TRUE(std::equal(positions.begin(), positions.end(), needle.positions.data()));
    EXPECT_EQ(orientations[4 * 8 + 3], needle.orientations[8].w());
    std::size_t count = 0;
    ASSERT_EQ(stylet_physics_contacts(handle.get(), contacts.data(), contacts.size(), &count), STYLET_OK);
    ASSERT_EQ(count, needle.contact_count);
    ASSERT_EQ(state.contact_count, needle.contact_count);
    for (std::size_t c = 0; c < count; ++c) {
      EXPECT_EQ(contacts[c].position[2], needle.contacts[c].position.z());
      EXPECT_EQ(contacts[c].force[1], needle.contacts[c].force.y());
    }
    most_contacts = std::max(most_contacts, state.contact_count);
    punctures = state.puncture_count;
  }
  EXPECT_GE(most_contacts, 2);
  EXPECT_EQ(punctures, GetParam() == STYLET_COUPLING_STYLET ? 1U : 0U);
}

INSTANTIATE_TEST_SUITE_P(All, CApiCoupling,
                         testing::Values(STYLET_COUPLING_STYLET, STYLET_COUPLING_PAPER_UPDATED,
                                         STYLET_COUPLING_PAPER_TRAJECTORY, STYLET_COUPLING_PAPER_FROZEN));

TEST(CApi, HapticCallsTakeNoMemory) {
  const Handle handle = create(Cube());
  ASSERT_TRUE(handle) << stylet_last_error();
  int allocations = 0;
  std::array<double, 3 * 9> positions{};
  std::array<double, 4 * 9> orientations{};
  std::array<stylet_contact, 96> contacts{};
  auto state = sized<stylet_needle_state>();
  for (int step = 0; step < 500; ++step) {
    if (step % kHapticSteps == 0) stylet_physics_simulation_step(handle.get());
    const stylet_pose hub = hand(step);
    stylet_wrench wrench;
    std::size_t count = 0;
    const tests::AllocationCount allocated;
    stylet_physics_haptic_step(handle.get(), &hub, &wrench);
    stylet_physics_needle_state(handle.get(), &state);
    stylet_physics_needle_nodes(handle.get(), positions.data(), orientations.data(), 9);
    stylet_physics_contacts(handle.get(), contacts.data(), contacts.size(), &count);
    allocations += allocated.value();
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_GE(state.contact_count, 1);
}

TEST(CApi, HoldsTheNeedleWhereAPoseIsNotFinite) {
  const Handle handle = create(Cube());
  stylet_pose hub = hand(0);
  hub.orientation[3] = kNaN;
  stylet_wrench wrench{{1, 1, 1}, {1, 1, 1}};
  EXPECT_EQ(stylet_physics_haptic_step(handle.get(), &hub, &wrench), STYLET_OK);
  auto state = sized<stylet_needle_state>();
  stylet_physics_needle_state(handle.get(), &state);
  EXPECT_EQ(state.flags, STYLET_NEEDLE_NON_FINITE);
  EXPECT_EQ(wrench.force[2], 0);
}

/// What is wrong with a cube, and what is said of it.
struct Mistake {
  const char* name;
  std::function<void(Cube&)> make;
  stylet_status status;
  const char* text;
};

class CApiMistake : public testing::TestWithParam<Mistake> {};

TEST_P(CApiMistake, IsRefusedInOneLine) {
  Cube cube;
  GetParam().make(cube);
  stylet_physics* physics = reinterpret_cast<stylet_physics*>(&cube);  // must become null
  EXPECT_EQ(stylet_physics_create(&cube.body, &cube.needle, &cube.settings, &cube.hub, &physics), GetParam().status);
  EXPECT_EQ(physics, nullptr);
  const std::string text = stylet_last_error();
  EXPECT_NE(text.find(GetParam().text), std::string::npos) << text;
  EXPECT_EQ(text.find('\n'), std::string::npos) << text;
}

INSTANTIATE_TEST_SUITE_P(
    All, CApiMistake,
    testing::Values(
        Mistake{"NoNodes", [](Cube& c) { c.body.nodes = nullptr; }, STYLET_ERROR_ARGUMENT, "nodes"},
        Mistake{"NoTets", [](Cube& c) { c.body.tet_count = 0; }, STYLET_ERROR_ARGUMENT, "tets"},
        Mistake{"NegativeCount", [](Cube& c) { c.body.node_count = -1; }, STYLET_ERROR_ARGUMENT, "nodes"},
        Mistake{"NoMaterials", [](Cube& c) { c.body.materials = nullptr; }, STYLET_ERROR_ARGUMENT, "materials"},
        Mistake{"NothingFixed", [](Cube& c) { c.body.fixed_count = 0; }, STYLET_ERROR_ARGUMENT, "fixed"},
        Mistake{"TwoFixedNodes", [](Cube& c) { c.body.fixed_count = 2; }, STYLET_ERROR_MODEL, "three"},
        Mistake{"FixedNodesDescend", [](Cube& c) { std::swap(c.fixed_nodes[0], c.fixed_nodes[1]); },
                STYLET_ERROR_MODEL, "ascend"},
        Mistake{"NodeIsNaN", [](Cube& c) { c.nodes[7] = kNaN; }, STYLET_ERROR_MODEL, "node 2"},
        Mistake{"TetNamesNoNode", [](Cube& c) { c.tets[5] = 1000; }, STYLET_ERROR_MODEL, "tetrahedron 1"},
        Mistake{"TetNamesNegativeNode", [](Cube& c) { c.tets[4] = -1; }, STYLET_ERROR_MODEL, "tetrahedron 1"},
        Mistake{"TetIsInverted", [](Cube& c) { std::swap(c.tets[8], c.tets[9]); }, STYLET_ERROR_MODEL,
                "tetrahedron 2 is not positively oriented"},
        Mistake{"MaterialIsNaN", [](Cube& c) { c.materials[0].young_modulus = kNaN; }, STYLET_ERROR_MODEL, "E > 0"},
        Mistake{"Incompressible", [](Cube& c) { c.materials[0].poisson_ratio = 0.5; }, STYLET_ERROR_MODEL,
                "nu < 0.5"},
        Mistake{"MaterialDoesNotExist", [](Cube& c) { c.body.tet_materials = c.tets.data(); }, STYLET_ERROR_MODEL,
                "names material"},
        Mistake{"NegativeResistance", [](Cube& c) { c.body.cutting_force = -1; }, STYLET_ERROR_ARGUMENT, "resists"},
        Mistake{"NeedleWithoutBeams", [](Cube& c) { c.needle.beams = 0; }, STYLET_ERROR_MODEL, "beams"},
        Mistake{"NeedleTooLong", [](Cube& c) { c.needle.length = HUGE_VAL; }, STYLET_ERROR_MODEL, "length"},
        Mistake{"TipIsAPoint", [](Cube& c) { c.needle.tip_radius = 0; }, STYLET_ERROR_ARGUMENT, "tip_radius"},
        Mistake{"SpringWithoutRotation", [](Cube& c) { c.needle.base_stiffness = 100; }, STYLET_ERROR_MODEL,
                "rotational"},
        Mistake{"NoRate", [](Cube& c) { c.settings.haptic_hz = 0; }, STYLET_ERROR_ARGUMENT, "rates"},
        Mistake{"SpacingIsNaN", [](Cube& c) { c.settings.contact_spacing = kNaN; }, STYLET_ERROR_ARGUMENT,
                "contact_spacing"},
        Mistake{"UnknownCoupling", [](Cube& c) { c.settings.coupling = 4; }, STYLET_ERROR_ARGUMENT, "coupling 4"},
        Mistake{"HubIsNaN", [](Cube& c) { c.hub.position[0] = kNaN; }, STYLET_ERROR_ARGUMENT, "hub"},
        Mistake{"HubIsNotTurned", [](Cube& c) { c.hub.orientation[3] = 0; }, STYLET_ERROR_ARGUMENT, "hub"},
        Mistake{"BodyWithoutSize", [](Cube& c) { c.body.struct_size = 0; }, STYLET_ERROR_VERSION, "body_init"},
        Mistake{"NeedleOfALaterLibrary", [](Cube& c) { c.needle.struct_size = sizeof(stylet_needle) + 8; },
                STYLET_ERROR_VERSION, "needle"},
        Mistake{"SettingsCutOff", [](Cube& c) { c.settings.struct_size = sizeof(stylet_settings) - 8; },
                STYLET_ERROR_VERSION, "settings"}),
    [](const auto& mistake) { return mistake.param.name; });

TEST(CApi, RefusesNullAndArraysThatAreTooSmall) {
  const Cube cube;
  stylet_physics* physics = nullptr;
  EXPECT_EQ(stylet_physics_create(nullptr, &cube.needle, &cube.settings, &cube.hub, &physics), STYLET_ERROR_ARGUMENT);
  EXPECT_EQ(stylet_physics_create(&cube.body, nullptr, &cube.settings, &cube.hub, &physics), STYLET_ERROR_ARGUMENT);
  EXPECT_EQ(stylet_physics_create(&cube.body, &cube.needle, nullptr, &cube.hub, &physics), STYLET_ERROR_ARGUMENT);
  EXPECT_EQ(stylet_physics_create(&cube.body, &cube.needle, &cube.settings, nullptr, &physics),
            STYLET_ERROR_ARGUMENT);
  EXPECT_EQ(stylet_physics_create(&cube.body, &cube.needle, &cube.settings, &cube.hub, nullptr),
            STYLET_ERROR_ARGUMENT);
  EXPECT_EQ(stylet_needle_init(nullptr, sizeof(stylet_needle)), STYLET_ERROR_ARGUMENT);
  stylet_physics_destroy(nullptr);

  const Handle handle = create(cube);
  std::vector<double> values(1000);
  std::array<stylet_contact, 96> contacts{};
  std::size_t count = 0;
  auto needle = sized<stylet_needle_state>();
  auto tissue = sized<stylet_tissue_state>();
  const auto refused = [&](stylet_physics* p, const stylet_pose* hub, double* array,
                           stylet_needle_state* needle_state, stylet_tissue_state* tissue_state) {
    EXPECT_EQ(stylet_physics_haptic_step(p, hub, nullptr), STYLET_ERROR_ARGUMENT);
    EXPECT_EQ(stylet_physics_tissue_nodes(p, array, 333), STYLET_ERROR_ARGUMENT);
    EXPECT_EQ(stylet_physics_needle_state(p, needle_state), STYLET_ERROR_ARGUMENT);
    EXPECT_EQ(stylet_physics_tissue_state(p, tissue_state), STYLET_ERROR_ARGUMENT);
  };
  refused(nullptr, &cube.hub, values.data(), &needle, &tissue);
  refused(handle.get(), nullptr, nullptr, nullptr, nullptr);
  EXPECT_EQ(stylet_physics_simulation_step(nullptr), STYLET_ERROR_ARGUMENT);
  EXPECT_EQ(stylet_physics_factorise(nullptr, nullptr), STYLET_ERROR_ARGUMENT);
  EXPECT_EQ(stylet_physics_contacts(nullptr, contacts.data(), 96, &count), STYLET_ERROR_ARGUMENT);
  EXPECT_EQ(stylet_physics_contacts(handle.get(), contacts.data(), 96, nullptr), STYLET_ERROR_ARGUMENT);
  EXPECT_EQ(stylet_physics_needle_nodes(nullptr, values.data(), nullptr, 9), STYLET_ERROR_ARGUMENT);
  EXPECT_EQ(stylet_physics_needle_nodes(handle.get(), values.data(), nullptr, 8), STYLET_ERROR_ARGUMENT);
  EXPECT_STREQ(stylet_last_error(), "capacity is less than the needle's node_count");
  EXPECT_EQ(stylet_physics_tissue_nodes(handle.get(), values.data(), 124), STYLET_ERROR_ARGUMENT);
  EXPECT_EQ(stylet_physics_tissue_nodes(handle.get(), values.data(), 125), STYLET_OK);
}

TEST(CApi, FillsNoMoreThanTheCallersStructureHolds) {
  EXPECT_EQ(stylet_physics_version(), STYLET_PHYSICS_VERSION);
  // What comes behind the struct of a program stays as it is.
  struct {
    stylet_needle needle;
    double behind = 7;
  } mine;
  EXPECT_EQ(stylet_needle_init(&mine.needle, sizeof mine.needle), STYLET_OK);
  EXPECT_EQ(mine.needle.struct_size, sizeof(stylet_needle));
  EXPECT_EQ(mine.needle.beams, 8);
  EXPECT_EQ(mine.behind, 7);
  EXPECT_EQ(stylet_needle_init(&mine.needle, sizeof mine), STYLET_ERROR_VERSION);
  EXPECT_EQ(stylet_needle_init(&mine.needle, 8), STYLET_ERROR_VERSION);
  const Handle handle = create(Cube());
  stylet_needle_state state{};
  EXPECT_EQ(stylet_physics_needle_state(handle.get(), &state), STYLET_ERROR_VERSION);
}

// A program of version 1 must find what it knows where it was.
TEST(CApi, KeepsTheLayoutOfVersion1) {
  EXPECT_EQ(offsetof(stylet_body, viscous_friction), 112U);
  EXPECT_EQ(offsetof(stylet_needle, beams), 80U);
  EXPECT_EQ(offsetof(stylet_settings, coupling), 32U);
  EXPECT_EQ(offsetof(stylet_needle_state, flags), 104U);
  EXPECT_EQ(offsetof(stylet_tissue_state, node_count), 44U);
  EXPECT_EQ(sizeof(stylet_pose), 56U);
  EXPECT_EQ(sizeof(stylet_wrench), 48U);
  EXPECT_EQ(sizeof(stylet_contact), 48U);
  EXPECT_EQ(sizeof(stylet_material), 16U);
}

}  // namespace
}  // namespace stylet::c_api
