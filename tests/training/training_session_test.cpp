// A session with its course: what is fired and heated, on record and in replay.
#include "engine/training/training_session.h"
#include "engine/content/metric_table.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/procedures/ablation/heating.h"
#include "engine/procedures/ablation/zone_replay.h"
#include "engine/procedures/biopsy/biopsy.h"
#include "engine/procedures/kinds.h"
#include "engine/session/recorded_stylus.h"
#include "engine/session/replay.h"
#include "engine/training/metrics.h"
#include "engine/training/replayed_procedure.h"
#include "tests/session/held_stylus.h"
#include "tests/session/layered_scene.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"
#include "tests/training/event_words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace stylet::training {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

content::Scene biopsy_scene(bool automatic = true) {
  content::Scene scene = tests::layered_scene();
  auto plan = std::make_shared<procedures::biopsy::Plan>();
  plan->automatic = automatic;
  scene.exercise.plan = plan;
  return scene;
}

std::vector<std::string> flow_events(const recording::Recording& recording) {
  std::vector<std::string> names;
  for (const recording::EventRecord& event : recording.events) {
    for (const auto known : {flow_event::kStage, procedures::biopsy::kFiredEvent, flow_event::kRefused,
                             flow_event::kPaused, flow_event::kResumed, flow_event::kReset}) {
      if (event.name == known) names.push_back(tests::event_words(event));
    }
  }
  return names;
}

/// The scene of an ablation that heats `duration_s` by the tissue's clock.
void plan_ablation(content::Scene& scene, double duration_s, double time_factor, bool automatic = false) {
  auto plan = std::make_shared<procedures::ablation::Plan>();
  plan->automatic = automatic;
  plan->exposed = plan->working_length = 0.02;
  plan->duration_s = duration_s;
  plan->time_factor = time_factor;
  plan->destroys = true;
  scene.exercise.plan = plan;
}

const procedures::biopsy::Biopsy& biopsy_of(const TrainingSession& training) {
  return dynamic_cast<const procedures::biopsy::Biopsy&>(*training.procedure());
}
const procedures::ablation::Heating& heating_of(const TrainingSession& training) {
  return dynamic_cast<const procedures::ablation::Heating&>(*training.procedure());
}

/// What a hand on a stylus with force was given.
class LoggedHand final : public haptic::Device {
public:
  explicit LoggedHand(const content::Scene& scene)
      : motion_(session::recorded_stylus(scene.motion)), held_([this](double t) {
          const haptic::StylusSample sample = motion_.read(t);
          return physics::StylusPose{sample.position, sample.orientation};
        }) {}
  std::string name() const override { return held_.name(); }
  haptic::DeviceLimits limits() const override { return held_.limits(); }
  haptic::StylusSample read(double now_s) override {
    const haptic::StylusSample sample = held_.read(now_s);
    axes.push_back(sample.orientation * Eigen::Vector3d::UnitZ());
    return sample;
  }
  void write(const Eigen::Vector3d& force, const Eigen::Vector3d& torque) override {
    held_.write(force, torque);
    forces.push_back(force);
  }
  std::vector<Eigen::Vector3d> axes;    // [reads]
  std::vector<Eigen::Vector3d> forces;  // [haptic steps]

private:
  haptic::RecordedDevice motion_;
  tests::HeldStylus held_;
};

