// A black image says why: each cause on a scene that has it, where the picture is black indeed.
#include "engine/ultrasound/diagnosis.h"
#include "engine/ultrasound/presets.h"
#include "engine/ultrasound/reference_image.h"
#include "tests/ultrasound/phantom.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace stylet::ultrasound {
namespace {

content::Scene tissue_below(float skin) {
  content::Scene scene = test::block_phantom(
      [&](const Eigen::Vector3f& p) { return p.z() < skin ? test::kOutside : test::kBackground; });
  scene.probe.convex = false;
  scene.probe.width = 0.05;
  scene.probe.scan_lines = 48;
  scene.probe.samples = 160;
  return scene;
}

struct Seen {
  std::string why;
  double bright = 0;  ///< share of the picture's pixels that show something
};

Seen look(const content::Scene& scene, const state::FrameState& state, double gain_db = 0) {
  ImagerSettings settings = preset_settings(Preset::raw);
  settings.depth_scale = false;
  settings.width = 160;
  settings.height = 120;
  ReferenceImager imager(scene, settings);
  ScannerControls controls = imager.controls();
  controls.gain_db = gain_db;
  imager.set_controls(controls);
  Seen seen;
  const std::vector<std::uint8_t>& image = imager.image(state);
  // Beyond half the depth the receiver's noise shows on a machine too: only what lies above it is counted.
  const std::size_t half = image.size() / 2;
  for (std::size_t i = 0; i < half; ++i) seen.bright += image[i] > 40 ? 1.0 / static_cast<double>(half) : 0;
  seen.why = imager.diagnosis();
  return seen;
}

/// @param why  a part of the line expected
void expect_black(const Seen& seen, const std::string& why) {
  EXPECT_NE(seen.why.find(why), std::string::npos) << seen.why;
  EXPECT_EQ(seen.why.find('\n'), std::string::npos);
  EXPECT_LT(seen.bright, 0.03) << why;
}

TEST(Diagnosis, IsSilentWhereSomethingIsSeen) {
  const content::Scene scene = tissue_below(0.003F);
  const Seen seen = look(scene, test::at_rest(scene));
  EXPECT_EQ(seen.why, "");
  EXPECT_GT(seen.bright, 0.1);
  const content::Scene tour = test::tour_phantom();
  ScanModel model(tour, {});
  model.update(test::tour_state(tour));
  EXPECT_EQ(diagnose(model), "");
}

TEST(Diagnosis, SaysHowFarTheSkinIs) {
  const content::Scene scene = tissue_below(0.0F);
  state::FrameState state = test::at_rest(scene);
  state.probe_lifted = 1;
  state.probe_position.z() = -0.007F;
  expect_black(look(scene, state), "the probe does not touch the skin: 7 mm of air; bring it down");
  state.probe_position.z() = -0.05F;
  expect_black(look(scene, state), "the probe's face lies 50 mm from the skin; move it onto the skin");
}

TEST(Diagnosis, SaysThatThereIsNoGel) {
  content::Scene scene = tissue_below(0.004F);
  scene.probe.gel = false;
  expect_black(look(scene, test::at_rest(scene)), "4 mm of air and no gel");
}

TEST(Diagnosis, SeesWrongUnits) {
  content::Scene scene = tissue_below(0.0F);
  scene.labels.origin.z() += 0.1F;  // the skin lies at z = 0.1 m
  state::FrameState state = test::at_rest(scene);
  state.probe_position.z() = 100;
  expect_black(look(scene, state), "its position looks like millimetres: write metres");
  state.probe_position.z() = 0.0001F;
  expect_black(look(scene, state), "its position looks 1000 times too small: write metres");
  scene.labels.spacing = 1;
  scene.labels.origin *= 1000;
  EXPECT_EQ(look(scene, state).why, "the patient is 183 m across; its files must be in metres");
}

TEST(Diagnosis, SeesAProbeThatLooksAway) {
  const content::Scene scene = tissue_below(0.0F);
  state::FrameState state = test::at_rest(scene);
  state.probe_position.z() = -0.002F;
  state.probe_orientation = Eigen::AngleAxisf(3.14159265F, Eigen::Vector3f::UnitX());
  expect_black(look(scene, state), "does not meet the patient, which lies behind it; turn it round");
}

TEST(Diagnosis, SeesThatItIsOutsideThePatient) {
  const content::Scene scene = tissue_below(0.0F);
  state::FrameState state = test::at_rest(scene);
  state.probe_position.x() = 0.4F;
  expect_black(look(scene, state), "from the skin; move it onto the skin");
}

TEST(Diagnosis, SeesAnEmptyLabelVolume) {
  content::Scene scene = tissue_below(0.0F);
  scene.labels.labels.assign(scene.labels.labels.size(), 0);
  expect_black(look(scene, test::at_rest(scene)), "holds no tissue to image");
}

TEST(Diagnosis, SeesBoneOverEverything) {
  content::Scene scene = tissue_below(0);
  content::LabelVolume& labels = scene.labels;
  const std::size_t layer = static_cast<std::size_t>(labels.size.x()) * labels.size.y();
  for (std::size_t i = 0; i < labels.labels.size(); ++i) {
    const std::size_t slice = i / layer;
    const float z = labels.origin.z() + labels.spacing * static_cast<float>(slice);
    if (z > 0.0035F && z < 0.0135F) labels.labels[i] = test::kBone;
  }
  const Seen seen = look(scene, test::at_rest(scene));
  EXPECT_EQ(seen.why.substr(0, 27), "everything lies behind bone") << seen.why;
  EXPECT_LT(seen.bright, 0.08);  // the bone's own echo
}

TEST(Diagnosis, SaysHowMuchGainIsMissing) {
  const content::Scene scene = tissue_below(0.0F);
  const state::FrameState state = test::at_rest(scene);
  const Seen black = look(scene, state, -45);
  expect_black(black, "the gain is too low (-45 dB); raise it by about ");
  const double missing = std::stod(black.why.substr(black.why.find("about ") + 6));
  const Seen again = look(scene, state, -45 + missing);
  EXPECT_EQ(again.why, "");
  EXPECT_GT(again.bright, 0.1);
}

TEST(Diagnosis, ReportsFluidAsAnechoic) {
  content::Scene scene = tissue_below(0.0F);
  for (std::uint8_t& label : scene.labels.labels) {
    if (label == test::kBackground) label = test::kFluid;
  }
  scene.tissues[test::kFluid].acoustics.backscatter_db = -100;
  expect_black(look(scene, test::at_rest(scene)), "fluid only");
}

}  // namespace
}  // namespace stylet::ultrasound
