// `stylet bench ultrasound` with one seed: the image keeps what the bench promises. The bench itself takes eight.
#include "engine/gpu/device.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"
#include "tools/bench/ultrasound_quality.h"
#include "tools/bench/ultrasound_scan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

namespace stylet::bench {
namespace {

/// Every bound of a part, each a claim.
void expect_met(const Report& report) {
  EXPECT_FALSE(report.measurements.empty());
  for (const Measurement& m : report.measurements) {
    EXPECT_NE(m.met, false) << m.name << " is " << m.value << " " << m.unit << ", asked " << m.target << " ("
                            << m.note << ")";
  }
}

class UltrasoundQuality : public testing::Test {
protected:
  void SetUp() override {
    if (support::kSanitized) GTEST_SKIP() << "minutes of image computing; tests/ultrasound runs the same code";
  }
  gpu::Device device_;
  QualityRun run_{.device = device_, .seeds = 1};
};

TEST_F(UltrasoundQuality, SpeckleIsRayleighOfTheBeamsSizeAndFallsWithTheAttenuation) {
  expect_met(speckle_quality(run_));
}
TEST_F(UltrasoundQuality, TargetsShowTheirContrastRibsTheirShadowFluidItsEnhancement) {
  expect_met(contrast_quality(run_));
}
TEST_F(UltrasoundQuality, WiresAreShownInTheirPlaces) {
  expect_met(geometry_quality(run_));
}
TEST_F(UltrasoundQuality, SpeckleGoesWithTheTissue) {
  expect_met(motion_quality(run_));
}
TEST_F(UltrasoundQuality, SpeckleLeavesTheImagePlaneAsTheSliceIsThick) {
  expect_met(elevation_quality(run_));
}
TEST_F(UltrasoundQuality, TheNeedleFadesAsItTurnsIntoTheBeam) {
  expect_met(needle_quality(run_));
}

// A wire on a sample is as bright as it is said to be, whatever its depth and the density of the lines.
TEST_F(UltrasoundQuality, AWireHasItsLevelAtEveryDepth) {
  content::Scene scene = reference::uniform_phantom();
  for (content::Tissue& tissue : scene.tissues) {
    tissue.acoustics.attenuation_db_per_cm_mhz = 0;
    tissue.acoustics.backscatter_db = -90;
  }
  for (const int oversampling : {1, 2}) {
    const auto scan = ultrasound::ScanGeometry::of(scene.probe, oversampling);
    scene.wires.clear();
    const int line = scan.lines / 3;
    for (int sample = 50; sample < scan.samples; sample += 100) {
      const Eigen::Vector2d at = scan.position(line, sample);
      scene.wires.push_back({.from = {at.x(), -0.02, at.y()}, .to = {at.x(), 0.02, at.y()}, .echo_db = 20});
    }
    ultrasound::ImagerSettings settings = raw_settings(1, false);
    settings.line_oversampling = oversampling;
    PhantomScan phantom(device_, scene, settings);
    const Eigen::MatrixXd envelope = phantom.envelope();
    for (int sample = 50; sample < scan.samples; sample += 100) {
      EXPECT_NEAR(20 * std::log10(envelope(sample, line)), 20, 0.3)
          << "sample " << sample << ", oversampling " << oversampling;
    }
  }
}

TEST(ReportPage, HoldsItsNumbersAndItsFigures) {
  const support::TemporaryFolder folder;
  std::ofstream(folder.path() / "a.png", std::ios::binary) << "abcd";  // any bytes
  Report report;
  report.add(noted(at_most("depth.error", 0.5, "mm", 0.25, 0.0), "with <noise>"));
  report.figures.push_back({"A & B", "caption", folder.path() / "a.png"});
  write_page(folder.path() / "page.html", "bench", report, Machine{.processor = "p"});
  std::ifstream in(folder.path() / "page.html");
  const std::string page{std::istreambuf_iterator<char>(in), {}};
  for (const char* part : {"depth.error", "0.5", "MISSED", "with &lt;noise&gt;", "A &amp; B", "base64,YWJjZA==\"",
                           "0 of 1 targets met"}) {
    EXPECT_NE(page.find(part), std::string::npos) << part;
  }
  report.figures.push_back({"gone", "", folder.path() / "no.png"});
  EXPECT_THROW(write_page(folder.path() / "page.html", "bench", report, {}), std::runtime_error);
}

}  // namespace
}  // namespace stylet::bench