TEST(TrainingSession, IsFeltAsItFiresAndReplaysToTheSameBits) {
  const support::TemporaryFolder folder;
  std::vector<std::vector<Eigen::Vector3d>> forces;
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  double fired_s = 0;
  for (const bool fires : {true, false}) {
    const content::Scene scene = biopsy_scene(fires);
    LoggedHand device(scene);
    TrainingSession training(scene, {.automatic = true});
    const std::filesystem::path file = folder / (fires ? "fired" : "not_fired");
    session::LiveSession live(
        scene, device,
        {.duration_s = 2.4, .lockstep = true, .recording = file, .build = "test", .listeners = {&training.watch()}});
    live.run_in_lockstep([&](double share) { share < 1 ? (void)training.poll(live) : training.end(live); });
    forces.push_back(device.forces);
    axis = device.axes.back();
    const recording::Recording recording = recording::read_recording(file);
    const session::RecordedSettings settings = session::recorded_settings(recording);
    session::StepHash hash;
    session::CoupledLoops loops(scene, settings.coupling, settings.start, {&hash}, settings.base);
    EXPECT_TRUE(session::replay(recording, loops, hash).identical());
    EXPECT_EQ(hash.state(), live.state_hash());
    if (!fires) continue;
    ASSERT_EQ(biopsy_of(training).cores().size(), 1U);
    for (const recording::EventRecord& event : recording.events) {
      if (event.name == procedures::biopsy::kFiredEvent) fired_s = event.time_s;
    }
  }
  const std::size_t steps = std::min(forces[0].size(), forces[1].size());
  std::size_t first = 0;
  while (first < steps && forces[0][first] == forces[1][first]) ++first;
  ASSERT_LT(first, steps) << "no click";
  double back = 0, forth = 0;
  for (std::size_t k = first; k < std::min(first + 15, steps); ++k) {
    const double extra = (forces[0][k] - forces[1][k]).dot(axis);
    back = std::min(back, extra);
    forth = std::max(forth, extra);
  }
  std::printf("fired at %.3f s, felt at %.3f s: %.2f to %.2f N\n", fired_s, 1e-3 * static_cast<double>(first), back,
              forth);
  EXPECT_GE(1e-3 * static_cast<double>(first), fired_s - 1e-9);
  EXPECT_LE(1e-3 * static_cast<double>(first), fired_s + 0.041) << "two simulation steps";
  EXPECT_LT(back, -0.3);
  EXPECT_GT(forth, 0.3);
}

/// Fires in a replay where the recording did.
class FireAgain final : public session::StepListener {
public:
  FireAgain(procedures::Procedure& biopsy, std::uint64_t haptic_step) : biopsy_(biopsy), step_(haptic_step) {}
  void simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport&,
                          const physics::TissueState&, const physics::NeedleState&) override {
    procedures::Events events;
    if (record.needle_step == step_) biopsy_.act(procedures::biopsy::kFire, {.in_tissue = true}, events);
  }

