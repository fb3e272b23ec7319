// The image on the GPU: the same as the reference, the same every time, and as someone has seen it.
#include "engine/ultrasound/imager.h"

#include "engine/gpu/device.h"
#include "engine/procedures/ablation/ablation.h"
#include "engine/procedures/ablation/plan.h"
#include "engine/ultrasound/presets.h"
#include "engine/ultrasound/reference_image.h"
#include "tests/support/image_compare.h"
#include "tests/support/sanitized.h"
#include "tests/ultrasound/phantom.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace stylet::ultrasound {
namespace {

content::Scene small_tour() {
  content::Scene scene = test::tour_phantom();
  scene.probe.scan_lines = 96;
  scene.probe.samples = 384;
  // Across the image plane, within it, and at a slant.
  scene.wires = {{.from = {-0.03, -0.02, 0.04}, .to = {-0.03, 0.02, 0.04}, .echo_db = 30},
                 {.from = {0.01, 0.001, 0.11}, .to = {0.04, 0.001, 0.12}, .echo_db = 20},
                 {.from = {0.05, 0.02, 0.08}, .to = {0.03, -0.01, 0.07}, .echo_db = 25}};
  return scene;
}

constexpr ImagerSettings kSmall{.width = 320, .height = 240};

/// Rounding moves a sample across the border of a speckle texel or voxel here and there: rare, and then visible.
void expect_same(const std::vector<std::uint8_t>& actual, const std::vector<std::uint8_t>& expected) {
  ASSERT_EQ(actual.size(), expected.size());
  int off = 0;
  int far_off = 0;
  for (std::size_t i = 0; i < actual.size(); ++i) {
    const int difference = std::abs(int(actual[i]) - int(expected[i]));
    off += difference > 1 ? 1 : 0;
    far_off += difference > 16 ? 1 : 0;
  }
  EXPECT_LT(off, 0.01 * static_cast<double>(actual.size()));
  EXPECT_LT(far_off, 0.0005 * static_cast<double>(actual.size()));
}

void expect_agreement(gpu::Device& device, const content::Scene& scene, const ImagerSettings& settings,
                      const state::FrameState& state) {
  Imager imager(device, scene, settings);
  ReferenceImager reference(scene, settings);
  if (settings.persistence > 0) {  // something that persists
    state::FrameState before = state;
    before.time_s -= 0.04;
    before.probe_position.x() += 0.003F;
    imager.image(before);
    reference.image(before);
  }
  imager.image(state);
  const std::vector<std::uint8_t>& expected = reference.image(state);
  expect_same(imager.read_back(), expected);
  const std::vector<float> envelope = imager.read_back_envelope();
  double error = 0;
  double power = 0;
  for (std::size_t i = 0; i < envelope.size(); ++i) {
    error += std::pow(envelope[i] - reference.envelope()[i], 2);
    power += std::pow(reference.envelope()[i], 2);
  }
  EXPECT_LT(error, 1e-4 * power);
}

TEST(Imager, AgreesWithTheReference) {
  gpu::Device device;
  for (const bool convex : {true, false}) {
    for (const int looks : {1, 3}) {
      if (support::kSanitized && (!convex || looks == 1)) continue;  // a quarter of a minute each
      SCOPED_TRACE(convex);
      SCOPED_TRACE(looks);
      content::Scene scene = small_tour();
      scene.probe.convex = convex;
      ImagerSettings settings = kSmall;
      settings.looks = looks;
      state::FrameState state = test::tour_state(scene);
      for (Eigen::Vector3f& p : state.bodies[0]) p.x() += 0.004F * std::sin(40 * p.z());
      expect_agreement(device, scene, settings, state);
    }
  }
}

TEST(Imager, AgreesWithTheReferenceInBothPresets) {
  gpu::Device device;
  const content::Scene scene = small_tour();
  for (const Preset preset : {Preset::raw, Preset::clinical}) {
    if (support::kSanitized && preset == Preset::clinical) continue;
    SCOPED_TRACE(preset_name(preset));
    ImagerSettings settings = preset_settings(preset);
    settings.width = kSmall.width;
    settings.height = kSmall.height;
    expect_agreement(device, scene, settings, test::tour_state(scene));
  }
}

TEST(Imager, AgreesWithTheReferenceWithAllControlsSet) {
  gpu::Device device;
  const content::Scene scene = small_tour();
  Imager imager(device, scene, kSmall);
  ReferenceImager reference(scene, kSmall);
  state::FrameState state = test::tour_state(scene);
  const std::vector<std::uint8_t> before = reference.image(state);
  imager.image(state);
  ScannerControls controls = imager.controls();
  controls = {.depth = 0.12,
              .gain_db = -3,
              .frequency_hz = 4.4e6,
              .focus = 0.04,
              .dynamic_range_db = 48,
              .persistence = 0.4,
              .tgc_db = {-6, -2, 0, 5, 3, 8, -1, 12}};
  EXPECT_EQ(imager.set_controls(controls), "");
  EXPECT_EQ(reference.set_controls(controls), "");
  std::vector<content::Tissue> tissues = scene.tissues;
  tissues[test::kBackground].acoustics.backscatter_db = -4;
  imager.set_acoustics(tissues);
  reference.set_acoustics(tissues);
  imager.image(state);
  reference.image(state);
  state.probe_position.x() += 0.004F;
  imager.image(state);
  const std::vector<std::uint8_t> expected = reference.image(state);
  EXPECT_NE(expected, before);
  expect_same(imager.read_back(), expected);
}

/// Liver with an electrode across the image plane, 60 mm deep.
struct HeatedLiver {
  content::Scene scene = test::block_phantom([](const Eigen::Vector3f&) { return test::kBackground; });
  procedures::ablation::Electrode electrode{.tip = {-0.012, 0, 0.060}, .base = {0.012, 0, 0.060}};
  state::FrameState state = test::at_rest(scene);

