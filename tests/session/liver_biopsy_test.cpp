// The shipped scenario with its recorded hand: every layer down to the tumour is felt, and the tip gets there.
#include "engine/readers/scenario.h"
#include "engine/session/live_session.h"
#include "engine/session/lockstep.h"
#include "engine/session/puncture_event.h"
#include "engine/session/recorded_stylus.h"
#include "engine/training/training_report.h"
#include "engine/training/training_session.h"
#include "tests/session/target_watch.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace stylet::session {
namespace {

/// Moments at which the axial force breaks by more than `bound`, away from punctures: s.
std::vector<double> breaks(std::span<const figures::ForceSample> samples, std::span<const PunctureEvent> punctures,
                           double bound) {
  constexpr double kAway = 0.020;
  std::vector<double> at;
  for (std::size_t k = 1; k + 1 < samples.size(); ++k) {
    const double t = samples[k].time_s;
    if (!(std::abs(samples[k + 1].axial - 2 * samples[k].axial + samples[k - 1].axial) > bound)) continue;
    if (std::ranges::any_of(punctures, [&](const auto& p) { return std::abs(p.time_s - t) < kAway; })) continue;
    if (at.empty() || t - at.back() > kAway) at.push_back(t);
  }
  return at;
}

TEST(LiverBiopsy, TheRecordedHandFeelsSkinCapsuleAndTumourAndReachesTheTarget) {
  if (support::kSanitized) GTEST_SKIP() << "minutes long with a sanitizer; the layers of layers_test.cpp are not";
  const content::Scene scene = readers::load_scene(readers::find_scenario("liver_biopsy"));
  ASSERT_EQ(scene.coupling, "stylet");
  ASSERT_FALSE(scene.breathing.holds.empty());
  haptic::RecordedDevice device = recorded_stylus(scene.motion);
  const support::TemporaryFolder folder;
  const auto path = folder / "liver_biopsy.rec";
  const double duration = scene.motion.stylus.back().time_s;
  training::TraceRecorder trace(scene, duration);
  training::TrainingSession course(scene, {.automatic = true});
  LiveSession session(scene, device,
                      {.duration_s = duration,
                       .lockstep = true,
                       .recording = path,
                       .build = "test",
                       .listeners = {&trace, &course.watch()}});
  std::vector<std::string> prompts;
  const RunStatistics run = session.run_in_lockstep([&](double share) {
    share < 1 ? (void)course.poll(session) : course.end(session);
    const std::string& prompt = course.state().prompt;
    if (prompts.empty() || prompts.back() != prompt) prompts.push_back(prompt);
  });
  EXPECT_EQ(run.needle_flags, 0U);
  EXPECT_EQ(run.patch_flags, 0U);
  // The capsule gives way at once: the tissue's way back is longer than one step may be.
  EXPECT_EQ(run.simulation_flags & ~std::uint32_t{physics::kSimulationStepLimited}, 0U);

  const training::TrainingReport report = training::assess(trace.take(recording::read_recording(path).events), scene);
  std::printf("%s%s", training::summary(report.metrics, {}).c_str(), training::in_words(report).c_str());
  ASSERT_TRUE(report.score);
  EXPECT_TRUE(report.score->passed);
  EXPECT_GT(report.score->total, 95) << "an expert's hand, which follows the briefing";
  for (const std::string& prompt : prompts) std::printf("%s\n", prompt.c_str());
  EXPECT_EQ(prompts.size(), std::set(prompts.begin(), prompts.end()).size()) << "no prompt comes back";
  const auto value = [&](std::string_view key) {
    return training::find_metric(std::span<const training::Metric>(report.metrics), key).value.value_or(NAN);
  };
  EXPECT_EQ(value("forbidden_hits"), 0);
  EXPECT_EQ(value("punctures"), 1);
  EXPECT_EQ(value("skin_contacts"), 1);
  EXPECT_GT(value("tumour_content"), 90);
  EXPECT_LT(value("throw_beyond"), 5);
  EXPECT_NEAR(value("targeting"), 1e3 * session.closest_target_distance(), 0.2) << "it fires at its deepest";
  EXPECT_NEAR(value("peak_force"), session.force().summary().peak_force, 0.5) << "seen once a simulation step";
  EXPECT_LT(value("path_inefficiency"), 5);
  EXPECT_LT(value("angle_error"), 2);
  EXPECT_GT(value("needle_in_beam"), 30);
  const std::vector<PunctureEvent> felt = punctures(recording::read_recording(path).events);
  auto from = felt.begin();
  double deepest = -1;
  for (const char* layer : {"skin", "fat", "muscle", "liver", "tumour"}) {
    const auto at = std::find_if(from, felt.end(), [&](const PunctureEvent& p) { return p.to == layer; });
    ASSERT_NE(at, felt.end()) << layer << " was not broken through after what lies before it";
    EXPECT_GT(at->time_s, deepest);
    deepest = at->time_s;
    from = at;
    std::printf("%-8s at %.2f s, %.2f N\n", layer, at->time_s, at->force_n);
  }
  EXPECT_GT(felt.front().time_s, scene.breathing.holds[0][0]) << "while the breath is held";
  const figures::ForceSummary force = session.force().summary();
  std::printf("peak %.2f N; tip %.1f mm from the target's centre\n", force.peak_force,
              1e3 * session.closest_target_distance());
  EXPECT_GT(force.peak_axial, 2);  // what 18G needles are felt with, skin and 60 mm of tissue: 2 to 6 N
  EXPECT_LT(force.peak_force, 6);
  // What the tip cuts through differs from one tetrahedron to the next, and that is not felt as a blow: only that the
  // wall ends is, where there is no more to cut, before the liver is touched.
  std::vector<double> blows = breaks(session.force().samples(), felt, 0.15);
  const auto fires = std::ranges::find(scene.motion.stylus, 1U, &content::MotionSample::buttons);
  std::erase_if(blows, [&](double t) { return t > fires->time_s; });  // drawn out, it leaves the liver
  for (const double t : blows) std::printf("the force breaks at %.3f s\n", t);
  ASSERT_EQ(blows.size(), 1U);
  const auto liver = std::ranges::find(felt, std::string("liver"), &PunctureEvent::to);
  EXPECT_EQ(liver->from, "outside");
  EXPECT_LT(blows.front(), liver->time_s);
  EXPECT_LT(session.closest_target_distance(), scene.targets.front().radius) << "in it";
  EXPECT_GT(session.closest_target_distance(), 0.5 * scene.targets.front().radius) << "at its edge";
  EXPECT_GT(value("lateral_bending"), 0.1) << "the bevel turns it aside";
  EXPECT_LT(value("lateral_bending"), 3) << "held straight";
  ASSERT_TRUE(session.probe());
  const ProbeSummary probe = *session.probe();
  std::printf("probe: %.2f N (at most %.2f) on %.1f cm2 (at least %.1f)\n", probe.mean_force, probe.peak_force,
              1e4 * probe.mean_area, 1e4 * probe.least_area);
  EXPECT_GT(probe.least_area, 1e-4) << "the image is never lost";
  EXPECT_GT(probe.mean_force, 1);  // sonographers press with 2 to 20 N
  EXPECT_LT(probe.peak_force, 20);
}

TEST(LiverBiopsy, TheTargetGoesWithTheBreathAndRestsInTheHold) {
  if (support::kSanitized) GTEST_SKIP() << "minutes long with a sanitizer; breathing_test.cpp is not";
  const content::Scene scene = readers::load_scene(readers::find_scenario("liver_biopsy"));
  ASSERT_EQ(scene.breathing.holds.size(), 1U);
  const auto [from, to] = scene.breathing.holds[0];
  EXPECT_GT(to, scene.motion.stylus.back().time_s);
  tests::TargetWatch watch(scene);
  physics::StylusPose away;  // no needle
  away.position = {0, 0, 1};
  CoupledLoops loops(scene, physics::Coupling::stylet, away, {&watch});
  physics::TissuePatch patch = loops.make_patch();
  const int steps = static_cast<int>(std::lround((from + 0.5) * scene.rates.simulation_hz));
  for (int step = 0; step < steps; ++step) {
    loops.simulation_step(step / scene.rates.simulation_hz, loops.needle(), true, true, patch);
    if (step % kLockstepFactorisationSteps == 0) loops.worker().step();
  }
  const double largest = watch.largest(), held = watch.largest_from(from);
  double support = 0;  // what the diaphragm moves by
  for (const Eigen::Vector3d& motion : scene.bodies[1].held_motion) support = std::max(support, motion.norm());
  support *= scene.breathing.amplitude;
  std::printf("diaphragm %.1f mm, target %.1f mm, in the hold %.4f mm; overlap of organs up to %.2f mm\n",
              1e3 * support, 1e3 * largest, 1e3 * held, 1e3 * watch.overlap);
  EXPECT_NEAR(largest, support, 0.2 * support);
  EXPECT_GE(largest, 0.010);
  EXPECT_LT(held, 1e-4);
  EXPECT_LT(watch.overlap, 5e-4);
  EXPECT_EQ(watch.flags & ~std::uint32_t{physics::kSimulationStepLimited}, 0U);
}

/// Name of the tissue at a point at rest.
std::string tissue_at(const content::Scene& scene, const Eigen::Vector3d& x) {
  const content::LabelVolume& labels = scene.labels;
  const Eigen::Vector3i v = ((x.cast<float>() - labels.origin) / labels.spacing).array().round().cast<int>();
  if ((v.array() < 0).any() || (v.array() >= labels.size.array()).any()) return scene.tissues[0].name;
  const Eigen::Index index = (Eigen::Index{v.z()} * labels.size.y() + v.y()) * labels.size.x() + v.x();
  return scene.tissues[labels.labels[index]].name;
}

// The needle aimed at a rib, and pushed 3 mm further than there is room.
TEST(LiverBiopsy, ARibInTheWayStopsTheNeedle) {
  if (support::kSanitized) GTEST_SKIP() << "long with a sanitizer; BoneStopsTheNeedleAndBearsItsForce is not";
  constexpr double kSpeed = 0.040, kBeyond = 0.003;
  content::Scene scene = readers::load_scene(readers::find_scenario("liver_biopsy"));
  scene.breathing = {};
  physics::StylusPose hub = scene.motion.stylus.front().pose;
  const Eigen::Vector3d axis = hub.orientation * Eigen::Vector3d::UnitZ();
  const auto rib = std::ranges::find(scene.surfaces, std::string("rib_right_9"), &content::Surface::name);
  ASSERT_NE(rib, scene.surfaces.end());
  const Eigen::Vector3f planned = (hub.position + scene.needle.length * axis).cast<float>();
  const auto far = [&](const Eigen::Vector3f& x) { return (x - planned).norm(); };
  const Eigen::Vector3f front = *std::ranges::min_element(rib->positions, {}, far);
  Eigen::Vector3d aim = Eigen::Vector3d::Zero();  // the middle of its section, 20 mm behind its end
  int count = 0;
  for (const Eigen::Vector3f& x : rib->positions) {
    if (std::abs((x - front).norm() - 0.020F) > 0.004F) continue;
    aim += x.cast<double>();
    ++count;
  }
  ASSERT_GT(count, 10);
  aim /= count;
  hub.position = aim - (0.080 + scene.needle.length) * axis;
  const Eigen::Vector3d tip = hub.position + scene.needle.length * axis;
  double skin = 0, bone = 0;
  for (double s = 0; s < 0.15 && bone == 0; s += 2e-4) {
    const std::string tissue = tissue_at(scene, tip + s * axis);
    if (skin == 0 && tissue == "skin") skin = s;
    if (tissue == "bone") bone = s;
  }
  ASSERT_GT(bone, skin + 0.010) << "no rib there";
  const double way = bone + kBeyond - (skin - 0.003);
  scene.motion.stylus.clear();
  for (int k = 0; k <= 100; ++k) {
    const double time = k / 100.0 * way / kSpeed;
    physics::StylusPose pose = hub;
    pose.position += (skin - 0.003 + kSpeed * time) * axis;
    scene.motion.stylus.push_back({.time_s = time, .pose = pose});
  }
  scene.motion.stylus.push_back({.time_s = way / kSpeed + 0.3, .pose = scene.motion.stylus.back().pose});

  haptic::RecordedDevice device = recorded_stylus(scene.motion);
  const support::TemporaryFolder folder;
  const double duration = scene.motion.stylus.back().time_s;
  LiveSession session(scene, device,
                      {.duration_s = duration, .lockstep = true, .recording = folder / "rib.rec", .build = "test"});
  const RunStatistics run = session.run_in_lockstep();
  state::FrameState last = session.frames().make_frame();
  session.frames().sample(duration, last);
  const double depth = (last.needle_positions.back().cast<double>() - tip).dot(axis);
  const figures::ForceSummary force = session.force().summary();
  std::printf("rib %.1f mm behind the skin, tip %.1f mm; peak %.1f N, jump %.2f N; flags %x\n", 1e3 * (bone - skin),
              1e3 * (depth - skin), force.peak_force, force.max_jump, run.needle_flags);
  for (const PunctureEvent& p : punctures(recording::read_recording(folder / "rib.rec").events)) {
    std::printf("%s to %s at %.2f s, %.2f N\n", p.from.c_str(), p.to.c_str(), p.time_s, p.force_n);
    EXPECT_NE(p.to, "bone");
  }
  EXPECT_NEAR(depth, bone, 0.0015);
  EXPECT_GT(force.peak_force, 5);
  EXPECT_LT(force.peak_force, 66);  // what a needle buckles at whose free part is clamped, 120 mm
}

}  // namespace
}  // namespace stylet::session