private:
  procedures::Procedure& biopsy_;
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
    if (training.tip_tissue() > 0) tissues.insert(scene.tissues[training.tip_tissue()].name);
  });
  const recording::Recording recording = recording::read_recording(folder / "biopsy");
  EXPECT_TRUE(recording.complete());
  EXPECT_THAT(tissues, testing::IsSupersetOf({"fat", "muscle", "liver", "tumour"}));
  EXPECT_THAT(flow_events(recording),
              ElementsAre("stage procedure", "biopsy_fired 1", "stage sampling", "stage debrief"));
  ASSERT_EQ(biopsy_of(training).cores().size(), 1u);
  const procedures::biopsy::Core& core = biopsy_of(training).cores()[0];
  std::printf("core at %.2f s: %.0f %% tumour\n", core.time_s, 100 * core.target_share);
  // From near the middle of a ball of 10 mm: 10 of its 17 mm.
  EXPECT_GT(core.target_share, 0.4);
  EXPECT_LT(core.target_share, 0.85);
  const std::vector<Metric> metrics = measure({.events = recording.events}, scene);
  EXPECT_NEAR(find_metric(metrics, "tumour_content").value.value(), 100 * core.target_share, 0.01);

  const session::RecordedSettings settings = session::recorded_settings(recording);
  session::StepHash hash;
  const auto again_biopsy = procedures::kind_of(scene.exercise)->begin(scene);
  ProcedureWatch watch(scene, again_biopsy.get());
  FireAgain again(*again_biopsy, core.haptic_step);
  ReplayedProcedure replayed(scene, recording.events);
  session::CoupledLoops loops(scene, settings.coupling, settings.start, {&hash, &again, &watch, &replayed},
                              settings.base);
  EXPECT_TRUE(session::replay(recording, loops, hash).identical());
  state::FrameState live_frame, frame;
  training.show(live_frame);
  ASSERT_EQ(live_frame.cores.size(), 1U);
  replayed.show_at(core.time_s - 0.01, frame);
  EXPECT_TRUE(frame.cores.empty());
  replayed.show_at(core.time_s, frame);
  ASSERT_EQ(frame.cores.size(), 1U);
  EXPECT_EQ(frame.cores[0].from, live_frame.cores[0].from);
  EXPECT_EQ(frame.cores[0].to, live_frame.cores[0].to);
  EXPECT_NEAR(frame.cores[0].target_share, live_frame.cores[0].target_share, 1e-6);
  EXPECT_EQ(frame.cores[0].fired_s, live_frame.cores[0].fired_s);
  EXPECT_EQ(frame.cores[0].throw_length, live_frame.cores[0].throw_length);
  const auto target_area = [](const state::CoreTrack& track) {
    double area = 0;
    for (const state::CorePiece& piece : track.pieces) {
      if (piece.target) area += (piece.to - piece.from) * (piece.high - piece.low);
    }
    return area;
  };
  EXPECT_NEAR(target_area(live_frame.cores[0]), core.target_share, 1e-6) << "the strip shows what scores";
  EXPECT_NEAR(target_area(frame.cores[0]), core.target_share, 1e-6) << "and so does that of the replay";
  state::FrameState kept;
  training.shown().show_at(core.time_s - 1e-3, kept);
  EXPECT_TRUE(kept.cores.empty());
  training.shown().show_at(core.time_s, kept);
  EXPECT_EQ(kept.cores.size(), 1U) << "from the moment on that it was fired";
  procedures::Events events;
  again_biopsy->catch_up(watch.latest().now, events);
  ASSERT_EQ(dynamic_cast<const procedures::biopsy::Biopsy&>(*again_biopsy).cores().size(), 1u);
  const procedures::biopsy::Core& cut = dynamic_cast<const procedures::biopsy::Biopsy&>(*again_biopsy).cores()[0];
  EXPECT_EQ(cut.content, core.content);
  EXPECT_EQ(cut.time_s, core.time_s);
}

TEST(TrainingSession, PausesTheLoopsAndGivesTheReasonForNotFiring) {
  const content::Scene scene = biopsy_scene(false);
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
  act({Action::start, procedures::biopsy::kFire});
  EXPECT_THAT(training.state().refusal, HasSubstr("outside the patient"));
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
  EXPECT_THAT(flow_events(recording),
              ElementsAre("stage procedure", HasSubstr("refused fire: the tip is outside the patient"), "paused",
                          "resumed", "reset", "stage debrief"));
}

TEST(TrainingSession, ButtonOfTheMotionHeatsAndTheZoneIsOnRecord) {
  content::Scene scene = tests::layered_scene();
  plan_ablation(scene, 60, 120);
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
  ASSERT_TRUE(heating_of(training).outcome());
  const procedures::ablation::Outcome result = *heating_of(training).outcome();
  EXPECT_NEAR(result.heated_s, 60, 3);
  EXPECT_GT(result.volume, 0.2e-6);
  EXPECT_GT(result.coverage.tumour, 0.02);
  std::string told;
  const recording::Recording recording = recording::read_recording(folder / "ablation");
  for (const recording::EventRecord& event : recording.events) {
    if (event.name == procedures::ablation::kAblatedEvent) told = procedures::ablation::in_words(event);
  }
  std::printf("%s\n", told.c_str());
  EXPECT_THAT(told, HasSubstr(" ml; target "));
  const std::vector<Metric> metrics = measure({.events = recording.events}, scene);
  EXPECT_NEAR(find_metric(metrics, "ablation_coverage").value.value(), 100 * result.coverage.with_margin, 0.01);
}

