// A session in lockstep, in threads, and replayed.
#include "engine/files/error.h"
#include "engine/session/frame_clock.h"
#include "engine/session/frame_publisher.h"
#include "engine/session/live_session.h"
#include "engine/session/lockstep.h"
#include "engine/session/recorded_stylus.h"
#include "engine/session/replay.h"
#include "engine/session/session_report.h"
#include "engine/session/step_hash.h"
#include "haptic/paced_loop.h"
#include "tests/session/cube_scene.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <span>
#include <string>
#include <thread>
#include <vector>

namespace stylet::session {
namespace {

struct Outcome {
  std::uint64_t hash = 0;
  double peak_force = 0;
  double closest = 0;
  RunStatistics run;
};

enum class Mode { lockstep, threaded };

// Runs the cube scene and records it.
Outcome record(const content::Scene& scene, const std::filesystem::path& path, Mode mode, double duration_s,
               physics::Coupling coupling = physics::Coupling::paper_updated) {
  haptic::RecordedDevice device = recorded_stylus(scene.motion);
  LiveSession session(scene, device,
                      {.coupling = coupling,
                       .duration_s = duration_s,
                       .lockstep = mode == Mode::lockstep,
                       .recording = path,
                       .build = "test"});
  Outcome outcome;
  if (mode == Mode::threaded) {
    session.start();
    session.wait();
    outcome.run = session.stop();
  } else {
    outcome.run = session.run_in_lockstep();
  }
  outcome.hash = session.state_hash();
  outcome.peak_force = session.force().summary().peak_force;
  outcome.closest = session.closest_target_distance();
  return outcome;
}

std::pair<ReplayResult, std::uint64_t> replay_file(const content::Scene& scene,
                                                   const recording::Recording& recording) {
  const RecordedSettings settings = recorded_settings(recording);
  EXPECT_EQ(settings.haptic_hz, scene.rates.haptic_hz);
  StepHash hash;
  CoupledLoops loops(scene, settings.coupling, settings.start, {&hash}, settings.base);
  ReplayResult result = replay(recording, loops, hash);
  return {std::move(result), hash.state()};
}

TEST(Lockstep, TwoRunsGiveTheSameBits) {
  const content::Scene scene = tests::cube_scene();
  const support::TemporaryFolder folder;
  const Outcome one = record(scene, folder / "one", Mode::lockstep, 0.8);
  const Outcome two = record(scene, folder / "two", Mode::lockstep, 0.8);
  EXPECT_EQ(one.hash, two.hash);
  EXPECT_GT(one.run.factorisations, 2u);
}

TEST(Lockstep, NeedleBendsTheTissueAndTheHandFeelsIt) {
  const content::Scene scene = tests::cube_scene();
  const support::TemporaryFolder folder;
  const Outcome outcome = record(scene, folder / "force", Mode::lockstep, 0.8);
  EXPECT_GT(outcome.peak_force, 0.02) << "a 4 mm swing of an 18G needle in 10 kPa gel";
  EXPECT_LT(outcome.peak_force, 10.0);
  EXPECT_LT(outcome.closest, 0.010) << "the tip ends 5 mm above the target";
  EXPECT_EQ(outcome.run.needle_flags & physics::kNeedleSolveFailed, 0u);
}

// A column that does not bulge: its nodes sink by rho g (H z - z^2 / 2) / E, rho g H^2 / (3 E) in the mean.
TEST(Weight, OfABodyIsThatOfItsTissues) {
  constexpr double kHeight = 0.1, kGravity = 9.81;
  content::Scene scene = tests::cube_scene();
  scene.gravity = {0, 0, -kGravity};
  scene.tissues[1].mechanics = {.young_modulus = 10e3, .poisson_ratio = 0};
  scene.bodies[0] = tests::box_body("column", {0, 0, 0}, {0.05, 0.05, kHeight}, {3, 3, 6});
  tests::hold(scene.bodies[0], [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
  physics::StylusPose away;
  away.position = {0, 0, 1};
  CoupledLoops loops(scene, physics::Coupling::stylet, away, {});
  physics::TissuePatch patch = loops.make_patch();
  for (int step = 0; step < 60; ++step) {
    loops.simulation_step(step / scene.rates.simulation_hz, loops.needle(), true, true, patch);
    loops.worker().step();
  }
  const physics::TetMesh& mesh = scene.bodies[0].mesh;
  double sunk = 0;  // the tetrahedra are of one size
  for (const auto& tet : mesh.tets) {
    for (const int node : tet) {
      const double z = mesh.nodes[node].z();
      sunk += (z - loops.tissue().positions[0](2, node)) / (4.0 * static_cast<double>(mesh.tets.size()));
    }
  }
  const double exact = scene.tissues[1].density * kGravity * kHeight * kHeight / (3 * 10e3);
  std::printf("sinks by %.4f mm in the mean, exact %.4f mm\n", 1e3 * sunk, 1e3 * exact);
  EXPECT_NEAR(sunk, exact, 0.02 * exact);
}

TEST(Couplings, AreFoundByTheirNames) {
  for (const char* name : {"stylet", "paper-updated", "paper-trajectory", "paper-frozen"}) {
    EXPECT_STREQ(coupling_name(coupling_from_name(name)), name);
  }
  EXPECT_THROW(coupling_from_name("spring"), files::ContentError);
}

TEST(Lockstep, CouplingsDiffer) {
  const content::Scene scene = tests::cube_scene();
  const support::TemporaryFolder folder;
  const Outcome updated = record(scene, folder / "updated", Mode::lockstep, 0.4);
  const Outcome frozen = record(scene, folder / "frozen", Mode::lockstep, 0.4, physics::Coupling::paper_frozen);
  const Outcome stylet = record(scene, folder / "stylet", Mode::lockstep, 0.4, physics::Coupling::stylet);
  EXPECT_NE(updated.hash, frozen.hash);
  EXPECT_NE(updated.hash, stylet.hash);
}

TEST(Pause, LoopsAndTimeStandAndTheRecordingReplaysBitForBit) {
  const content::Scene scene = tests::cube_scene(5);
  const support::TemporaryFolder folder;
  haptic::RecordedDevice device = recorded_stylus(scene.motion);
  LiveSession session(
      scene, device,
      {.coupling = physics::Coupling::stylet, .duration_s = 0.9, .recording = folder / "paused", .build = "test"});
  const auto until = [&](double time_s) {
    while (session.time_s() < time_s) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  };
  haptic::MonotonicClock clock;
  const std::int64_t began_ns = clock.now_ns();
  session.start();
  const double early_s = session.time_s();
  const std::int64_t early_ns = clock.now_ns();
  const double later_s = session.time_s();
  int pauses = 0;
  for (const double at : {0.3, 0.6}) {
    until(at);
    session.pause();
    session.pause();
    const double stands = session.time_s();
    EXPECT_NEAR(session.time_of(clock.now_ns()), stands, 1e-6);
    session.add_event({.time_s = stands, .name = "paused"});
    std::this_thread::sleep_for(std::chrono::milliseconds(120));
    EXPECT_TRUE(session.paused());
    EXPECT_EQ(session.time_s(), stands);
    const double newest = session.frames().newest_s();
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    EXPECT_EQ(session.frames().newest_s(), newest) << "three simulation steps long nothing happened";
    const std::int64_t in_the_pause_ns = clock.now_ns();
    session.resume();
    session.add_event(
        {.time_s = session.time_s(), .name = "resumed", .fields = {{"number", std::int64_t{++pauses}}}});
    EXPECT_FALSE(session.paused());
    EXPECT_NEAR(session.time_of(in_the_pause_ns), stands, 1e-9);
    const double before_s = session.time_s();
    const double now_s = session.time_of(clock.now_ns());
    EXPECT_GE(now_s, before_s);
    EXPECT_LE(now_s, session.time_s());
  }
  EXPECT_LT(session.time_of(began_ns), 0) << "before the start";
  EXPECT_GE(session.time_of(early_ns), early_s) << "the pauses came later";
  EXPECT_LE(session.time_of(early_ns), later_s);
  session.wait();
  EXPECT_GE(static_cast<double>(clock.now_ns() - began_ns) * 1e-9, 0.9 + 2 * 0.18) << "time stood in the pauses";
  session.stop();
  const recording::Recording recording = recording::read_recording(folder / "paused");
  ASSERT_TRUE(recording.complete()) << recording.condition();
  std::string seen;
  for (const recording::EventRecord& event : recording.events) {
    if (event.name == "paused" || event.name == "resumed")
      seen += event.name + (event.number("number") ? std::to_string(static_cast<int>(*event.number("number"))) : "") +
              " ";
  }
  EXPECT_EQ(seen, "paused resumed1 paused resumed2 ");
  double last_s = -1;
  for (const recording::HapticStepRecord& step : recording.haptic) {
    ASSERT_GE(step.time_s, last_s);
    last_s = step.time_s;
  }
  EXPECT_LT(last_s, 0.9);
  const auto [result, hash] = replay_file(scene, recording);
  EXPECT_TRUE(result.identical());
  EXPECT_EQ(hash, session.state_hash());
}

/// A hand that rests until there is tissue, then goes in at 0.9 m/s and sideways: no axis points at where it will be.
class StartledHand final : public haptic::Device, public StepListener {
public:
  explicit StartledHand(const content::Scene& scene) : length_(scene.needle.length) {}
  std::string name() const override { return "startled"; }
  haptic::DeviceLimits limits() const override { return {}; }
  haptic::StylusSample read(double now_s) override {
    const double t = tissue_since_ < 0 ? 0 : std::clamp(now_s - tissue_since_, 0.0, 0.09);
    haptic::StylusSample sample;
    sample.time_s = now_s;
    sample.orientation = Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX());
    sample.position = Eigen::Vector3d(0.3 * t, 0, kTop + kBefore + length_ - 0.9 * t);
    sample.valid = true;
    return sample;
  }
  void write(const Eigen::Vector3d&, const Eigen::Vector3d&) override {}
  void haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState& needle) override {
    if (record.patch_epoch == 0) return;
    if (tissue_since_ < 0) tissue_since_ = record.time_s;
    const double depth = kTop - needle.positions(2, needle.node_count - 1);
    if (needle.tip == physics::TipState::outside) untouched_ = std::max(untouched_, depth);
    deepest_ = std::max(deepest_, depth);
  }
  double untouched() const { return untouched_; }
  double deepest() const { return deepest_; }

private:
  static constexpr double kTop = 0.1;      // m, of the cube
  static constexpr double kBefore = 0.03;  // m, the tip before the skin at first
  double length_;
  double tissue_since_ = -1;  // haptic thread's, as the rest
  double untouched_ = -1;
  double deepest_ = -1;
};

// However late the machine is: the hub goes on by 1 mm a step at most, and a patch has all of the skin.
TEST(FastHand, MeetsTheSkinInThreadsAndInLockstep) {
  content::Scene scene = tests::cube_scene();
  scene.rates.simulation_hz = 25;
  const support::TemporaryFolder folder;
  for (const Mode mode : {Mode::threaded, Mode::lockstep}) {
    StartledHand hand(scene);
    LiveSession session(scene, hand,
                        {.coupling = physics::Coupling::stylet,
                         .duration_s = 1,
                         .lockstep = mode == Mode::lockstep,
                         .recording = folder / (mode == Mode::lockstep ? "lockstep" : "threaded"),
                         .build = "test",
                         .listeners = {&hand}});
    if (mode == Mode::threaded) {
      session.start();
      session.wait();
      session.stop();
    } else {
      session.run_in_lockstep();
    }
    if (hand.deepest() < 0.01) GTEST_SKIP() << "no patch within a second";
    std::printf("%.2f mm deep, %.2f mm of it untouched\n", 1e3 * hand.deepest(), 1e3 * hand.untouched());
    EXPECT_LE(hand.untouched(), 1.01e-3);
  }
}

TEST(SessionReport, TellsWhatCameTooLateToBeFelt) {
  SessionReport report;
  report.run.unresolved.add(physics::kNeedlePatchLeft);
  report.run.unresolved.add(physics::kNeedlePatchLeft | physics::kNeedleSurfaceLate);
  report.run.unresolved.add(physics::kNeedleBaseLimited);
  const nlohmann::ordered_json json = to_json(report)["unresolved"];
  EXPECT_EQ(json["haptic_steps_beyond_patch"], 2);
  EXPECT_EQ(json["surfaces_felt_late_or_not"], 1);
}

class EachCoupling : public ::testing::TestWithParam<physics::Coupling> {};

TEST_P(EachCoupling, LockstepRecordingReplaysBitForBit) {
  const content::Scene scene = tests::cube_scene();
  const support::TemporaryFolder folder;
  const auto path = folder / (std::string("lockstep-") + coupling_name(GetParam()));
  const Outcome recorded = record(scene, path, Mode::lockstep, 1.4, GetParam());
  EXPECT_EQ(recorded.run.needle_flags, 0u);
  const auto [result, hash] = replay_file(scene, recording::read_recording(path));
  EXPECT_TRUE(result.identical());
  EXPECT_EQ(hash, recorded.hash);
  EXPECT_EQ(result.run.haptic.steps, recorded.run.haptic.steps);
}

TEST_P(EachCoupling, ThreadedRecordingReplaysBitForBit) {
  const content::Scene scene = tests::cube_scene();
  const support::TemporaryFolder folder;
  const auto path = folder / (std::string("threaded-") + coupling_name(GetParam()));
  const Outcome recorded = record(scene, path, Mode::threaded, 1.4, GetParam());
  const recording::Recording recording = recording::read_recording(path);
  ASSERT_TRUE(recording.complete()) << recording.condition();
  EXPECT_EQ(recording.haptic.size(), recorded.run.haptic.steps);
  const auto [result, hash] = replay_file(scene, recording);
  ASSERT_GT(result.compared, 4u);
  ASSERT_FALSE(result.divergence) << "step " << result.divergence->step;
  EXPECT_EQ(hash, recorded.hash);
}

INSTANTIATE_TEST_SUITE_P(Session, EachCoupling,
                         ::testing::Values(physics::Coupling::stylet, physics::Coupling::paper_updated,
                                           physics::Coupling::paper_trajectory, physics::Coupling::paper_frozen),
                         [](const auto& tested) {
                           std::string name = coupling_name(tested.param);
                           std::erase(name, '-');
                           return name;
                         });

TEST(Replay, SeesAChangedInput) {
  const content::Scene scene = tests::cube_scene();
  const support::TemporaryFolder folder;
  const auto path = folder / "changed";
  record(scene, path, Mode::lockstep, 0.6);
  recording::Recording recording = recording::read_recording(path);
  recording.haptic[300].pose.position.x() += 1e-12;
  const auto [result, hash] = replay_file(scene, recording);
  ASSERT_TRUE(result.divergence);
  EXPECT_GE(result.divergence->step, result.divergence->loop == recording::LoopName::haptic ? 301u : 15u);
}

// What a killed process leaves ends anywhere, in the middle of what was drained together too.
TEST(Replay, EveryCutOffRecordingReplaysUpToItsLastWholeSteps) {
  const content::Scene scene = tests::cube_scene(3);
  const support::TemporaryFolder folder;
  const auto path = folder / "whole";
  record(scene, path, Mode::threaded, 0.5, physics::Coupling::stylet);
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> text{std::istreambuf_iterator<char>(file), {}};
  const std::span whole(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  for (std::size_t size = whole.size() / 3; size < whole.size(); size += whole.size() / 9) {
    const recording::Recording recording = recording::parse_recording(whole.first(size), "cut");
    const ReplayableSteps steps = replayable_steps(recording);
    EXPECT_LE(recording.haptic.size() - steps.haptic, 40u) << "more than was drained together";
    const auto [result, hash] = replay_file(scene, recording);
    EXPECT_TRUE(result.identical()) << size;
    EXPECT_EQ(result.run.haptic.steps, steps.haptic);
    EXPECT_EQ(result.run.simulation.steps, steps.simulation);
  }
}

// Opened and run, not compared: the same bits are promised for the binary that recorded. To add the file of a new
// version: STYLET_WRITE_RECORDING=FILE.
TEST(Replay, RecordingsOfEarlierVersionsOpenAndRun) {
  const content::Scene scene = tests::cube_scene(4);
  if (const char* path = std::getenv("STYLET_WRITE_RECORDING")) {
    record(scene, path, Mode::lockstep, 0.6, physics::Coupling::stylet);
  }
  const std::filesystem::path folder = std::filesystem::path(STYLET_SOURCE_DIR) / "tests/session/recordings";
  for (std::uint64_t version = 1; version <= recording::kRecordingVersion; ++version) {
    const recording::Recording recording =
        recording::read_recording(folder / ("version_" + std::to_string(version) + ".rec"));
    EXPECT_TRUE(recording.complete()) << recording.condition();
    EXPECT_EQ(recording.haptic.size(), 600u);
    EXPECT_EQ(recording.simulation.size(), 30u);
    ASSERT_FALSE(recording.events.empty());
    EXPECT_EQ(recording.events.front().name, "puncture");
    EXPECT_EQ(recorded_settings(recording).coupling, physics::Coupling::stylet);
    const auto [result, hash] = replay_file(scene, recording);
    EXPECT_EQ(result.run.haptic.steps, 600u);
    EXPECT_GT(result.compared, 5u);
  }
}

TEST(Replay, RefusesAnImpossibleSchedule) {
  const content::Scene scene = tests::cube_scene();
  const support::TemporaryFolder folder;
  const auto path = folder / "impossible";
  record(scene, path, Mode::lockstep, 0.2);
  recording::Recording recording = recording::read_recording(path);
  recording.simulation[3].needle_step = 100000;
  EXPECT_THROW(replay_file(scene, recording), files::ContentError);
}

TEST(FramePublisher, ShowsTheHeadAndNotTheHandThatHasGivenWay) {
  const content::Scene scene = tests::cube_scene();
  FramePublisher frames(scene);
  CoupledLoops loops(scene, physics::Coupling::stylet, {Eigen::Vector3d::Ones(), Eigen::Quaterniond::Identity()}, {});
  recording::SimulationStepRecord record;
  record.time_s = 0.02;
  record.probe = {{0.1, 0.2, 0.3}, Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitX()))};
  physics::SimulationReport report;
  report.probe.yielded = 0.01;  // along +Z of the probe, -Y of the patient
  frames.simulation_stepped(record, report, loops.tissue(), loops.needle());
  state::FrameState shown = frames.buffer().make_frame();
  frames.buffer().sample(0.02, shown);
  EXPECT_LT((shown.probe_position - Eigen::Vector3f(0.1F, 0.21F, 0.3F)).norm(), 1e-6F);
}

TEST(FrameClock, DrawsEveryFrameOnceAtItsTime) {
  const content::Scene scene = tests::cube_scene();
  haptic::RecordedDevice device = recorded_stylus(scene.motion);
  const haptic::StylusSample first = device.read(0);
  FramePublisher frames(scene);
  std::vector<double> times;
  FrameClock clock(frames, {.frames_per_second = 30, .from_s = 0.1, .to_s = 0.5},
                   [&](int frame, const state::FrameState& state) {
                     EXPECT_EQ(frame, static_cast<int>(times.size()));
                     times.push_back(state.time_s);
                   });
  CoupledLoops loops(scene, physics::Coupling::paper_updated, {first.position, first.orientation}, {&frames, &clock});
  run_lockstep(loops, device, scene, 0.8);
  ASSERT_EQ(times.size(), 13u);  // 0.1 + 12/30 = 0.5
  for (std::size_t i = 0; i < times.size(); ++i) EXPECT_NEAR(times[i], 0.1 + static_cast<double>(i) / 30, 1e-12);
}

}  // namespace
}  // namespace stylet::session
