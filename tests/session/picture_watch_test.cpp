// How often pictures came and how old what they show was, by clocks that the test turns.
#include "engine/session/picture_watch.h"

#include "engine/session/session_report.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stylet::session {
namespace {

/// `count` pictures, `period_s` apart, an ultrasound image with every `of_images`th.
void show(PictureWatch& watch, double& clock_s, std::uint64_t& images, int count, double period_s, int of_images) {
  for (int i = 0; i < count; ++i) {
    clock_s += period_s;
    images += i % of_images == 0 ? 1 : 0;
    watch.shown(
        {.clock_s = clock_s, .needle_age_s = 0.5 * period_s, .ultrasound_age_s = 2 * period_s, .images = images});
  }
}

TEST(PictureWatch, CountsPicturesImagesAndTheirAges) {
  PictureWatch watch;
  double clock_s = 100;
  std::uint64_t images = 0;
  show(watch, clock_s, images, 101, 0.05, 2);
  const PictureSummary all = watch.summary();
  EXPECT_EQ(all.frames, 101U);
  EXPECT_NEAR(all.frames_per_second, 20, 1e-9);
  EXPECT_NEAR(all.frame_time.median_s, 0.05, 0.05 / 64);
  EXPECT_NEAR(all.needle_age.p99_s, 0.025, 0.025 / 64);
  EXPECT_EQ(all.images, 51U);
  EXPECT_NEAR(all.images_per_second, 10.2, 1e-9);
  EXPECT_NEAR(all.ultrasound_age.max_s, 0.1, 1e-9);
  EXPECT_NEAR(watch.recent().frames_per_second, 20, 1e-9);
  EXPECT_NEAR(watch.recent().images_per_second, 10, 2);
  EXPECT_NEAR(watch.recent().needle_age_s, 0.025, 1e-12);
}

TEST(PictureWatch, TheScreenTellsOfTheLastMomentAndASummaryOfAll) {
  PictureWatch watch;
  double clock_s = 0;
  std::uint64_t images = 0;
  show(watch, clock_s, images, 201, 0.01, 1);
  show(watch, clock_s, images, 10, 0.2, 1);
  EXPECT_NEAR(watch.recent().frames_per_second, 5, 1e-9);
  EXPECT_NEAR(watch.recent().needle_age_s, 0.1, 1e-12);
  EXPECT_NEAR(watch.summary().frames_per_second, 210 / 4.0, 1e-9);
}

TEST(PictureWatch, AWindowThatNobodySeesIsNoSlowFrame) {
  PictureWatch watch;
  double clock_s = 0;
  std::uint64_t images = 0;
  show(watch, clock_s, images, 11, 0.1, 1);
  watch.interrupted();
  clock_s += 60;
  show(watch, clock_s, images, 11, 0.1, 1);
  EXPECT_NEAR(watch.summary().frames_per_second, 10, 1e-9);
  EXPECT_NEAR(watch.summary().frame_time.max_s, 0.1, 1e-9);
}

TEST(PictureWatch, AnotherScannerAfterALostDeviceCountsOn) {
  PictureWatch watch;
  watch.shown({.clock_s = 0, .images = 7});
  watch.shown({.clock_s = 1, .images = 2});
  EXPECT_EQ(watch.summary().images, 9U);
}

TEST(PictureWatch, SessionJsonHasItWhereSomethingWasShown) {
  SessionReport report;
  EXPECT_FALSE(to_json(report).contains("pictures"));
  PictureWatch watch;
  double clock_s = 0;
  std::uint64_t images = 0;
  show(watch, clock_s, images, 21, 0.08, 2);
  report.pictures = watch.summary();
  const nlohmann::ordered_json pictures = to_json(report)["pictures"];
  EXPECT_EQ(pictures["frames"], 21);
  EXPECT_NEAR(pictures["frames_per_second"].get<double>(), 12.5, 1e-9);
  EXPECT_NEAR(pictures["needle_to_picture"]["median_us"].get<double>(), 40e3, 40e3 / 64);
  EXPECT_EQ(pictures["ultrasound_images"], 11);
  EXPECT_NEAR(pictures["ultrasound_to_picture"]["max_us"].get<double>(), 160e3, 1);
  EXPECT_NE(main_figures(report).find("12.5 frames a second"), std::string::npos) << main_figures(report);
}

}  // namespace
}  // namespace stylet::session
