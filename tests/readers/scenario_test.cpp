#include "engine/readers/scenario.h"

#include "tests/readers/small_scenario.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include <cstdlib>
#include <functional>
#include <numeric>

namespace stylet::readers {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

using json = nlohmann::json;
using test::SmallScenario;

TEST(Scenario, LoadsWhatItsFilesSay) {
  const SmallScenario small;
  double last = -1;
  const content::Scene scene = load_scene(small.write(), [&](const std::string& doing, double share) {
    EXPECT_FALSE(doing.empty());
    EXPECT_GT(share, last);
    last = share;
  });
  EXPECT_EQ(last, 1);
  EXPECT_EQ(scene.name, "small");
  ASSERT_THAT(scene.tissues, SizeIs(4));
  EXPECT_EQ(scene.tissues[0].name, "outside");
  ASSERT_THAT(scene.bodies, SizeIs(1));
  const content::DeformableBody& liver = scene.bodies[0];
  EXPECT_EQ(liver.tet_tissue.size(), liver.mesh.tets.size());
  EXPECT_GE(liver.fixed_nodes.size(), 3u);
  EXPECT_LT(liver.fixed_nodes.size(), liver.mesh.nodes.size() / 2);
  EXPECT_TRUE(std::is_sorted(liver.fixed_nodes.begin(), liver.fixed_nodes.end()));
  for (const int node : liver.fixed_nodes) {
    // 5 mm around the bone ball of 20 mm below the liver.
    EXPECT_LT((liver.mesh.nodes[node] - Eigen::Vector3d(0.1, 0, -0.06)).norm(), 0.0255);
  }
  ASSERT_THAT(scene.surfaces, SizeIs(3));
  for (const content::Surface& surface : scene.surfaces) {
    EXPECT_EQ(surface.normals.size(), surface.positions.size());
    EXPECT_EQ(surface.embedding.size(), surface.body >= 0 ? surface.positions.size() : 0u);
    EXPECT_EQ(surface.body, surface.name == "bone_ball" ? -1 : 0);
    for (const std::uint32_t index : surface.indices) ASSERT_LT(index, surface.positions.size());
  }
  ASSERT_THAT(scene.targets, SizeIs(1));
  EXPECT_LT((scene.targets[0].centre - Eigen::Vector3d(0.11, 0, 0)).norm(), 1e-5);
  EXPECT_NEAR(scene.targets[0].radius, 0.01, 2e-4) << "a faceted ball is a little smaller than its sphere";
  EXPECT_NEAR(scene.needle.length, 0.15, 1e-12);
  EXPECT_LT((scene.probe.pose.orientation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d(0, 0, -1)).norm(), 1e-12);
  EXPECT_LT((scene.probe.pose.orientation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitX()).norm(), 1e-12);
  // Supine: anterior is up in the room.
  EXPECT_LT((scene.room_from_patient * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitY()).norm(), 1e-12);
}

TEST(Scenario, SaysWhetherThereIsGelAndWhenTheBreathIsHeld) {
  SmallScenario small;
  EXPECT_TRUE(load_scene(small.write()).probe.gel) << "unless said otherwise";
  small.scenario["probe"]["gel"] = false;
  small.scenario["breathing"] = {{"amplitude", 0.5}, {"holds", json::parse("[[2, 6.5], [6.5, 8]]")}};
  const content::Scene scene = load_scene(small.write());
  EXPECT_FALSE(scene.probe.gel);
  ASSERT_THAT(scene.breathing.holds, SizeIs(2));
  EXPECT_THAT(scene.breathing.holds[0], ElementsAre(2, 6.5));
  EXPECT_THAT(scene.breathing.holds[1], ElementsAre(6.5, 8));
}

TEST(Scenario, ProbeFileSetsWhatTheScannersKnobsStartWith) {
  SmallScenario small;
  content::Probe probe = load_scene(small.write()).probe;
  EXPECT_EQ(probe.lowest_frequency_hz, probe.frequency_hz) << "no band: the knob has one place";
  EXPECT_EQ(probe.highest_frequency_hz, probe.frequency_hz);
  EXPECT_FALSE(probe.persistence.has_value());
  EXPECT_EQ(probe.preset, "clinical");
  small.probe["frequency_range_mhz"] = {2, 6};
  small.probe["focus_mm"] = 40;
  small.probe["tgc_db"] = json::parse("[-3, 0, 0, 0, 0, 0, 0, 9]");
  small.probe["persistence"] = 0.5;
  small.probe["preset"] = "raw";
  probe = load_scene(small.write()).probe;
  EXPECT_EQ(probe.lowest_frequency_hz, 2e6);
  EXPECT_EQ(probe.highest_frequency_hz, 6e6);
  EXPECT_NEAR(probe.focus, 0.04, 1e-12);
  EXPECT_EQ(probe.tgc_db.front(), -3);
  EXPECT_EQ(probe.tgc_db.back(), 9);
  EXPECT_EQ(probe.persistence, 0.5);
  EXPECT_EQ(probe.preset, "raw");
}

TEST(Scenario, WeightPullsToTheBackOfASupinePatientWhereItIsAskedFor) {
  SmallScenario small;
  EXPECT_EQ(load_scene(small.write()).gravity, Eigen::Vector3d::Zero().eval());
  small.scenario["gravity_m_per_s2"] = 9.81;
  EXPECT_LT((load_scene(small.write()).gravity - Eigen::Vector3d(0, 0, -9.81)).norm(), 1e-12);
}

TEST(Scenario, LetsARigidOrganGoWithTheBreath) {
  SmallScenario small;
  small.scenario["breathing"]["rigid"] = json::parse(R"({"organs": ["bone"], "breathing_mm": [0, -12, 0]})");
  const content::Scene scene = load_scene(small.write());
  EXPECT_LT((scene.breathing.rigid_motion - Eigen::Vector3d(0, -0.012, 0)).norm(), 1e-12);
  for (const content::Surface& surface : scene.surfaces) EXPECT_EQ(surface.breathes, surface.name == "bone_ball");
  int bone = 0;
  for (std::size_t v = 0; v < scene.labels.labels.size(); ++v) {
    const bool is_bone = scene.tissues[scene.labels.labels[v]].name == "bone";
    EXPECT_EQ(scene.labels.bodies[v] == content::kBreathes, is_bone);
    bone += is_bone ? 1 : 0;
  }
  EXPECT_GT(bone, 100);
}

TEST(Scenario, SaysWhatIsScoredAndWhatIsForbidden) {
  SmallScenario small;
  EXPECT_TRUE(load_scene(small.write()).scoring.empty());
  small.scenario["forbidden"] = {"tumour", "bone"};
  small.scenario["pass_mark"] = 65;
  small.scenario["scoring"] = json::parse(R"([
    {"metric": "targeting", "full": 2, "zero": 12, "weight": 3, "source": "a paper"},
    {"metric": "forbidden_hits", "full": 0, "zero": 1, "weight": 0, "critical": true}])");
  const content::Scene scene = load_scene(small.write());
  EXPECT_EQ(scene.pass_mark, 65);
  ASSERT_THAT(scene.scoring, SizeIs(2));
  EXPECT_EQ(scene.scoring[0].metric, "targeting");
  EXPECT_EQ(scene.scoring[0].full, 2);
  EXPECT_EQ(scene.scoring[0].zero, 12);
  EXPECT_EQ(scene.scoring[0].weight, 3);
  EXPECT_FALSE(scene.scoring[0].critical);
  EXPECT_TRUE(scene.scoring[1].critical);
  ASSERT_THAT(scene.forbidden, SizeIs(2));
  const double ball = 4.0 / 3 * std::acos(-1) * std::pow(0.01, 3) / std::pow(scene.labels.spacing, 3);
  EXPECT_EQ(scene.forbidden[0].name, "tumour");
  EXPECT_EQ(scene.forbidden[0].body, 0) << "the liver carries it";
  EXPECT_EQ(scene.forbidden[0].tissue, scene.surfaces[2].tissue);
  EXPECT_NEAR(static_cast<double>(std::ranges::count(scene.forbidden[0].inside.labels, 1)), ball, 0.1 * ball);
  EXPECT_EQ(scene.forbidden[1].body, -1);
  EXPECT_EQ(scene.forbidden[1].inside.spacing, scene.labels.spacing);
}