/// A zone that listens to a replay.
struct ReplayedZone final : session::StepListener {
  ReplayedZone(const content::Scene& scene, std::span<const recording::EventRecord> events)
      : zone(scene, events), reader(scene), now(reader.situation()) {}
  void simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport& report,
                          const physics::TissueState& tissue, const physics::NeedleState& needle) override {
    if (needle.node_count < 2) return;
    const procedures::Step step = reader.read(record, report, tissue, needle, now);
    zone.observe(step, now);
  }
  procedures::ablation::ZoneReplay zone;
  StepReader reader;
  procedures::Situation now;
};

// Film and stills show what the session did: from the events and the needle of its recording alone.
TEST(TrainingSession, ZoneOfTheReplayIsTheSessions) {
  content::Scene scene = tests::layered_scene();
  plan_ablation(scene, support::kSanitized ? 20 : 60, 150, true);
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
  state::FrameState frame;
  live.run_in_lockstep([&](double share) {
    share < 1 ? (void)training.poll(live) : training.end(live);
    training.show(frame);
    if (heating_of(training).outcome() && at_stop.version == 0) at_stop = *frame.zone;
  });
  ASSERT_TRUE(heating_of(training).outcome());
  const double told_volume = heating_of(training).outcome()->volume;
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
  std::printf("%.2f ml drawn, %.2f ml told\n", 1e6 * volume, 1e6 * told_volume);
  EXPECT_NEAR(volume, told_volume, 0.5 * procedures::ablation::Ablation::kCell * area);

  const recording::Recording recording = recording::read_recording(folder / "zone");
  const session::RecordedSettings settings = session::recorded_settings(recording);
  session::StepHash hash;
  ReplayedZone replayed(scene, recording.events);
  EXPECT_EQ(replayed.zone.zone_at(3), nullptr) << "not so far yet";
  session::CoupledLoops loops(scene, settings.coupling, settings.start, {&hash, &replayed}, settings.base);
  ASSERT_TRUE(session::replay(recording, loops, hash).identical());
  double start_s = 0, stop_s = 0;
  for (const recording::EventRecord& event : recording.events) {
    if (event.name == procedures::ablation::kStartedEvent) start_s = event.time_s;
    if (event.name == procedures::ablation::kStoppedEvent) stop_s = event.time_s;
  }
  EXPECT_EQ(replayed.zone.zone_at(start_s - 0.01), nullptr);
  const auto expect_as_at_stop = [&] {
    const auto zone = replayed.zone.zone_at(stop_s);
    ASSERT_NE(zone, nullptr);
    EXPECT_EQ(zone->surface.positions, at_stop.surface.positions);
    EXPECT_EQ(zone->surface.body, at_stop.surface.body);
    EXPECT_EQ(zone->gas, at_stop.gas);
    EXPECT_EQ(zone->dose, at_stop.dose);
    EXPECT_EQ(replayed.zone.ablation()->volume(), told_volume);
  };
  expect_as_at_stop();
  const float most_gas = *std::ranges::max_element(at_stop.gas);
  EXPECT_GT(most_gas, 0.9F);
  const auto later = replayed.zone.zone_at(stop_s + 0.5);
  EXPECT_NEAR(*std::ranges::max_element(later->gas),
              most_gas * std::exp(-75 / procedures::ablation::Ablation::kGasLasts), 0.01);
  EXPECT_EQ(later->dose, at_stop.dose) << "what is dead stays so";
  const auto half = replayed.zone.zone_at((start_s + stop_s) / 2);
  EXPECT_LT(replayed.zone.ablation()->volume(), told_volume);
  EXPECT_LT(half->surface.positions.size(), at_stop.surface.positions.size());
  expect_as_at_stop();  // once more, after going back
}

