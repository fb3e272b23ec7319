// A session with its course: what is fired and heated, on record and in replay.
#include "engine/training/training_session.h"
#include "engine/content/metric_table.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/session/recorded_stylus.h"
#include "engine/session/replay.h"
#include "engine/training/metrics.h"
#include "engine/training/zone_replay.h"
#include "tests/session/layered_scene.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace stylet::training {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

content::Scene biopsy_scene() {
  content::Scene scene = tests::layered_scene();
  scene.exercise.sampling = {.kind = content::SamplingKind::biopsy, .automatic = true};
  return scene;
}

std::vector<std::string> flow_events(const recording::Recording& recording) {
  std::vector<std::string> names;
  for (const recording::EventRecord& event : recording.events) {
    const std::string name = event.detail.empty() ? event.name : event.name + " " + event.detail;
    for (const auto known : {flow_event::kStage, flow_event::kBiopsyFired, flow_event::kRefused, flow_event::kPaused,
                             flow_event::kResumed, flow_event::kReset}) {
      if (event.name == known) names.push_back(name);
    }
  }
  return names;
}

/// Fires in a replay where the recording did.
class FireAgain final : public session::StepListener {
public:
  FireAgain(ProcedureWatch& watch, std::uint64_t haptic_step) : watch_(watch), step_(haptic_step) {}
  void simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport&,
                          const physics::TissueState&, const physics::NeedleState&) override {
    if (record.needle_step == step_) watch_.cut_core();
  }

private:
  ProcedureWatch& watch_;
  std::uint64_t step_;
};

TEST(TrainingSession, FiresInTheTumourAndItsReplayCutsTheSameCore) {
  const content::Scene scene = biopsy_scene();
  const support::TemporaryFolder folder;
  haptic::RecordedDevice device = session::recorded_stylus(scene.motion);
  TrainingSession training(scene, {.automatic = true});
  session::LiveSession live(scene, device,
                            {.coupling = physics::Coupling::stylet,
                             .duration_s = 2.4,
                             .lockstep = true,
                             .recording = folder / "biopsy",
                             .build = "test",
                             .listeners = {&training.watch()}});
  std::set<std::string> tissues;  // at the tip
  live.run_in_lockstep([&](double share) {
    share < 1 ? (void)training.poll(live) : training.end(live);
    if (training.tip_tissue() > 0)
      tissues.insert(scene.tissues[static_cast<std::size_t>(training.tip_tissue())].name);
  });
  const recording::Recording recording = recording::read_recording(folder / "biopsy");
  EXPECT_TRUE(recording.complete());
  EXPECT_THAT(tissues, testing::IsSupersetOf({"fat", "muscle", "liver", "tumour"}));
  EXPECT_THAT(flow_events(recording),
              ElementsAre("stage procedure", "biopsy_fired 1", "stage sampling", "stage debrief"));
  ASSERT_EQ(training.result().cores.size(), 1u);
  const Core& core = training.result().cores[0];
  std::printf("core at %.2f s: %.0f %% tumour\n", core.time_s, 100 * training.result().tumour_shares[0]);
  // From near the middle of a ball of 10 mm: 10 of its 17 mm.
  EXPECT_GT(training.result().tumour_shares[0], 0.4);
  EXPECT_LT(training.result().tumour_shares[0], 0.85);
  const std::vector<Metric> metrics = measure({.events = recording.events}, scene);
  EXPECT_NEAR(find_metric(metrics, content::kTumourContent).value.value(), 100 * training.result().tumour_shares[0],
              0.01);

  const session::RecordedSettings settings = session::recorded_settings(recording);
  session::StepHash hash;
  ProcedureWatch watch(scene);
  FireAgain again(watch, core.haptic_step);
  session::CoupledLoops loops(scene, settings.coupling, settings.start, {&hash, &again, &watch}, settings.base);
  EXPECT_TRUE(session::replay(recording, loops, hash).identical());
  EXPECT_EQ(watch.latest().core.content, core.content);
  EXPECT_EQ(watch.latest().core.time_s, core.time_s);
}