TEST(Scenario, LoadsTheSameBitsTwice) {
  const SmallScenario small;
  const content::Scene a = load_scene(small.write());
  const content::Scene b = load_scene(small.path());
  ASSERT_EQ(a.bodies[0].mesh.nodes.size(), b.bodies[0].mesh.nodes.size());
  for (std::size_t i = 0; i < a.bodies[0].mesh.nodes.size(); ++i) {
    ASSERT_EQ(a.bodies[0].mesh.nodes[i], b.bodies[0].mesh.nodes[i]);
  }
  EXPECT_EQ(a.bodies[0].mesh.tets, b.bodies[0].mesh.tets);
  EXPECT_EQ(a.bodies[0].tet_tissue, b.bodies[0].tet_tissue);
  EXPECT_EQ(a.labels.labels, b.labels.labels);
  EXPECT_EQ(a.labels.bodies, b.labels.bodies);
}

TEST(Scenario, LaterOrganWinsInLabelsAndTetrahedra) {
  SmallScenario small;
  small.organs = {};
  const Eigen::Vector3d centre(0.1, 0, 0);
  // A tumour as large as the liver: every tetrahedron is tumour, whichever is smaller.
  small.organs.add("liver_ball", gltf::test::sphere(centre, 0.05),
                   {{"id", "liver"}, {"role", "boundary"}, {"body", "liver"}}, {{"preset", "liver"}});
  small.organs.add("bone_ball", gltf::test::sphere(centre - Eigen::Vector3d(0, 0, 0.06), 0.02), {{"id", "bone"}},
                   {{"preset", "bone"}});
  small.organs.add("tumour_ball", gltf::test::sphere(centre, 0.06),
                   {{"id", "tumour"}, {"role", "target"}, {"body", "liver"}}, {{"preset", "tumour"}});
  const content::Scene scene = load_scene(small.write());
  const int tumour = 3;
  ASSERT_EQ(scene.tissues[tumour].name, "tumour");
  for (const int tissue : scene.bodies[0].tet_tissue) ASSERT_EQ(tissue, tumour);
  EXPECT_THAT(scene.labels.labels, Not(::testing::Contains(2))) << "no liver left";
}

