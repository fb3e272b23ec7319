// A needle through wall, liver and tumour: what it breaks through, in order, and what the hand feels of it.
#include "engine/session/live_session.h"
#include "engine/session/puncture_event.h"
#include "engine/session/recorded_stylus.h"
#include "engine/session/session_report.h"
#include "tests/session/layered_scene.h"
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

namespace stylet::session {
namespace {

struct Felt {
  std::vector<PunctureEvent> punctures;
  std::vector<figures::ForceSample> force;
  RunStatistics run;
  figures::ForceSummary summary;
  physics::PassivitySummary passivity;
  double closest = 0;
};

Felt feel(content::Scene scene, double haptic_hz, double seconds = 2.0) {
  scene.rates.haptic_hz = haptic_hz;
  haptic::RecordedDevice device = recorded_stylus(scene.motion);
  const support::TemporaryFolder folder;
  const auto path = folder / "layers.rec";
  LiveSession session(scene, device, {.duration_s = seconds, .lockstep = true, .recording = path, .build = "test"});
  Felt felt;
  felt.run = session.run_in_lockstep();
  felt.punctures = punctures(recording::read_recording(path).events);
  felt.force.assign(session.force().samples().begin(), session.force().samples().end());
  felt.summary = session.force().summary();
  felt.passivity = session.passivity();
  felt.closest = session.closest_target_distance();
  return felt;
}

/// Largest and then smallest axial force around a time, N: how much a puncture is felt.
double drop_at(const Felt& felt, double time_s) {
  double before = -100, after = 100;
  for (const figures::ForceSample& s : felt.force) {
    if (s.time_s > time_s - 0.010 && s.time_s <= time_s) before = std::max(before, s.axial);
    if (s.time_s > time_s && s.time_s < time_s + 0.060) after = std::min(after, s.axial);
  }
  return before - after;
}

TEST(Layers, EachIsBrokenThroughInOrderAtItsOwnForce) {
  const Felt felt = feel(tests::layered_scene(), 1000);
  struct Expected {
    const char* from;
    const char* to;
    double force;
    bool dulls;  ///< what lies behind is softer at once: the hand feels it give way
  };
  const Expected expected[] = {{"outside", "skin", 3.0, true},
                               {"skin", "fat", 0.2, false},
                               {"fat", "muscle", 1.2, true},
                               {"outside", "liver", 1.8, true},
                               {"liver", "tumour", 1.5, true}};
  for (const PunctureEvent& p : felt.punctures) {
    std::printf("%-8s to %-8s at %.3f s, %.2f N; the hand feels %.2f N less\n", p.from.c_str(), p.to.c_str(),
                p.time_s, p.force_n, drop_at(felt, p.time_s));
  }
  ASSERT_EQ(felt.punctures.size(), std::size(expected));
  for (std::size_t i = 0; i < std::size(expected); ++i) {
    const PunctureEvent& p = felt.punctures[i];
    EXPECT_EQ(p.from, expected[i].from);
    EXPECT_EQ(p.to, expected[i].to);
    EXPECT_NEAR(p.force_n, expected[i].force, 1e-3) << p.to;
    if (expected[i].dulls) {
      EXPECT_GT(drop_at(felt, p.time_s), 0.15) << p.to;
    }
  }
  EXPECT_EQ(felt.run.needle_flags, 0U);
  EXPECT_LT(felt.closest, tests::kTumourRadius);
}

// The passivity observer. Nothing but the hand moves this patient: what comes back is less than what was put in.
TEST(Layers, AClosedCycleGivesTheHandNoEnergy) {
  content::Scene scene = tests::layered_scene();
  std::vector<content::MotionSample>& way = scene.motion.stylus;
  content::MotionSample out = way.front();  // and 2 mm more
  out.time_s = way.back().time_s + way[1].time_s;
  out.pose.position.z() += 0.002;
  way.push_back(out);
  const Felt felt = feel(scene, 1000, out.time_s);
  double most = 0, least = 0;
  for (const figures::ForceSample& s : felt.force) {
    most = std::max(most, s.work);
    least = std::min(least, s.work);
  }
  std::printf("work of the hand: %.2f mJ at most, %.3e mJ at least, %.2f mJ at the end\n", 1e3 * most, 1e3 * least,
              1e3 * felt.force.back().work);
  EXPECT_GT(most, 5e-3);
  EXPECT_GE(felt.summary.least_work, -1e-9 * most);  // rounding
  EXPECT_EQ(felt.summary.least_work, least);
  // Anew from what is in the file: force and hub; the needle is not turned.
  double work = 0, furthest = 0;
  for (std::size_t i = 1; i < felt.force.size(); ++i) {
    const figures::ForceSample &a = felt.force[i - 1], &b = felt.force[i];
    work -= 0.5 * (a.force + b.force).dot(b.hub - a.hub);
    furthest = std::max(furthest, std::abs(work - b.work));
  }
  EXPECT_LT(furthest, 1e-2 * most);
  // Of every second by itself, and of the way in and out.
  double least_in_a_second = 0;
  for (std::size_t i = 0; i < felt.force.size(); ++i) {
    const double before = felt.force[i - std::min<std::size_t>(i, 1000)].work;
    least_in_a_second = std::min(least_in_a_second, felt.force[i].work - before);
  }
  EXPECT_NEAR(felt.passivity.least_window.work, least_in_a_second, 1e-12);
  ASSERT_GE(felt.passivity.cycles, 1U);
  EXPECT_NEAR(felt.passivity.least_cycle.work, felt.force.back().work, 1e-9) << "all of it: cut and rubbed";
  EXPECT_GT(felt.passivity.least_cycle.work, 0.5 * most);
  const SessionReport report{.force = felt.summary, .passivity = felt.passivity};
  const nlohmann::ordered_json json = to_json(report);
  EXPECT_EQ(json["least_work_j"], felt.summary.least_work);
  EXPECT_EQ(json["passivity"]["least_work_in_a_window_j"], felt.passivity.least_window.work);
  EXPECT_EQ(json["passivity"]["least_work_of_a_cycle_j"], felt.passivity.least_cycle.work);
}

TEST(Layers, AtFourKilohertzTheSameLayersAreFelt) {
  constexpr int kTimes = support::kSanitized ? 2 : 4;
  const Felt slow = feel(tests::layered_scene(), 1000);
  const Felt fast = feel(tests::layered_scene(), 1000 * kTimes);
  ASSERT_EQ(fast.force.size(), kTimes * slow.force.size());
  ASSERT_EQ(fast.punctures.size(), slow.punctures.size());
  for (std::size_t i = 0; i < fast.punctures.size(); ++i) {
    EXPECT_EQ(fast.punctures[i].to, slow.punctures[i].to);
    EXPECT_NEAR(fast.punctures[i].time_s, slow.punctures[i].time_s, 0.010) << fast.punctures[i].to;
  }
}

TEST(Layers, BristlesOnTheShaftAreFelt) {
  content::Scene scene = tests::layered_scene();
  const Felt coulomb = feel(scene, 1000);
  scene.shaft_friction = physics::ShaftFriction::lugre;
  const Felt bristles = feel(scene, 1000);
  ASSERT_EQ(bristles.punctures.size(), coulomb.punctures.size());
  ASSERT_EQ(bristles.force.size(), coulomb.force.size());
  double apart = 0;
  for (std::size_t i = 0; i < bristles.force.size(); ++i) {
    apart = std::max(apart, std::abs(bristles.force[i].axial - coulomb.force[i].axial));
  }
  std::printf("LuGre and Coulomb friction: at most %.3f N apart, peak %.3f N\n", apart, coulomb.summary.peak_force);
  EXPECT_GT(apart, 0.02);
  EXPECT_GE(bristles.summary.least_work, -1e-9);
}

TEST(PunctureEvent, IsReadBackAsItWasWritten) {
  content::Scene scene;
  scene.tissues.resize(2);
  scene.tissues[0].name = "fat";
  scene.tissues[1].name = std::string(300, 'x');  // longer than an event may be
  const support::TemporaryFolder folder;
  {
    recording::RecordingWriter writer(folder / "punctures", {});
    recording::RecordingChannel& channel = writer.haptic();
    add_puncture(channel, 1.5, 3, scene, {.from = 1, .to = 1, .force = 1.25, .energy = 1.5e-3});
    add_puncture(channel, 1.5, 3, scene, {.from = 7, .to = 1, .force = 0.5});  // no such tissue
    channel.add_event(2, 4, kPunctureEvent, {{"to", std::string_view("nowhere")}});
    channel.add_event(2, 4, "buttons", {{"to", std::string_view("b")}, {"force", 1.0, "N"}});
    writer.finish();
  }
  const std::vector<PunctureEvent> read = punctures(recording::read_recording(folder / "punctures").events);
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(read[0].time_s, 1.5);
  EXPECT_EQ(read[0].to.substr(0, 10), "xxxxxxxxxx");
  EXPECT_EQ(read[0].force_n, 1.25);
  EXPECT_EQ(read[1].from, "?");
  EXPECT_EQ(read[1].force_n, 0.5);
  EXPECT_EQ(read[0].energy_j, 1.5e-3);
  const SessionReport report{.punctures = read};
  EXPECT_EQ(to_json(report)["punctures"][0]["force_n"], 1.25);
  EXPECT_EQ(to_json(report)["punctures"][0]["energy_j"], 1.5e-3);
}

TEST(PunctureEvent, OfTheFirstRecordingsIsReadFromItsText) {
  const auto event = [](std::string text) {
    return recording::EventRecord{.time_s = 2, .name = std::string(kPunctureEvent), .fields = {{"detail", text}}};
  };
  const auto whole = puncture_of(event("fat > muscle, 1.2500 N (0.0015 J)"));
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->from, "fat");
  EXPECT_EQ(whole->to, "muscle");
  EXPECT_EQ(whole->force_n, 1.25);
  EXPECT_EQ(whole->energy_j, 0.0015);
  const auto without_energy = puncture_of(event("a > b, 1.5000 N"));
  ASSERT_TRUE(without_energy);
  EXPECT_FALSE(without_energy->energy_j);
  EXPECT_FALSE(puncture_of(event("nonsense")));
}

}  // namespace
}  // namespace stylet::session