TEST(TrainingSession, PausesTheLoopsAndTellsWhyItDoesNotFire) {
  content::Scene scene = biopsy_scene();
  scene.exercise.sampling.automatic = false;
  const support::TemporaryFolder folder;
  haptic::RecordedDevice device = session::recorded_stylus(scene.motion);
  TrainingSession training(scene, {});
  session::LiveSession live(
      scene, device,
      {.duration_s = 60, .recording = folder / "paused", .build = "test", .listeners = {&training.watch()}});
  live.start();
  const auto act = [&](std::vector<Action> actions) {
    std::this_thread::sleep_for(std::chrono::milliseconds(40));
    training.poll(live, actions);
  };
  act({});
  EXPECT_EQ(training.state().stage, Stage::briefing);
  act({Action::start, Action::fire});
  EXPECT_THAT(training.state().refusal, HasSubstr("not in tissue"));
  act({Action::pause});
  EXPECT_TRUE(live.paused());
  act({Action::resume});
  EXPECT_FALSE(live.paused());
  act({Action::reset});
  EXPECT_TRUE(training.reset_asked_for());
  training.end(live);
  live.stop();
  const recording::Recording recording = recording::read_recording(folder / "paused");
  EXPECT_TRUE(recording.complete());
  EXPECT_THAT(flow_events(recording), ElementsAre("stage procedure", HasSubstr("refused fire: the tip is not in"),
                                                  "paused", "resumed", "reset", "stage debrief"));
}

TEST(TrainingSession, ButtonOfTheMotionHeatsAndTheZoneIsOnRecord) {
  content::Scene scene = tests::layered_scene();
  scene.exercise.sampling = {.kind = content::SamplingKind::ablation};
  scene.exercise.sampling.ablation.exposed = 0.02;
  scene.exercise.sampling.ablation.duration_s = 60;
  scene.exercise.sampling.ablation.time_factor = 120;
  content::MotionSample rest = scene.motion.stylus.back();
  for (const double t : {2.2, 2.3, 3.2}) {
    rest.time_s = t;
    rest.buttons = t < 2.25 ? 1 : 0;
    scene.motion.stylus.push_back(rest);
  }
  const support::TemporaryFolder folder;
  haptic::RecordedDevice device = session::recorded_stylus(scene.motion);
  TrainingSession training(scene, {.automatic = true});
  session::LiveSession live(scene, device,
                            {.duration_s = 3.0,
                             .lockstep = true,
                             .recording = folder / "ablation",
                             .build = "test",
                             .listeners = {&training.watch()}});
  live.run_in_lockstep([&](double share) { share < 1 ? (void)training.poll(live) : training.end(live); });
  const SamplingResult& result = training.result();
  ASSERT_TRUE(result.heated);
  EXPECT_NEAR(result.heated_s, 60, 3);
  EXPECT_GT(result.volume, 0.2e-6);
  EXPECT_GT(result.coverage.tumour, 0.02);
  std::string told;
  const recording::Recording recording = recording::read_recording(folder / "ablation");
  for (const recording::EventRecord& event : recording.events) {
    if (event.name == training_event::kAblated) told = event.detail;
  }
  std::printf("%s\n", told.c_str());
  EXPECT_THAT(told, HasSubstr(" ml; target "));
  const std::vector<Metric> metrics = measure({.events = recording.events}, scene);
  EXPECT_NEAR(find_metric(metrics, content::kAblationCoverage).value.value(), 100 * result.coverage.with_margin,
              0.01);
}