TEST(Scenario, MaterialOverridesMakeATissueOfTheirOwn) {
  SmallScenario small;
  small.organs.json["materials"][0]["extras"]["tissue"]["mechanics"] = {{"youngsModulus", 9000}};
  const content::Scene scene = load_scene(small.write());
  ASSERT_THAT(scene.tissues, SizeIs(5));
  EXPECT_EQ(scene.tissues[4].name, "liver_ball");
  EXPECT_EQ(scene.tissues[4].mechanics.young_modulus, 9000);
  EXPECT_EQ(scene.tissues[4].mechanics.poisson_ratio, 0.45) << "the preset fills the gaps";
  EXPECT_EQ(scene.surfaces[0].tissue, 4);
}

TEST(Scenario, FilesWithoutAnnotationsAreAnnotatedInTheScenario) {
  SmallScenario small;
  small.organs.json["nodes"][0].erase("extras");
  small.organs.json["materials"][0].erase("extras");
  EXPECT_THAT(validate(small.write()), ElementsAre(HasSubstr("liver_ball has no extras.organ.id")));
  small.scenario["organs"][0]["nodes"] = {
      {"liver_ball", {{"id", "liver"}, {"role", "boundary"}, {"tissue", "liver"}}}};
  EXPECT_THAT(validate(small.write()), IsEmpty());
}

TEST(Scenario, PatchesOfOneOrganAreJoined) {
  SmallScenario small;
  // The liver's sphere in two open halves.
  mesh::TriangleMesh ball = gltf::test::sphere({0.1, 0, 0}, 0.05);
  mesh::TriangleMesh upper{ball.vertices, {}};
  mesh::TriangleMesh lower{ball.vertices, {}};
  for (std::size_t i = 0; i < ball.triangles.size(); ++i) {
    (i < ball.triangles.size() / 2 ? upper : lower).triangles.push_back(ball.triangles[i]);
  }
  small.organs.json["nodes"][0]["extras"]["organ"]["role"] = "ignore";
  const json organ = {{"id", "liver"}, {"role", "boundary"}, {"body", "liver"}};
  small.organs.add("upper", upper, organ, {{"preset", "liver"}});
  EXPECT_THAT(validate(small.write()), ElementsAre(HasSubstr("liver is not closed: ")));
  small.organs.add("lower", lower, organ, {{"preset", "liver"}});
  EXPECT_THAT(validate(small.write()), IsEmpty());
}

/// A defect of the files, and the line it must give (the folder left out).
struct BadScenario {
  const char* name;
  void (*make)(SmallScenario&);
  const char* line;
};

class ScenarioDefect : public ::testing::TestWithParam<BadScenario> {};

TEST_P(ScenarioDefect, IsOneLineAndNothingIsLoaded) {
  SmallScenario small;
  GetParam().make(small);
  small.write();
  const std::vector<std::string> problems = validate(small.path());
  ASSERT_THAT(problems, SizeIs(1)) << ::testing::PrintToString(problems);
  EXPECT_THAT(problems[0], HasSubstr(GetParam().line));
  EXPECT_THAT(problems[0], Not(HasSubstr("\n")));
  try {
    load_scene(small.path());
    FAIL() << "it was loaded";
  } catch (const files::ContentError& error) {
    EXPECT_EQ(error.what(), problems[0]) << "loading and validating agree";
  }
}

constexpr const char* kNoMetric = R"([{"metric": "targetting", "full": 1, "zero": 2}])";
constexpr const char* kTwice =
    R"([{"metric": "targeting", "full": 1, "zero": 2}, {"metric": "targeting", "full": 0, "zero": 1}])";
constexpr const char* kStep = R"([{"metric": "targeting", "full": 2, "zero": 2}])";
constexpr const char* kNothing = R"([{"metric": "targeting", "full": 1, "zero": 2, "weight": 0}])";
constexpr const char* kNoZero = R"([{"metric": "targeting", "full": 1}])";

