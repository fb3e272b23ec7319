// The shipped exercises, with the hands that are shipped for them.
#include "engine/gltf/gltf.h"
#include "engine/motion/biopsy_motion.h"
#include "engine/motion/stroke_motion.h"
#include "engine/procedures/ablation/plan.h"
#include "engine/procedures/biopsy/biopsy.h"
#include "engine/readers/motion.h"
#include "engine/readers/patient_procedure.h"
#include "engine/readers/scenario.h"
#include "engine/readers/scenario_file.h"
#include "engine/session/recorded_stylus.h"
#include "engine/training/metrics.h"
#include "engine/training/score.h"
#include "engine/training/training_report.h"
#include "engine/training/training_session.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace stylet::training {
namespace {

const std::filesystem::path kContent = std::filesystem::path(STYLET_SOURCE_DIR) / "content";

void expect_same(const content::Motion& made, const content::Motion& shipped) {
  ASSERT_EQ(made.stylus.size(), shipped.stylus.size()) << "run make_motion again (content/motions/LICENCE.md)";
  for (std::size_t i = 0; i < made.stylus.size(); ++i) {
    ASSERT_LT((made.stylus[i].pose.position - shipped.stylus[i].pose.position).norm(), 2e-6) << i;
    ASSERT_LT(made.stylus[i].pose.orientation.angularDistance(shipped.stylus[i].pose.orientation), 1e-5) << i;
    ASSERT_EQ(made.stylus[i].buttons, shipped.stylus[i].buttons) << i;
  }
}

// The first of its three targets: the others are the same again.
TEST(Tutorial, HandTakesACoreOfTheFirstTarget) {
  if (support::kSanitized) GTEST_SKIP() << "seconds of session; its parts are tested under sanitizers elsewhere";
  const content::Scene scene = readers::load_scene(kContent / "scenarios/tutorial.json");
  EXPECT_EQ(scene.targets.size(), 3U);
  const support::TemporaryFolder folder;
  haptic::RecordedDevice device = session::recorded_stylus(scene.motion);
  TrainingSession training(scene, {.automatic = true});
  session::LiveSession live(scene, device,
                            {.duration_s = 4.4,
                             .lockstep = true,
                             .recording = folder / "tutorial",
                             .build = "test",
                             .listeners = {&training.watch()}});
  std::string hints;
  live.run_in_lockstep([&](double share) {
    if (share >= 1) return training.end(live);
    const std::string& hint = training.poll(live).hint;
    if (!hints.ends_with(hint + "|")) hints += hint + "|";
  });
  const auto& cores = dynamic_cast<const procedures::biopsy::Biopsy&>(*training.procedure()).cores();
  ASSERT_EQ(cores.size(), 1U);
  std::printf("core of %.0f %% target; hints %s\n", 100 * cores[0].target_share, hints.c_str());
  EXPECT_GT(cores[0].target_share, 0.9) << "5 mm from near the middle of a ball of 7 mm";
  EXPECT_NE(hints.find("In the target"), std::string::npos);
}

/// What a hand that moves so comes to.
TrainingReport report_of(const content::Scene& scene, const content::Motion& motion) {
  const support::TemporaryFolder folder;
  haptic::RecordedDevice device = session::recorded_stylus(motion);
  const double duration_s = motion.stylus.back().time_s;
  TraceRecorder trace(scene, duration_s);
  TrainingSession training(scene, {.automatic = true});
  session::LiveSession live(scene, device,
                            {.duration_s = duration_s,
                             .lockstep = true,
                             .recording = folder / "hand",
                             .build = "test",
                             .listeners = {&trace, &training.watch()}});
  live.run_in_lockstep([&](double share) { share < 1 ? (void)training.poll(live) : training.end(live); });
  return assess(trace.take(recording::read_recording(folder / "hand").events), scene);
}

/// Who does as the briefing says is an expert, and beats who does it at another place of the target.
void follower_beats(const std::string& name, const content::Motion& other, const char* what) {
  const content::Scene scene = readers::load_scene(readers::find_scenario(name));
  const TrainingReport follows = report_of(scene, scene.motion);
  const TrainingReport does_not = report_of(scene, other);
  std::printf("%s, as the briefing says:\n%s%s:\n%s", name.c_str(), in_words(follows).c_str(), what,
              in_words(does_not).c_str());
  EXPECT_TRUE(follows.score->passed);
  EXPECT_GT(follows.score->total, 93);
  EXPECT_GT(follows.score->total, does_not.score->total + 5);
  const ScoreLine& most = *std::ranges::max_element(follows.score->lines, {}, &ScoreLine::most);
  EXPECT_GT(most.share, 0.95) << most.title;
}

readers::Procedure procedure_at(const char* file) {
  files::JsonFile json(kContent / "organs" / file);
  readers::Procedure procedure = readers::read_procedure(json);
  json.throw_problems();
  return procedure;
}

TEST(Briefing, OfTheBiopsyFollowedBeatsFiringAtTheCenter) {
  if (support::kSanitized) GTEST_SKIP() << "minutes long with a sanitizer";
  const readers::Procedure plan = procedure_at("abdomen.json");
  // The same expert 7.2 mm deeper: the tip then comes to rest in the middle.
  const double at_center = plan.target_radius - 0.0072;
  follower_beats("liver_biopsy",
                 motion::biopsy_motion(motion::demonstration(plan.entry, plan.target, at_center, 0.150)),
                 "fired at the center");
}

TEST(Briefing, OfTheTutorialFollowedBeatsFiringAtTheCenters) {
  if (support::kSanitized) GTEST_SKIP() << "minutes long with a sanitizer";
  files::JsonFile file(kContent / "scenarios/tutorial.json");
  std::vector<content::Target> targets;
  for (const readers::TargetRequest& target : readers::read_scenario_file(file).targets) {
    targets.push_back({.name = target.name, .centre = target.centre, .radius = target.radius});
  }
  follower_beats("tutorial", motion::tour_motion({.entry = {-0.040, 0, 0}, .inside = 1, .targets = targets}),
                 "fired at the centers");
}

TEST(Briefing, OfTheAblationFollowedBeatsATipAtTheCenter) {
  if (support::kSanitized) GTEST_SKIP() << "minutes long with a sanitizer";
  const content::Scene scene = readers::load_scene(readers::find_scenario("rfa"));
  const readers::Procedure plan = procedure_at("ablation_tumour.json");
  follower_beats("rfa",
                 motion::stay_motion({.entry = plan.entry,
                                      .target = plan.target,
                                      .exposed = 0,
                                      .breathing = scene.breathing,
                                      .carried = 0.9 * scene.breathing.rigid_motion,
                                      .stay = 14}),
                 "the tip at the center");
}

TEST(Briefing, OfTheAspirationFollowedBeatsDrawingAtTheWall) {
  if (support::kSanitized) GTEST_SKIP() << "minutes long with a sanitizer";
  const content::Scene scene = readers::load_scene(readers::find_scenario("cyst_aspiration"));
  const readers::Procedure plan = procedure_at("cyst.json");
  follower_beats("cyst_aspiration",
                 motion::stay_motion({.entry = plan.entry,
                                      .target = plan.target - 0.016 * (plan.target - plan.entry).normalized(),
                                      .exposed = 0,
                                      .breathing = scene.breathing,
                                      .carried = 0.9 * scene.breathing.rigid_motion,
                                      .stay = 14}),
                 "drawn behind the wall");
}

TEST(Scenarios, AreScoredByWhatTheyTrain) {
  for (const auto& [name, metric] :
       {std::pair("liver_biopsy", "tumour_content"), std::pair("rfa", "ablation_coverage"),
        std::pair("tutorial", "tumour_content")}) {
    SCOPED_TRACE(name);
    files::JsonFile file(kContent / "scenarios" / (std::string(name) + ".json"));
    const readers::ScenarioFile scenario = readers::read_scenario_file(file);
    ASSERT_TRUE(file.problems().empty()) << file.problems().front();
    ASSERT_FALSE(scenario.scoring.empty());
    double most = 0;
    bool critical = false;
    for (const content::Criterion& criterion : scenario.scoring) {
      most = std::max(most, criterion.weight);
      critical = critical || criterion.critical;
    }
    EXPECT_TRUE(critical) << "something must not happen";
    EXPECT_EQ(std::ranges::find(scenario.scoring, metric, &content::Criterion::metric)->weight, most);
    // Who does nothing does not pass.
    content::Scene scene;
    scene.scoring = scenario.scoring;
    scene.pass_mark = scenario.pass_mark;
    EXPECT_FALSE(score(measure({}, scene), scene, false)->passed);
  }
}

TEST(RfaScenario, TumourLiesBesideTheVeinAndTheElectrodeInTheTumour) {
  files::JsonFile file(kContent / "scenarios/rfa.json");
  const readers::ScenarioFile scenario = readers::read_scenario_file(file);
  ASSERT_TRUE(file.problems().empty()) << file.problems().front();
  files::JsonFile procedure_file(kContent / "organs/ablation_tumour.json");
  const readers::Procedure procedure = readers::read_procedure(procedure_file);
  const auto& plan = procedures::ablation::plan_of(scenario.exercise);
  const content::Motion shipped = readers::read_motion(scenario.motion);
  expect_same(motion::stay_motion({.entry = procedure.entry,
                                   .target = procedure.target,
                                   .exposed = plan.exposed,
                                   .beyond = motion::kLiverYields,
                                   .breathing = scenario.breathing,
                                   .carried = 0.9 * scenario.breathing.rigid_motion,
                                   .stay = plan.duration_s / plan.time_factor + 2}),
              shipped);
  // The vein's wall is a few millimetres from the tumour: it cools, and is not in it.
  double gap = 1;
  for (const gltf::GltfOrgan& organ : gltf::read_gltf(kContent / "organs/abdomen.glb").organs) {
    if (organ.name != "hepatic_veins") continue;
    for (const Eigen::Vector3d& x : organ.mesh.vertices) {
      gap = std::min(gap, (x - procedure.target).norm() - procedure.target_radius);
    }
  }
  std::printf("vein %.1f mm from the tumour\n", 1e3 * gap);
  EXPECT_GT(gap, 0.002);
  EXPECT_LT(gap, 0.006);
}

TEST(Tutorial, MotionIsWhatItsGeneratorMakes) {
  files::JsonFile file(kContent / "scenarios/tutorial.json");
  const readers::ScenarioFile scenario = readers::read_scenario_file(file);
  std::vector<content::Target> targets;
  for (const readers::TargetRequest& target : scenario.targets) {
    targets.push_back({.name = target.name, .centre = target.centre, .radius = target.radius});
    double nearest = 1;  // a ball of the phantom
    for (const gltf::GltfOrgan& organ : gltf::read_gltf(kContent / "organs/phantom.glb").organs) {
      if (organ.organ.role != "target") continue;
      double worst = 0;
      for (const Eigen::Vector3d& x : organ.mesh.vertices) {
        worst = std::max(worst, std::abs((x - target.centre).norm() - target.radius));
      }
      nearest = std::min(nearest, worst);
    }
    EXPECT_LT(nearest, 0.3e-3) << target.name;
  }
  expect_same(motion::tour_motion({.entry = {-0.040, 0, 0}, .targets = targets}),
              readers::read_motion(kContent / "motions/tutorial.json"));
}

}  // namespace
}  // namespace stylet::training