// Film and stills show what the session did: from the events and the needle of its recording alone.
TEST(TrainingSession, ZoneOfTheReplayIsTheSessions) {
  content::Scene scene = tests::layered_scene();
  scene.exercise.sampling = {.kind = content::SamplingKind::ablation, .automatic = true};
  scene.exercise.sampling.ablation.exposed = 0.02;
  scene.exercise.sampling.ablation.duration_s = support::kSanitized ? 20 : 60;
  scene.exercise.sampling.ablation.time_factor = 150;
  content::MotionSample rest = scene.motion.stylus.back();
  rest.time_s = 3.2;
  scene.motion.stylus.push_back(rest);
  const support::TemporaryFolder folder;
  haptic::RecordedDevice device = session::recorded_stylus(scene.motion);
  TrainingSession training(scene, {.automatic = true});
  session::LiveSession live(scene, device,
                            {.duration_s = 3.1,
                             .lockstep = true,
                             .recording = folder / "zone",
                             .build = "test",
                             .listeners = {&training.watch()}});
  content::HeatedZone at_stop;
  live.run_in_lockstep([&](double share) {
    share < 1 ? (void)training.poll(live) : training.end(live);
    if (training.result().heated && at_stop.version == 0) at_stop = *training.zone();
  });
  ASSERT_TRUE(training.result().heated);
  ASSERT_GT(at_stop.surface.indices.size(), 0U);
  // What is drawn has the volume that the session tells, but for half a cell all over its surface.
  mesh::TriangleMesh drawn;
  double area = 0;
  for (const Eigen::Vector3f& x : at_stop.surface.positions) drawn.vertices.push_back(x.cast<double>());
  for (std::size_t i = 0; i < at_stop.surface.indices.size(); i += 3) {
    const std::uint32_t* t = &at_stop.surface.indices[i];
    drawn.triangles.push_back({t[0], t[1], t[2]});
    area +=
        0.5 * (drawn.vertices[t[1]] - drawn.vertices[t[0]]).cross(drawn.vertices[t[2]] - drawn.vertices[t[0]]).norm();
  }
  const double volume = mesh::inspect(drawn).volume;
  std::printf("%.2f ml drawn, %.2f ml told\n", 1e6 * volume, 1e6 * training.result().volume);
  EXPECT_NEAR(volume, training.result().volume, 0.5 * Ablation::kCell * area);

  const recording::Recording recording = recording::read_recording(folder / "zone");
  const session::RecordedSettings settings = session::recorded_settings(recording);
  session::StepHash hash;
  ZoneReplay replayed(scene, recording.events);
  EXPECT_EQ(replayed.zone_at(3), nullptr) << "not so far yet";
  session::CoupledLoops loops(scene, settings.coupling, settings.start, {&hash, &replayed}, settings.base);
  ASSERT_TRUE(session::replay(recording, loops, hash).identical());
  double start_s = 0, stop_s = 0;
  for (const recording::EventRecord& event : recording.events) {
    if (event.name == flow_event::kAblationStarted) start_s = event.time_s;
    if (event.name == flow_event::kAblationStopped) stop_s = event.time_s;
  }
  EXPECT_EQ(replayed.zone_at(start_s - 0.01), nullptr);
  const auto expect_as_at_stop = [&] {
    const content::HeatedZone* zone = replayed.zone_at(stop_s);
    ASSERT_NE(zone, nullptr);
    EXPECT_EQ(zone->surface.positions, at_stop.surface.positions);
    EXPECT_EQ(zone->surface.body, at_stop.surface.body);
    EXPECT_EQ(zone->gas, at_stop.gas);
    EXPECT_EQ(zone->dose, at_stop.dose);
    EXPECT_EQ(replayed.ablation()->volume(), training.result().volume);
  };
  expect_as_at_stop();
  const float most_gas = *std::ranges::max_element(at_stop.gas);
  EXPECT_GT(most_gas, 0.9F);
  const content::HeatedZone* later = replayed.zone_at(stop_s + 0.5);
  EXPECT_NEAR(*std::ranges::max_element(later->gas), most_gas * std::exp(-75 / Ablation::kGasLasts), 0.01);
  EXPECT_EQ(later->dose, at_stop.dose) << "what is dead stays so";
  const content::HeatedZone* half = replayed.zone_at((start_s + stop_s) / 2);
  EXPECT_LT(replayed.ablation()->volume(), training.result().volume);
  EXPECT_LT(half->surface.positions.size(), at_stop.surface.positions.size());
  expect_as_at_stop();  // once more, after going back
}

TEST(TrainingSession, ZoneOfAHostileRecordingEnds) {
  content::Scene scene = tests::layered_scene();
  scene.exercise.sampling = {.kind = content::SamplingKind::ablation};
  scene.exercise.sampling.ablation.duration_s = 5;
  scene.exercise.sampling.ablation.time_factor = 0.1;
  const support::TemporaryFolder folder;
  haptic::RecordedDevice device = session::recorded_stylus(scene.motion);
  session::LiveSession live(scene, device, {.duration_s = 0.1, .lockstep = true, .recording = folder / "short"});
  live.run_in_lockstep();
  const recording::Recording recording = recording::read_recording(folder / "short");
  const recording::SimulationStepRecord& seen = recording.simulation.back();
  const std::vector<recording::EventRecord> events{
      {.time_s = seen.time_s, .step = seen.needle_step, .name = "ablation_started", .detail = ""},
      {.time_s = seen.time_s, .step = seen.needle_step, .name = "ablation_stopped", .detail = "1e300 s"},
      {.time_s = seen.time_s, .step = seen.needle_step, .name = "ablated", .detail = "1e300 s, nan ml"}};
  const session::RecordedSettings settings = session::recorded_settings(recording);
  session::StepHash hash;
  ZoneReplay zone(scene, events);
  session::CoupledLoops loops(scene, settings.coupling, settings.start, {&hash, &zone}, settings.base);
  ASSERT_TRUE(session::replay(recording, loops, hash).identical());
  ASSERT_NE(zone.zone_at(1e6), nullptr);
  EXPECT_NEAR(zone.ablation()->heated_s(), 11, 1);
}