constexpr BadScenario kBadScenarios[] = {
    {"MissingOrgans", [](auto& s) { s.scenario["organs"][0]["file"] = "gone.glb"; },
     "scenario.json:/organs/0/file: there is no file gone.glb; correct the path"},
    {"UnknownKey", [](auto& s) { s.scenario["traget"] = 1; },
     "scenario.json:/traget: is not a known key; did you mean \"targets\"?"},
    {"UnknownNestedKey", [](auto& s) { s.scenario["bodies"][0]["mesh"]["cell"] = 1; },
     "scenario.json:/bodies/0/mesh/cell: is not a known key; did you mean \"cell_mm\"?"},
    {"MissingKey", [](auto& s) { s.scenario.erase("camera"); }, "scenario.json:/camera: is missing; add it"},
    {"WrongType", [](auto& s) { s.scenario["targets"] = "tumour"; },
     "scenario.json:/targets: is a text, expected an array"},
    {"OutOfRange", [](auto& s) { s.scenario["bodies"][0]["mesh"]["cell_mm"] = 0.001; },
     "scenario.json:/bodies/0/mesh/cell_mm: is 0.001, accepted is 1 to 100"},
    {"TwoCellSizes", [](auto& s) { s.scenario["bodies"][0]["mesh"]["target_nodes"] = 500; },
     "scenario.json:/bodies/0/mesh: needs either cell_mm or target_nodes"},
    {"UnknownBoundary", [](auto& s) { s.scenario["bodies"][0]["boundary"] = "spleen"; },
     "scenario.json:/bodies/0/boundary: there is no organ \"spleen\""},
    {"NothingFixed", [](auto& s) { s.scenario["bodies"][0]["fixed"] = json::array(); },
     "scenario.json:/bodies/0/fixed: holds 0 nodes of liver, at least 3"},
    {"EverythingFixed",
     [](auto& s) {
       s.scenario["bodies"][0]["fixed"][0] = json::parse(R"({"box": {"min": [-1, -1, -1], "max": [1, 1, 1]}})");
     },
     "nodes of liver, so that nothing of it moves; narrow the regions"},
    {"FixedNearNobody", [](auto& s) { s.scenario["bodies"][0]["fixed"][0]["near"].push_back("spine"); },
     "scenario.json:/bodies/0/fixed/0/near: there is no organ \"spine\""},
    {"TargetOfNothing", [](auto& s) { s.scenario["targets"][0]["organ"] = "cyst"; },
     "scenario.json:/targets/0/organ: there is no organ \"cyst\""},
    {"ForbidsNothing",
     [](auto& s) {
       s.scenario["forbidden"] = {"tumour", "cyst"};
     },
     "scenario.json:/forbidden/1: there is no organ \"cyst\""},
    {"ForbidsWhatHasNoInside",
     [](auto& s) {
       s.scenario["forbidden"] = {"bone"};
       s.scenario["organs"][0]["nodes"]["bone_ball"] = {{"id", "bone"}, {"role", "visual"}};
       s.scenario["bodies"][0]["fixed"] = json::parse(R"([{"plane": {"point": [0.1, 0, -0.03]}}])");
     },
     "scenario.json:/forbidden/0: \"bone\" is visual"},
    {"ScoresNoMetric", [](auto& s) { s.scenario["scoring"] = json::parse(kNoMetric); },
     "scenario.json:/scoring/0/metric: \"targetting\" is no metric; did you mean \"targeting\"?"},
    {"ScoresNothing",
     [](auto& s) { s.scenario["scoring"] = json::parse(R"([{"metric": "", "full": 1, "zero": 2}])"); },
     "scenario.json:/scoring/0/metric: \"\" is no metric; content/README.md lists them"},
    {"ScoresTwice", [](auto& s) { s.scenario["scoring"] = json::parse(kTwice); },
     "scenario.json:/scoring/1/metric: \"targeting\" is scored by an earlier entry"},
    {"ScoresAStep", [](auto& s) { s.scenario["scoring"] = json::parse(kStep); },
     "scenario.json:/scoring/0/zero: is the same as full"},
    {"ScoresForNothing", [](auto& s) { s.scenario["scoring"] = json::parse(kNothing); },
     "scenario.json:/scoring: has no weight above 0"},
    {"ScoreWithoutThreshold", [](auto& s) { s.scenario["scoring"] = json::parse(kNoZero); },
     "scenario.json:/scoring/0/zero: is missing; add it"},
    {"PassMarkBeyondTheTotal", [](auto& s) { s.scenario["pass_mark"] = 101; },
     "scenario.json:/pass_mark: is 101, accepted is 0 to 100"},
    {"CarriesNothing", [](auto& s) { s.scenario["bodies"][0]["carries"] = {"cyst"}; },
     "scenario.json:/bodies/0/carries/0: there is no organ \"cyst\""},
    {"CameraAtItsTarget",
     [](auto& s) {
       s.scenario["camera"]["eye"] = {0.1, 0, 0};
     },
     "scenario.json:/camera/look_at: is where eye is"},
    {"ProbeWithoutFrame",
     [](auto& s) {
       s.scenario["probe"]["lateral"] = {0, 0, 2};
     },
     "scenario.json:/probe/lateral: is parallel to axis"},
    {"RatesWithoutRatio",
     [](auto& s) {
       s.scenario["rates"] = {{"haptic_hz", 1000}, {"simulation_hz", 333}};
     },
     "scenario.json:/rates: haptic_hz is not a whole multiple"},
    {"HoldsThatOverlap", [](auto& s) { s.scenario["breathing"]["holds"] = json::parse("[[1, 4], [3, 5]]"); },
     "scenario.json:/breathing/holds: entry 1 is not [from_s, to_s] between the hold before it and 86400; "
     "correct it"},
    {"NobodyBreathes",
     [](auto& s) {
       s.scenario["breathing"]["rigid"] = json::parse(R"({"organs": ["bone", "lung"], "breathing_mm": [0, 1, 0]})");
     },
     "scenario.json:/breathing/rigid/organs/1: there is no organ \"lung\"; correct its id"},
    {"BodyThatBreathesTwice",
     [](auto& s) {
       s.scenario["breathing"]["rigid"] = json::parse(R"({"organs": ["tumour"], "breathing_mm": [0, 1, 0]})");
     },
     "scenario.json:/breathing/rigid/organs/0: tumour moves with the body liver; take it out"},
    {"HoldWithoutEnd", [](auto& s) { s.scenario["breathing"]["holds"] = json::parse(R"([[1, "end"]])"); },
     "scenario.json:/breathing/holds: entry 0 is not [from_s, to_s] between the hold before it and 86400; "
     "correct it"},
    {"GelOfText", [](auto& s) { s.scenario["probe"]["gel"] = "dry"; },
     "scenario.json:/probe/gel: is a text, expected true or false"},
    {"UnknownCoupling", [](auto& s) { s.scenario["coupling"] = "magic"; },
     "scenario.json:/coupling: is \"magic\", accepted is one of: stylet, paper-updated, paper-trajectory, "
     "paper-frozen"},
    {"FillerWithoutWall", [](auto& s) { s.scenario["labels"]["filler"] = "liver"; },
     "scenario.json:/labels: has only one of filler and behind"},
    {"NodeThatIsNotThere",
     [](auto& s) {
       s.scenario["organs"][0]["nodes"] = {{"liver_bal", {{"role", "ignore"}}}};
     },
     "scenario.json:/organs/0/nodes: organs.glb has no node \"liver_bal\"; did you mean \"liver_ball\"?"},
    {"TissueOutOfRange", [](auto& s) { s.tissues["tissues"]["liver"]["mechanics"]["poisson_ratio"] = 0.5; },
     "tissues.json:/tissues/liver/mechanics/poisson_ratio: is 0.5, accepted is 0 to 0.499"},
    {"TissueMissingNumber", [](auto& s) { s.tissues["tissues"]["bone"]["acoustics"].erase("impedance_rayl"); },
     "tissues.json:/tissues/bone/acoustics/impedance_rayl: is missing"},
    {"SurfaceOfUnknownTissue",
     [](auto& s) {
       s.tissues["surfaces"] = {{{"between", {"liver", "livre"}}, {"puncture_force_n", 1}}};
     },
     "tissues.json:/surfaces/0/between: names the tissue \"livre\""},
    {"SurfaceOfOneTissue",
     [](auto& s) {
       s.tissues["surfaces"] = {{{"between", {"liver", "liver"}}, {"puncture_force_n", 1}}};
     },
     "tissues.json:/surfaces/0/between: is not two different tissues"},
    {"NoOutside", [](auto& s) { s.tissues["tissues"].erase("outside"); },
     "tissues.json:/tissues/outside: is missing"},
    {"UnknownPreset", [](auto& s) { s.organs.json["materials"][0]["extras"]["tissue"]["preset"] = "liwer"; },
     "organs.glb:/nodes/0: liver_ball names the tissue \"liwer\", which the tissue table does not have; did "
     "you mean \"liver\"?"},
    {"UnknownTissueGroup",
     [](auto& s) {
       s.organs.json["materials"][0]["extras"]["tissue"]["mechanical"] = {{"density", 9}};
     },
     "organs.glb:/materials/0/extras/tissue/mechanical: is not a known key; did you mean "
     "\"mechanics\"?"},
    {"UnknownTissueNumber",
     [](auto& s) {
       s.organs.json["materials"][0]["extras"]["tissue"]["needle"] = {{"zork", 9}};
     },
     "organs.glb:/materials/0/extras/tissue/needle/zork: is not a known key; remove it (known: "},
    {"UnknownOrganKey", [](auto& s) { s.organs.json["nodes"][0]["extras"]["organ"]["rolle"] = "vessel"; },
     "organs.glb:/nodes/0/extras/organ/rolle: is not a known key; did you mean \"role\"?"},
    {"ThickNeedle", [](auto& s) { s.needle["inner_diameter_mm"] = 2; },
     "needle.json:/inner_diameter_mm: is 2, not smaller than outer_diameter_mm (1.27)"},
    {"ConvexWidth", [](auto& s) { s.probe["width_mm"] = 50; },
     "probe.json:/width_mm: is for linear probes; remove it"},
    {"BandWithoutItsFrequency",
     [](auto& s) {
       s.probe["frequency_range_mhz"] = {4, 5};
     },
     "probe.json:/frequency_range_mhz: is 4 to 5, without frequency_mhz (3.5); widen it"},
    {"SevenSliders", [](auto& s) { s.probe["tgc_db"] = {0, 0, 0, 0, 0, 0, 1}; },
     "probe.json:/tgc_db: is an array of 7, expected an array of 8 numbers"},
    {"MotionBackInTime", [](auto& s) { s.motion["tracks"]["stylus"][1][0] = 0; },
     "motion.json:/tracks/stylus/1: time 0 s does not come after 0 s"},
    {"OrganBroken", [](auto& s) { s.organs.json["accessors"][0]["count"] = 100000; },
     "organs.glb:/accessors/0: 100000 elements"},
    {"OpenLiver",
     [](auto& s) {
       s.organs.json["accessors"][1]["count"] = s.organs.json["accessors"][1]["count"].template get<int>() - 30;
     },
     "organs.glb:/nodes/0: liver is not closed: "},
    {"CellTooLarge",
     [](auto& s) {
       s.scenario["bodies"][0]["mesh"]["cell_mm"] = 100;
       s.organs = {};
       s.organs.add("liver_ball", gltf::test::sphere({0.1, 0, 0}, 0.002), {{"id", "liver"}}, {{"preset", "liver"}});
       s.organs.add("bone_ball", gltf::test::sphere({0.1, 0, -0.002}, 0.02), {{"id", "bone"}}, {{"preset", "bone"}});
       s.scenario.erase("targets");
     },
     "organs.glb:/nodes/0"}};