  HeatedLiver() {
    auto plan = std::make_shared<procedures::ablation::Plan>();
    plan->destroys = true;
    scene.exercise.plan = plan;
    scene.probe.scan_lines = 96;
    scene.probe.samples = 384;
    state.needle_positions.clear();
  }
};

TEST(HeatedZone, ShinesWhileItIsHeatedAndShadowsThenFadesAndLeavesADarkZoneWithABrightRim) {
  HeatedLiver liver;
  ReferenceImager imager(liver.scene, {.width = 64, .height = 64});
  procedures::ablation::Ablation ablation(liver.scene, liver.electrode, -1);
  // Mean power between two depths over the width of the electrode, dB.
  const auto level = [&](double from, double to) {
    double power = 0;
    int count = 0;
    for (int s = 0; s < imager.scan().samples; ++s) {
      for (int l = 0; l < imager.scan().lines; ++l) {
        const Eigen::Vector2d at = imager.scan().position(l, s);
        if (std::abs(at.x()) > 0.008 || at.y() < from || at.y() > to) continue;
        power += std::pow(imager.envelope()[static_cast<std::size_t>(s) * imager.scan().lines + l], 2);
        ++count;
      }
    }
    return 10 * std::log10(power / count);
  };
  struct Levels {
    double above, rim, cloud, core, behind;
  };
  const auto look = [&] {
    const auto zone = ablation.shown(nullptr, -1, true);
    liver.state.zone = zone->version > 1 ? zone : nullptr;
    imager.image(liver.state);
    double top = 0.060;
    for (const Eigen::Vector3f& x : zone->surface.positions) {
      if (std::abs(x.x()) < 0.008F) top = std::min(top, static_cast<double>(x.z()));
    }
    return Levels{level(0.030, 0.040), level(top - 0.001, top + 0.001), level(0.054, 0.060), level(0.055, 0.065),
                  level(0.080, 0.095)};
  };
  const Levels before = look();
  ablation.heat_to(120);
  const Levels early = look();
  ablation.heat_to(support::kSanitized ? 240 : 600);
  const Levels late = look();
  ablation.rest_to(3600);
  const Levels rested = look();
  std::printf("cloud %+.1f, %+.1f, later %+.1f dB; rim %+.1f; behind %+.1f, %+.1f, later %+.1f dB\n",
              early.cloud - before.cloud, late.cloud - before.cloud, rested.core - before.core,
              rested.rim - before.rim, early.behind - before.behind, late.behind - before.behind,
              rested.behind - before.behind);
  EXPECT_GT(early.cloud - before.cloud, 6);
  EXPECT_LT(early.behind - before.behind, -3);
  EXPECT_LT(late.behind, early.behind) << "the cloud grows";
  EXPECT_LT(rested.core - before.core, -3) << "coagulated liver is dark";
  EXPECT_GT(rested.rim - before.rim, 2);
  EXPECT_GT(rested.behind, late.behind + 3) << "the bubbles have dissolved";
  for (const Levels& now : {early, late, rested}) EXPECT_NEAR(now.above, before.above, 0.2);
}

TEST(HeatedZone, AgreesWithTheReference) {
  gpu::Device device;
  HeatedLiver liver;
  procedures::ablation::Ablation ablation(liver.scene, liver.electrode, -1);
  ablation.heat_to(120);
  Imager imager(device, liver.scene, kSmall);
  ReferenceImager reference(liver.scene, kSmall);
  imager.image(liver.state);
  const std::vector<std::uint8_t> without = imager.read_back();
  liver.state.zone = ablation.shown(nullptr, -1, true);
  imager.image(liver.state);
  expect_same(imager.read_back(), reference.image(liver.state));
  EXPECT_NE(imager.read_back(), without);
  liver.state.zone = nullptr;
  imager.image(liver.state);
  EXPECT_EQ(imager.read_back(), without);
}

TEST(Imager, FollowsTheBreathAsTheReferenceDoes) {
  gpu::Device device;
  content::Scene scene = test::block_phantom([](const Eigen::Vector3f& p) {
    return p.z() > 0.06F + 0.2F * p.x() && p.z() < 0.07F + 0.2F * p.x() ? test::kBone : test::kBackground;
  });
  for (std::size_t i = 0; i < scene.labels.labels.size(); ++i) {
    if (scene.labels.labels[i] == test::kBone) scene.labels.bodies[i] = content::kBreathes;
  }
  scene.probe.scan_lines = 96;
  scene.probe.samples = 384;
  ImagerSettings settings = kSmall;
  settings.looks = 1;
  state::FrameState state = test::at_rest(scene);
  state.breath = {0.0011F, -0.0023F, 0.0087F};
  expect_agreement(device, scene, settings, state);
}

TEST(Imager, IsBitExactFromRunToRun) {
  gpu::Device device;
  const content::Scene scene = small_tour();
  state::FrameState state = test::tour_state(scene);
  Imager first(device, scene, kSmall);
  first.image(state);
  const std::vector<std::uint8_t> once = first.read_back();
  state.probe_position.x() += 0.01F;  // another picture between
  first.image(state);
  EXPECT_NE(first.read_back(), once);
  state.probe_position.x() -= 0.01F;
  first.image(test::tour_state(scene));
  EXPECT_EQ(first.read_back(), once);
  Imager second(device, scene, kSmall);
  second.image(test::tour_state(scene));
  EXPECT_EQ(second.read_back(), once);
}

TEST(Imager, KeepsValidationSilent) {
  std::atomic<std::uint32_t> messages = 0;
  {
    gpu::Device device({.validation = true, .message_counter = &messages});
    const content::Scene scene = small_tour();
    Imager imager(device, scene, kSmall);
    state::FrameState state = test::tour_state(scene);
    imager.image(state);
    gpu::Commands commands(device);
    for (int frame = 0; frame < 3; ++frame) {
      state.probe_position.y() += 0.002F;
      if (frame == 1) state.needle_positions.clear();
      commands.begin();
      imager.record(commands, state);
      commands.submit();
    }
    device.wait_idle();
    imager.read_back();
    imager.read_back_envelope();
    EXPECT_EQ(imager.pass_times().size(), 10U);
  }
  EXPECT_EQ(messages.load(), 0U);
}

TEST(Imager, ShowsTheTourPhantomAsSeen) {
  gpu::Device device;
  if (const auto why = tests::no_golden_for(device.identity())) GTEST_SKIP() << *why;
  const content::Scene scene = test::tour_phantom();
  Imager imager(device, scene);
  imager.image(test::tour_state(scene));
  picture::Picture picture;
  picture.width = imager.geometry().width;
  picture.height = imager.geometry().height;
  for (const std::uint8_t grey : imager.read_back()) {
    picture.rgba.insert(picture.rgba.end(), {grey, grey, grey, 255});
  }
  EXPECT_TRUE(tests::matches_golden(device.identity(), picture, "ultrasound_tour"));
}

}  // namespace
}  // namespace stylet::ultrasound