class AblationInLayers : public ::testing::Test {
protected:
  AblationInLayers() {
    scene_ = tests::layered_scene();
    scene_.exercise.sampling = {.kind = content::SamplingKind::ablation};
    centre_ = scene_.targets[0].centre;
  }
  Electrode electrode() const {
    return {.tip = centre_ - Eigen::Vector3d(0, 0, 0.015), .base = centre_ + Eigen::Vector3d(0, 0, 0.015)};
  }
  static constexpr double kHeated = support::kSanitized ? 120 : 720;

  content::Scene scene_;
  Eigen::Vector3d centre_;
};

TEST_F(AblationInLayers, ZoneDoesNotDependOnHowOftenItIsAsked) {
  Ablation one(scene_, electrode(), 0);
  one.heat_to(90);
  Ablation two(scene_, electrode(), 0);
  for (double t = 0; t <= 90; t += 0.37) two.heat_to(t);
  two.heat_to(90.4);
  EXPECT_EQ(one.field().temperature(), two.field().temperature());
  EXPECT_EQ(one.field().dose(), two.field().dose());
  EXPECT_EQ(one.heated_s(), 90);
}

TEST_F(AblationInLayers, CoverageGrowsAndIsLessBesideAVessel) {
  Ablation free(scene_, electrode(), 0);
  EXPECT_EQ(free.coverage().tumour, 0);
  EXPECT_TRUE(free.zone().triangles.empty());
  free.heat_to(kHeated / 4);
  const AblationCoverage early = free.coverage();
  free.heat_to(kHeated);
  const AblationCoverage late = free.coverage();
  EXPECT_GT(early.tumour, 0);
  EXPECT_GT(late.tumour, early.tumour);
  EXPECT_GT(late.with_margin, early.with_margin);
  EXPECT_LT(late.with_margin, late.tumour) << "the margin is the last to go";

  if (support::kSanitized) return;  // so short a heat does not reach the vein
  // A vein of 6 mm on one side of the tumour.
  content::Scene veined = scene_;
  veined.tissues.push_back(veined.tissues.back());
  content::Surface vein;
  vein.tissue = 6;
  vein.role = content::SurfaceRole::vessel;
  veined.surfaces.push_back(vein);
  content::LabelVolume& labels = veined.labels;
  for (int k = 0; k < labels.size.z(); ++k) {
    for (int j = 0; j < labels.size.y(); ++j) {
      for (int i = 0; i < labels.size.x(); ++i) {
        const Eigen::Vector3d x = labels.origin.cast<double>() + 1e-3 * Eigen::Vector3d(i, j, k);
        const std::size_t voxel =
            static_cast<std::size_t>(i + labels.size.x() * (j + static_cast<std::ptrdiff_t>(labels.size.y()) * k));
        if (labels.labels[voxel] == 4 && std::hypot(x.x() - 0.0135, x.y()) < 0.003) labels.labels[voxel] = 6;
      }
    }
  }
  Ablation beside(veined, electrode(), 0);
  beside.heat_to(kHeated);
  std::printf("tumour %.2f, with margin %.2f; beside a vein %.2f, %.2f\n", late.tumour, late.with_margin,
              beside.coverage().tumour, beside.coverage().with_margin);
  EXPECT_LT(beside.coverage().with_margin, late.with_margin);
  EXPECT_LT(beside.volume(), free.volume());
}

TEST_F(AblationInLayers, SurfaceIsClosedOutwardAndRidesOnItsBody) {
  Ablation ablation(scene_, electrode(), 0);
  ablation.heat_to(120);
  const mesh::SurfaceReport report = mesh::inspect(ablation.zone());
  EXPECT_TRUE(report.closed());
  EXPECT_TRUE(report.oriented());
  EXPECT_NEAR(report.volume, ablation.volume(), 0.15 * ablation.volume());
  const content::Surface surface = ablation.surface(1);
  ASSERT_EQ(surface.embedding.size(), surface.positions.size());
  double worst = 0;
  for (std::size_t i = 0; i < surface.positions.size(); ++i) {
    Eigen::Vector3d x = -surface.positions[i].cast<double>();
    for (std::size_t n = 0; n < 4; ++n) {
      x += static_cast<double>(surface.embedding[i].weights[n]) *
           scene_.bodies[1].mesh.nodes[surface.embedding[i].nodes[n]];
    }
    worst = std::max(worst, x.norm());
  }
  EXPECT_LT(worst, 1e-6);
}

}  // namespace
}  // namespace stylet::training