INSTANTIATE_TEST_SUITE_P(Each, ScenarioDefect, ::testing::ValuesIn(kBadScenarios),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(Scenario, RegionOfAFluidIsACavity) {
  SmallScenario small;
  small.scenario["bodies"][0]["mesh"] = {{"cell_mm", 8}};
  EXPECT_THAT(load_scene(small.write()).cavities, IsEmpty());
  small.tissues["tissues"]["tumour"]["fluid"] = true;
  small.tissues["tissues"]["bile"] = small.tissues["tissues"]["tumour"];
  const content::Scene scene = load_scene(small.write());
  ASSERT_THAT(scene.cavities, SizeIs(1));
  const content::Cavity& cavity = scene.cavities[0];
  EXPECT_EQ(cavity.name, "tumour");
  EXPECT_EQ(cavity.body, 0);
  const content::DeformableBody& liver = scene.bodies[0];
  ASSERT_THAT(cavity.tets, Not(IsEmpty()));
  for (const int t : cavity.tets) {
    EXPECT_EQ(scene.tissues[liver.tet_tissue[t]].name, "tumour");
  }
  // A ball of 10 mm in cells of 8: whole tetrahedra are in or out.
  EXPECT_NEAR(cavity.volume, 4.19e-6, 1.5e-6);
  // What is fluid comes after what is not, so that a new one moves no other tissue.
  EXPECT_EQ(scene.tissues[1].name, "bone");
  EXPECT_EQ(scene.tissues[2].name, "liver");
  EXPECT_EQ(scene.tissues[3].name, "bile");
}

TEST(Scenario, NeedleForcesAndSurfacesOfTheTableAreRead) {
  SmallScenario small;
  small.tissues["tissues"]["liver"]["needle"]["cutting_force_n"] = 0.94;
  small.tissues["tissues"]["liver"]["needle"]["friction_coefficient"] = 0.2;
  small.tissues["surfaces"] = {{{"between", {"liver", "tumour"}}, {"puncture_force_n", 1.5}}};
  small.tissues["tissues"]["liver"]["needle"]["side_strength_n_per_m"] = 164;
  small.needle["bevel_force_ratio"] = 0.05;
  small.needle["yield_strength_pa"] = 9e8;
  const content::Scene scene = load_scene(small.write());
  const auto index = [&](const char* name) {
    const auto at = std::find_if(scene.tissues.begin(), scene.tissues.end(),
                                 [&](const content::Tissue& tissue) { return tissue.name == name; });
    return static_cast<int>(at - scene.tissues.begin());
  };
  const physics::InsertionResistance& liver = scene.tissues[index("liver")].needle;
  EXPECT_EQ(liver.puncture_force, 1);
  EXPECT_EQ(liver.friction_per_length, 20);
  EXPECT_EQ(liver.cutting_force, 0.94);
  EXPECT_EQ(liver.friction_coefficient, 0.2);
  EXPECT_EQ(liver.cutting_viscosity, 0) << "absent: nothing";
  EXPECT_EQ(liver.side_strength, 164);
  EXPECT_EQ(scene.tissues[index("tumour")].needle.side_strength, 0) << "absent: it holds";
  ASSERT_EQ(scene.tissue_surfaces.size(), 1U);
  EXPECT_EQ(scene.tissue_surfaces[0].from, index("liver"));
  EXPECT_EQ(scene.tissue_surfaces[0].to, index("tumour"));
  EXPECT_EQ(scene.tissue_surfaces[0].puncture_force, 1.5);
  EXPECT_EQ(scene.needle.bevel_force_ratio, 0.05);
  EXPECT_EQ(scene.needle.yield_strength, 9e8);
  EXPECT_EQ(scene.coupling, "stylet") << "the default";
}

TEST(Scenario, ValidateListsAllProblemsOfAllFilesAtOnce) {
  SmallScenario small;
  small.scenario["traget"] = 1;
  small.scenario["contact_spacing_mm"] = -1;
  small.needle["lenght_mm"] = 3;
  small.tissues["version"] = 2;
  EXPECT_THAT(validate(small.write()),
              ElementsAre(HasSubstr("scenario.json:/contact_spacing_mm"), HasSubstr("scenario.json:/traget"),
                          HasSubstr("tissues.json:/version"), HasSubstr("needle.json:/lenght_mm")));
  try {
    load_scene(small.path());
    FAIL();
  } catch (const files::ContentError& error) {
    EXPECT_THAT(error.what(), HasSubstr("(and 3 more; `stylet validate"));
    EXPECT_THAT(error.what(), Not(HasSubstr("\n")));
  }
}

TEST(Scenario, EveryKindOfFileCanBeValidatedAlone) {
  const SmallScenario small;
  small.write();
  for (const char* file :
       {"scenario.json", "tissues.json", "needle.json", "probe.json", "motion.json", "organs.glb"}) {
    EXPECT_THAT(validate(small.folder.path() / file), IsEmpty()) << file;
  }
  small.folder.write("other.json", R"({"format": "something"})");
  EXPECT_THAT(validate(small.folder.path() / "other.json"), ElementsAre(HasSubstr("names no kind of file")));
  EXPECT_THAT(validate(small.folder.path() / "gone.json"), ElementsAre(HasSubstr("there is no such file")));
}

TEST(Scenario, AnOrganFileByItselfMayHoldMoreThanIsKnown) {
  SmallScenario small;
  small.organs.json["nodes"][0]["extras"]["organ"]["rolle"] = "vessel";
  small.write();
  std::vector<std::string> warnings;
  EXPECT_THAT(validate(small.folder.path() / "organs.glb", nullptr, &warnings), IsEmpty());
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("organs.glb:/nodes/0/extras/organ/rolle: is not a known key")));
}

