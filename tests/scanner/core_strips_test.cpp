// Cores laid beside the ultrasound image: their length and tissues to scale, and nothing else hidden by them.
#include "engine/scanner/core_strips.h"

#include "engine/scanner/scanner_console.h"
#include "engine/scanner/scanner_screen.h"
#include "engine/ultrasound/scan_geometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace stylet::scanner {
namespace {

content::Scene scene_of_three() {
  content::Scene scene;
  scene.tissues.resize(3);
  scene.tissues[1].colour = {0.8F, 0, 0, 1};
  scene.tissues[2].colour = {0, 0.8F, 0, 1};
  return scene;
}

/// `share` of it is target, from the tip on.
state::CoreTrack core_of(float length, float share, double fired_s) {
  return {.to = {0, 0, length},
          .target_share = share,
          .fired_s = fired_s,
          .pieces = {{.from = 0, .to = share, .tissue = 2, .target = true}, {.from = share, .to = 1, .tissue = 1}}};
}

bool is_target(const std::uint8_t* pixel) {
  return pixel[1] > 150 && pixel[0] < 80 && pixel[2] < 80;
}
bool is_other(const std::uint8_t* pixel) {
  return pixel[0] > 100 && pixel[1] < 60 && pixel[2] < 60;
}

struct Counts {
  int target = 0;
  int other = 0;
};
/// Of the pixels in a line of a picture.
Counts count(const picture::Picture& picture, int y) {
  Counts counts;
  for (int x = 0; x < picture.width; ++x) {
    counts.target += is_target(picture.at(x, y)) ? 1 : 0;
    counts.other += is_other(picture.at(x, y)) ? 1 : 0;
  }
  return counts;
}

TEST(CoreStrips, LengthsAndTissuesAreToScaleTheNewestIsLowest) {
  const content::Scene scene = scene_of_three();
  for (const int height : {360, 480, 960}) {
    picture::Picture picture(height * 4 / 3, height);
    const std::vector<state::CoreTrack> cores{core_of(0.0085F, 1, 3), core_of(0.017F, 0.7F, 5)};
    draw_core_strips(picture, cores, scene, nullptr, figures::Font());
    const figures::PixelBox box = core_strips_box(picture.width, picture.height, 2);
    const double row = (box.bottom - box.top) / 2;
    const Counts first = count(picture, static_cast<int>(box.top + row / 2));
    const Counts last = count(picture, static_cast<int>(box.top + 1.5 * row));
    ASSERT_GT(first.target, 20) << height;
    EXPECT_EQ(first.other, 0);
    EXPECT_NEAR(last.target + last.other, 2 * first.target, 3) << "twice as long";
    EXPECT_NEAR(last.target, 0.7 * (last.target + last.other), 2);
  }
}

TEST(CoreStrips, OfMixedSlicesEachTissueHasItsShareOfTheWidth) {
  const content::Scene scene = scene_of_three();
  state::CoreTrack core = core_of(0.017F, 1, 1);
  core.pieces = {{.from = 0, .to = 1, .low = 0, .high = 0.5F, .tissue = 2, .target = true},
                 {.from = 0, .to = 1, .low = 0.5F, .high = 1, .tissue = 1}};
  picture::Picture picture(1280, 960);
  draw_core_strips(picture, {{core}}, scene, nullptr, figures::Font());
  Counts all;
  for (int y = 0; y < picture.height; ++y) {
    all.target += count(picture, y).target;
    all.other += count(picture, y).other;
  }
  ASSERT_GT(all.target, 500);
  EXPECT_NEAR(all.target, all.other, 0.15 * all.target) << "a line of pixels between them";
}

TEST(CoreStrips, HideNothingThatStandsBesideTheImage) {
  const content::Scene scene = scene_of_three();
  const figures::Font font = figures::Font::load();
  ScannerConsole console{content::Probe{}};
  for (const int height : {360, 480, 960}) {
    const auto black = [&] { return picture::Picture(height * 4 / 3, height); };
    picture::Picture readouts = black(), strips = black();
    const ultrasound::SectorGeometry sector{.metres_per_pixel = 0.16 / height};
    draw_scanner_screen(readouts,
                        {.probe = "C5-2",
                         .sector = sector,
                         .rate_hz = 26,
                         .probe_force = 5,
                         .note = "the needle is not in the image",
                         .depth = 0.16,
                         .focus = 0.08},
                        console, font);
    std::vector<state::CoreTrack> cores;
    for (int i = 0; i < 20; ++i) cores.push_back(core_of(0.04F, 0.5F, i));
    draw_core_strips(strips, cores, scene, nullptr, font);
    const picture::Picture untouched = black();
    const figures::PixelBox box = core_strips_box(strips.width, strips.height, cores.size());
    int drawn = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < strips.width; ++x) {
        const bool strip = !std::equal(strips.at(x, y), strips.at(x, y) + 3, untouched.at(x, y));
        const bool readout = !std::equal(readouts.at(x, y), readouts.at(x, y) + 3, untouched.at(x, y));
        ASSERT_FALSE(strip && readout) << x << ", " << y << " of " << height;
        if (strip) {
          ++drawn;
          ASSERT_TRUE(x >= std::floor(box.left) && x <= box.right && y >= std::floor(box.top) && y <= box.bottom)
              << x << ", " << y;
        }
      }
    }
    EXPECT_GT(drawn, 500) << "the newest four of many";
  }
}

TEST(CoreStrips, SayWhatTheCoreHolds) {
  EXPECT_EQ(core_caption(core_of(0.017F, 0.82F, 1), 1), "core 1: 17 mm, 82 % target");
}

}  // namespace
}  // namespace stylet::scanner
