// What of a session is heard, and when: the same while it runs and from what was kept of it.
#include "engine/training/ear.h"

#include "engine/content/breathing.h"
#include "engine/readers/scenario.h"
#include "engine/session/live_session.h"
#include "engine/session/puncture_event.h"
#include "engine/session/recorded_stylus.h"
#include "engine/sound/mixer.h"
#include "engine/training/sound_watch.h"
#include "engine/training/training_session.h"
#include "tests/session/layered_scene.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <iterator>
#include <utility>
#include <vector>

namespace stylet::training {
namespace {

using sound::Cue;
using sound::Sound;

/// Tissue 1 is soft, 2 is bone.
content::Scene two_tissues() {
  content::Scene scene;
  scene.tissues.resize(3);
  scene.tissues[1].mechanics.young_modulus = 10e3;
  scene.tissues[2].mechanics.young_modulus = 1e10;
  return scene;
}

std::vector<double> times_of(const std::vector<Cue>& cues, Sound sound) {
  std::vector<double> times;
  for (const Cue& cue : cues) {
    if (cue.sound == sound) times.push_back(cue.time_s);
  }
  return times;
}

/// Cues of samples 0.02 s apart.
std::vector<Cue> hear(const content::Scene& scene, int count, const auto& sample_of) {
  Ear ear(scene);
  std::vector<Cue> cues;
  for (int i = 0; i < count; ++i) {
    TraceSample sample{.time_s = 0.02 * i, .tip_state = physics::TipState::inside, .tissue = 1};
    sample_of(i, sample);
    ear.step(sample, cues);
  }
  return cues;
}

TEST(Ear, KnocksWhereTheTipMeetsBoneAndDoesNotRattle) {
  const content::Scene scene = two_tissues();
  // Meets it at 0.2 s and stays, is off it and on it again with every step from 1 s to 2 s, then touches no more.
  const std::vector<Cue> cues = hear(scene, 200, [](int i, TraceSample& sample) {
    const bool on = (i >= 10 && i < 40) || (i >= 50 && i < 100 && i % 2 == 0);
    if (on) sample.tissue = 2;
  });
  const std::vector<double> knocks = times_of(cues, Sound::bone);
  ASSERT_GE(knocks.size(), 2U);
  EXPECT_NEAR(knocks.front(), 0.2, 1e-9);
  EXPECT_NEAR(knocks[1], 1.0, 1e-9) << "one while it stays";
  for (std::size_t i = 1; i < knocks.size(); ++i) EXPECT_GE(knocks[i] - knocks[i - 1], Ear::kKnockAgain - 1e-9);
  EXPECT_LT(knocks.back(), 2);
  EXPECT_LE(knocks.size(), 6U);
}

TEST(Ear, KnocksLouderTheFasterTheTipWas) {
  const content::Scene scene = two_tissues();
  const auto strength = [&](double speed) {
    const std::vector<Cue> cues = hear(scene, 20, [&](int i, TraceSample& sample) {
      sample.tip.z() = -speed * 0.02 * i;
      if (i >= 10) sample.tissue = 2;
    });
    const auto knock = std::ranges::find(cues, Sound::bone, &Cue::sound);
    return knock == cues.end() ? -1 : knock->strength;
  };
  EXPECT_GT(strength(0.02), strength(0.005));
  EXPECT_GE(strength(0), 0);
  EXPECT_EQ(strength(1), 1);
}

TEST(Ear, ATipOutsideTouchesNoBone) {
  const content::Scene scene = two_tissues();
  const std::vector<Cue> cues = hear(scene, 20, [](int, TraceSample& sample) {
    sample.tip_state = physics::TipState::outside;
    sample.tissue = 2;
  });
  EXPECT_TRUE(times_of(cues, Sound::bone).empty());
}

TEST(Ear, WarnsOfWhatMustNotBeEnteredAndOfAHardPush) {
  const content::Scene scene = two_tissues();
  const std::vector<Cue> cues = hear(scene, 500, [](int i, TraceSample& sample) {
    const double t = 0.02 * i;
    if (t > 0.99 && t < 2) sample.forbidden = sample.crossed = 1;      // entered and left
    if (i == 150) sample.crossed = 2;                                  // went through between two steps
    if (t > 4.99 && t < 7) sample.force.z() = i % 2 == 0 ? 6.2 : 5.5;  // about the threshold
  });
  const std::vector<double> warnings = times_of(cues, Sound::warning);
  ASSERT_EQ(warnings.size(), 3U);
  EXPECT_NEAR(warnings[0], 1, 0.021);
  EXPECT_NEAR(warnings[1], 3, 0.021);
  EXPECT_NEAR(warnings[2], 5, 0.021);
}

TEST(Ear, BreathesAsThePatientDoes) {
  const content::Scene scene = two_tissues();
  const content::Breathing breathing{.amplitude = 1, .period = 4};
  const std::vector<Cue> cues = hear(scene, 1000, [&](int i, TraceSample& sample) {
    sample.inspiration = content::inspiration(breathing, 0.02 * i);
  });
  std::vector<double> begins;  // of inspirations
  double before = 0;
  for (const Cue& cue : cues) {
    ASSERT_EQ(cue.sound, Sound::breath);
    ASSERT_LE(std::abs(cue.strength), 1);
    if (cue.strength > 0.05 && before <= 0.05) begins.push_back(cue.time_s);
    before = cue.strength;
  }
  ASSERT_EQ(begins.size(), 5U);
  for (std::size_t i = 1; i < begins.size(); ++i) EXPECT_NEAR(begins[i] - begins[i - 1], 4, 0.021);
  const auto strongest = std::ranges::max_element(cues, {}, &Cue::strength);
  EXPECT_LT(strongest->strength, 0.99) << "quiet breathing is not cut";
  EXPECT_GT(strongest->strength, 0.5);
}

TEST(Ear, HearsEventsAsTheirKindsSay) {
  const auto cue = [](const char* name, std::vector<recording::Field> fields = {}) {
    return cue_of(recording::EventRecord{.time_s = 3, .step = 3000, .name = name, .fields = std::move(fields)});
  };
  EXPECT_EQ(cue("biopsy_fired")->sound, Sound::shot);
  EXPECT_EQ(cue("biopsy_fired")->time_s, 3);
  EXPECT_EQ(cue("ablation_started")->strength, 1);
  EXPECT_EQ(cue("ablation_stopped")->strength, 0);
  EXPECT_EQ(cue("ablation_stopped")->sound, Sound::generator);
  EXPECT_EQ(cue("refused", {{"action", "fire"}, {"reason", "no"}})->sound, Sound::warning);
  EXPECT_FALSE(cue("stage", {{"stage", "procedure"}}).has_value());
  const auto soft = cue("puncture", {{"from", "fat"}, {"to", "liver"}, {"force", 0.4, "N"}});
  const auto tough = cue("puncture", {{"from", "outside"}, {"to", "skin"}, {"force", 2.6, "N"}});
  ASSERT_TRUE(soft && tough);
  EXPECT_EQ(soft->sound, Sound::puncture);
  EXPECT_GT(tough->strength, soft->strength);
}

struct Heard {
  std::vector<Cue> live;  ///< as a window would have played it, by time
  std::vector<Cue> kept;  ///< of what a film is made from
  std::vector<session::PunctureEvent> punctures;
};

bool earlier(const Cue& a, const Cue& b) {
  return a.time_s != b.time_s ? a.time_s < b.time_s : a.sound < b.sound;
}

Heard listen(const content::Scene& scene, double duration_s) {
  const support::TemporaryFolder folder;
  haptic::RecordedDevice device = session::recorded_stylus(scene.motion);
  TraceRecorder trace(scene, duration_s);
  TrainingSession course(scene, {.automatic = true});
  SoundWatch watch(scene, trace);
  session::LiveSession live(scene, device,
                            {.duration_s = duration_s,
                             .lockstep = true,
                             .recording = folder / "session.rec",
                             .build = "test",
                             .listeners = {&trace, &course.watch(), &watch}});
  Heard heard;
  live.run_in_lockstep([&](double share) {
    share < 1 ? (void)course.poll(live) : course.end(live);
    const std::vector<Cue>& taken = watch.take();
    heard.live.insert(heard.live.end(), taken.begin(), taken.end());
    for (const recording::EventRecord& event : course.happened()) {
      if (const auto cue = cue_of(event)) heard.live.push_back(*cue);
    }
  });
  std::vector<recording::EventRecord> events = recording::read_recording(folder / "session.rec").events;
  heard.punctures = session::punctures(events);
  heard.kept = cues_of(scene, trace.take(std::move(events)));
  std::ranges::sort(heard.live, earlier);
  std::ranges::sort(heard.kept, earlier);
  return heard;
}

void expect_each_puncture_heard(const Heard& heard, double step_s) {
  const std::vector<double> pops = times_of(heard.live, Sound::puncture);
  ASSERT_EQ(pops.size(), heard.punctures.size());
  for (std::size_t i = 0; i < pops.size(); ++i) EXPECT_NEAR(pops[i], heard.punctures[i].time_s, step_s);
}

void expect_same(const std::vector<Cue>& live, const std::vector<Cue>& kept) {
  ASSERT_EQ(live.size(), kept.size());
  for (std::size_t i = 0; i < live.size(); ++i) {
    EXPECT_EQ(live[i].sound, kept[i].sound) << i;
    EXPECT_EQ(live[i].time_s, kept[i].time_s) << i;
    EXPECT_EQ(live[i].strength, kept[i].strength) << i;
  }
}

TEST(SoundWatch, HearsEveryLayerOnceAndAFilmHearsTheSame) {
  const content::Scene scene = tests::layered_scene();
  const Heard heard = listen(scene, 2);
  ASSERT_GE(heard.punctures.size(), 5U);
  expect_each_puncture_heard(heard, 1 / scene.rates.simulation_hz);
  expect_same(heard.live, heard.kept);
  EXPECT_TRUE(times_of(heard.live, Sound::bone).empty());
}

TEST(SoundWatch, HearsTheTipMeetARibOnce) {
  content::Scene scene = tests::layered_scene();
  content::Tissue bone;
  bone.name = "bone";
  bone.mechanics = {.young_modulus = 1e10, .poisson_ratio = 0.3};
  bone.needle = {.puncture_force = 1e6, .rigid = true};
  scene.tissues.push_back(bone);
  // A plate across the muscle, and a hand that stops 2 mm behind it.
  const double plate = tests::kMuscleSurface - 0.004;
  for (std::size_t i = 0; i < scene.labels.labels.size(); ++i) {
    const double z = 1e-3 * static_cast<double>(i / (81 * 81));
    if (z > plate || z < plate - 0.006) continue;
    scene.labels.labels[i] = static_cast<std::uint8_t>(scene.tissues.size() - 1);
    scene.labels.bodies[i] = -1;
  }
  constexpr double kFrom = tests::kSkinSurface + 0.005, kSpeed = 0.040;
  const content::MotionSample first = scene.motion.stylus.front();
  scene.motion.stylus.clear();
  for (int i = 0; i <= 75; ++i) {
    content::MotionSample sample = first;
    sample.time_s = 0.02 * i;
    sample.pose.position.z() = scene.needle.length + std::max(kFrom - kSpeed * sample.time_s, plate - 0.002);
    scene.motion.stylus.push_back(sample);
  }
  const Heard heard = listen(scene, 1.5);
  expect_same(heard.live, heard.kept);
  const std::vector<double> knocks = times_of(heard.live, Sound::bone);
  ASSERT_EQ(knocks.size(), 1U);
  const double reached = (kFrom - plate) / kSpeed;  // by the hand
  // A voxel is 1 mm; the needle gives, so that the tip is behind the hand by up to a millimeter.
  EXPECT_NEAR(knocks[0], reached, 0.04);
}

TEST(LiverBiopsySound, IsThatOfTheDemonstration) {
  if (support::kSanitized) GTEST_SKIP() << "minutes long with a sanitizer; the layers are not";
  const content::Scene scene = readers::load_scene(readers::find_scenario("liver_biopsy"));
  const double duration_s = scene.motion.stylus.back().time_s;
  const Heard heard = listen(scene, duration_s);
  for (const Cue& cue : heard.live) {
    if (!sound::goes_on(cue.sound))
      std::printf("%.2f s: sound %d, %.2f\n", cue.time_s, static_cast<int>(cue.sound), cue.strength);
  }
  ASSERT_GE(heard.punctures.size(), 4U) << "skin, fascia, capsule, tumour";
  expect_each_puncture_heard(heard, 1 / scene.rates.simulation_hz);
  expect_same(heard.live, heard.kept);
  EXPECT_EQ(times_of(heard.live, Sound::shot).size(), 1U);
  EXPECT_TRUE(times_of(heard.live, Sound::bone).empty()) << "between the ribs";
  EXPECT_TRUE(times_of(heard.live, Sound::warning).empty()) << "an expert";

  // After the last hold the patient has the scenario's period; in a hold there is no breath at all.
  ASSERT_FALSE(scene.breathing.holds.empty());
  const auto [from_s, to_s] = scene.breathing.holds.front();
  const std::vector<float> held = sound::track(
      [&] {
        std::vector<Cue> breath;
        std::ranges::copy_if(heard.live, std::back_inserter(breath),
                             [](const Cue& cue) { return cue.sound == Sound::breath; });
        return breath;
      }(),
      0, duration_s);
  const auto at = [](double s) { return static_cast<std::ptrdiff_t>(s * sound::kRate); };
  EXPECT_TRUE(std::all_of(held.begin() + at(from_s + 0.6), held.begin() + at(std::min(to_s, duration_s) - 0.05),
                          [](float x) { return x == 0; }));
  EXPECT_TRUE(std::any_of(held.begin(), held.begin() + at(from_s), [](float x) { return x > 0.005F; }));
}

}  // namespace
}  // namespace stylet::training