TEST(Scenario, UnusualButValidScenariosGiveWarnings) {
  SmallScenario small;
  small.organs.add("marks", gltf::test::sphere({0, 0, 0}, 0.01), {{"id", "marks"}, {"role", "ignore"}});
  small.organs.json["meshes"].back()["primitives"].push_back(small.organs.json["meshes"].back()["primitives"][0]);
  small.organs.json["meshes"].back()["primitives"].back()["mode"] = 0;
  std::vector<std::string> loaded;
  load_scene(small.write(), {}, &loaded);
  EXPECT_THAT(loaded, ElementsAre(HasSubstr("organs.glb:/meshes/3/primitives/1: is points or lines")));
  std::vector<std::string> validated;
  EXPECT_THAT(validate(small.path(), nullptr, &validated), IsEmpty());
  EXPECT_EQ(validated, loaded);
}

TEST(Scenario, APieceThatDoesNotMoveWarns) {
  SmallScenario small;
  mesh::TriangleMesh balls = gltf::test::sphere({0.1, 0, 0}, 0.05);
  mesh::append(balls, gltf::test::sphere({0.2, 0, 0}, 0.03));  // 18 % of both
  small.organs = {};
  small.organs.add("liver", balls, {{"id", "liver"}, {"role", "boundary"}, {"body", "liver"}}, {{"preset", "liver"}});
  small.organs.add("bone_ball", gltf::test::sphere({0.1, 0, -0.06}, 0.02), {{"id", "bone"}}, {{"preset", "bone"}});
  small.scenario.erase("targets");
  std::vector<std::string> warnings;
  EXPECT_THAT(validate(small.write(), nullptr, &warnings), IsEmpty());
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("of several pieces the largest moves")));
}