TEST(TrainingSession, ZoneOfAHostileRecordingEnds) {
  content::Scene scene = tests::layered_scene();
  plan_ablation(scene, 5, 0.1);
  const support::TemporaryFolder folder;
  haptic::RecordedDevice device = session::recorded_stylus(scene.motion);
  session::LiveSession live(scene, device, {.duration_s = 0.1, .lockstep = true, .recording = folder / "short"});
  live.run_in_lockstep();
  const recording::Recording recording = recording::read_recording(folder / "short");
  const recording::SimulationStepRecord& seen = recording.simulation.back();
  const std::vector<recording::EventRecord> events{
      tests::version_1_event(seen.time_s, seen.needle_step, "ablation_started", ""),
      tests::version_1_event(seen.time_s, seen.needle_step, "ablation_stopped", "1e300 s"),
      tests::version_1_event(seen.time_s, seen.needle_step, "ablated", "1e300 s, nan ml")};
  const session::RecordedSettings settings = session::recorded_settings(recording);
  session::StepHash hash;
  ReplayedZone replayed(scene, events);
  session::CoupledLoops loops(scene, settings.coupling, settings.start, {&hash, &replayed}, settings.base);
  ASSERT_TRUE(session::replay(recording, loops, hash).identical());
  ASSERT_NE(replayed.zone.zone_at(1e6), nullptr);
  EXPECT_NEAR(replayed.zone.ablation()->heated_s(), 11, 1);
}

class AblationInLayers : public ::testing::Test {
protected:
  AblationInLayers() {
    scene_ = tests::layered_scene();
    plan_ablation(scene_, 720, 60);
    centre_ = scene_.targets[0].centre;
  }
  procedures::ablation::Electrode electrode() const {
    return {.tip = centre_ - Eigen::Vector3d(0, 0, 0.015), .base = centre_ + Eigen::Vector3d(0, 0, 0.015)};
  }
  static constexpr double kHeated = support::kSanitized ? 120 : 720;

  content::Scene scene_;
  Eigen::Vector3d centre_;
};

TEST_F(AblationInLayers, ZoneDoesNotDependOnHowOftenItIsAsked) {
  procedures::ablation::Ablation one(scene_, electrode(), 0);
  one.heat_to(90);
  procedures::ablation::Ablation two(scene_, electrode(), 0);
  for (double t = 0; t <= 90; t += 0.37) two.heat_to(t);
  two.heat_to(90.4);
  EXPECT_EQ(one.field().temperature(), two.field().temperature());
  EXPECT_EQ(one.field().dose(), two.field().dose());
  EXPECT_EQ(one.heated_s(), 90);
}

TEST_F(AblationInLayers, CoverageGrowsAndIsLessBesideAVessel) {
  procedures::ablation::Ablation free(scene_, electrode(), 0);
  EXPECT_EQ(free.coverage().tumour, 0);
  EXPECT_TRUE(free.zone().triangles.empty());
  free.heat_to(kHeated / 4);
  const procedures::ablation::AblationCoverage early = free.coverage();
  free.heat_to(kHeated);
  const procedures::ablation::AblationCoverage late = free.coverage();
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
  procedures::ablation::Ablation beside(veined, electrode(), 0);
  beside.heat_to(kHeated);
  std::printf("tumour %.2f, with margin %.2f; beside a vein %.2f, %.2f\n", late.tumour, late.with_margin,
              beside.coverage().tumour, beside.coverage().with_margin);
  EXPECT_LT(beside.coverage().with_margin, late.with_margin);
  EXPECT_LT(beside.volume(), free.volume());
}

TEST_F(AblationInLayers, SurfaceIsClosedOutwardAndRidesOnItsBody) {
  procedures::ablation::Ablation ablation(scene_, electrode(), 0);
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