TEST(Scenario, ATargetOutsideTheBodyWarnsWithItsPlace) {
  SmallScenario small;
  const auto warnings_of = [&] {
    std::vector<std::string> warnings;
    EXPECT_THAT(validate(small.write(), nullptr, &warnings), IsEmpty());
    return warnings;
  };
  EXPECT_THAT(warnings_of(), IsEmpty());
  small.scenario["targets"] = {{{"name", "inside"}, {"centre", {0.11, 0, 0}}, {"radius_mm", 5}},
                               {{"name", "beside"}, {"centre", {0.2, 0, 0}}, {"radius_mm", 5}},
                               {{"name", "far"}, {"centre", {4, 0, 0}}, {"radius_mm", 5}}};
  EXPECT_THAT(warnings_of(),
              ElementsAre(HasSubstr("scenario.json:/targets/1: its middle at (200.0, 0.0, 0.0) mm lies "
                                    "outside the patient"),
                          HasSubstr("scenario.json:/targets/2: its middle at (4000.0")));
}

TEST(Scenario, AProbeThatIsNotOnTheSkinWarnsWithItsDistance) {
  SmallScenario small;  // the skin: a ball of 50 mm round (100, 0, 0) mm, and one of 20 mm below it
  const auto warning = [&](const json& position, const json& axis) {
    small.scenario["probe"]["position"] = position;
    small.scenario["probe"]["axis"] = axis;
    std::vector<std::string> warnings;
    EXPECT_THAT(validate(small.write(), nullptr, &warnings), IsEmpty());
    return warnings.empty() ? std::string() : warnings.front();
  };
  EXPECT_EQ(warning({0.1, 0, 0.05}, {0, 0, -1}), "");
  EXPECT_EQ(warning({0.1, 0, 0.045}, {0, 0, -1}), "") << "pressed in";
  EXPECT_EQ(warning({0.1, 0, 0.058}, {0, 0, -1}), "") << "gel";
  EXPECT_THAT(warning({0.1, 0, 3.05}, {0, 0, -1}),
              ::testing::ContainsRegex("scenario.json:/probe: the probe's face lies 300[0-2] mm from the skin"));
  EXPECT_THAT(warning({0.1, 0, 0.01}, {0, 0, -1}),
              ::testing::ContainsRegex("scenario.json:/probe: the probe's face lies (39|40|41) mm below the skin"));
  EXPECT_THAT(warning({0.1, 0, 0.055}, {0, 0, 1}),
              HasSubstr("/probe: the probe's axis (+Z) does not meet the patient"));
}

TEST(Scenario, AMalformedScenarioIsListedWithItsCauseAndFound) {
  const SmallScenario small;
  small.write();
  small.folder.write("broken.json", "{\n \"format\": \"stylet-scenario\",\n \"version\" 1\n}\n");
  small.folder.write("nameless.json", R"({"format": "stylet-scenario", "version": 1})");
  const auto entries = list_scenarios(small.folder.path());
  ASSERT_THAT(entries, SizeIs(3));
  EXPECT_EQ(entries[0].name, "broken");
  EXPECT_THAT(entries[0].unreadable_because, HasSubstr("broken.json:3:"));
  EXPECT_EQ(entries[1].name, "nameless");
  EXPECT_THAT(entries[1].unreadable_because, HasSubstr("nameless.json:/name: is missing"));
  EXPECT_EQ(entries[2].unreadable_because, "");

  const support::TemporaryFolder content;
  std::filesystem::create_directory(content.path() / "scenarios");
  std::filesystem::copy(small.folder.path() / "broken.json", content.path() / "scenarios" / "broken.json");
  ASSERT_EQ(::setenv("STYLET_CONTENT", content.path().c_str(), 1), 0);
  EXPECT_EQ(find_scenario("broken"), content.path() / "scenarios" / "broken.json");
  ASSERT_EQ(::unsetenv("STYLET_CONTENT"), 0);
}

TEST(Scenario, ListingFindsScenariosOnly) {
  const SmallScenario small;
  small.write();
  const auto entries = list_scenarios(small.folder.path());
  ASSERT_THAT(entries, SizeIs(1));
  EXPECT_EQ(entries[0].name, "small");
  EXPECT_EQ(entries[0].title, "three balls");
  EXPECT_THAT(list_scenarios("/nowhere"), IsEmpty());
}

TEST(Scenario, ContentFolderFollowsTheEnvironment) {
  const support::TemporaryFolder folder;
  ASSERT_EQ(::setenv("STYLET_CONTENT", folder.path().c_str(), 1), 0);
  EXPECT_EQ(content_directory(), folder.path());
  ASSERT_EQ(::setenv("STYLET_CONTENT", "/nowhere", 1), 0);
  EXPECT_THROW(content_directory(), files::ContentError);
  ASSERT_EQ(::unsetenv("STYLET_CONTENT"), 0);
  EXPECT_TRUE(std::filesystem::is_directory(content_directory() / "scenarios"));
  EXPECT_THROW(find_scenario("no_such_scenario"), files::ContentError);
}

}  // namespace
}  // namespace stylet::readers
