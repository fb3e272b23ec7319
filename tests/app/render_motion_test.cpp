// Frames of a motion show what a session shows.
#include "engine/app/observer.h"
#include "engine/app/render.h"
#include "engine/picture/picture.h"
#include "tests/readers/small_scenario.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

namespace stylet::app {
namespace {

TEST(RenderMotion, TheZoneOfAnAblationIsInTheFramesAfterItWasHeated) {
  readers::test::SmallScenario files;
  // The trigger is pressed with the tip 40 mm in the liver, which is glass; 600 s of heating pass in a second.
  files.motion["tracks"]["stylus"] = {{0, 0.1, 0, 0.2, 0, 1, 0, 0, 0},
                                      {0.4, 0.1, 0, 0.16, 0, 1, 0, 0, 0},
                                      {0.5, 0.1, 0, 0.16, 0, 1, 0, 0, 1},
                                      {1.4, 0.1, 0, 0.16, 0, 1, 0, 0, 0}};
  files.scenario["sampling"] = {{"kind", "ablation"}, {"exposed_mm", 10}, {"duration_s", 3000}, {"time_factor", 600}};
  files.scenario["camera"] = {{"eye", {0.35, 0, 0.02}}, {"look_at", {0.1, 0, 0.02}}, {"up", {0, 1, 0}}};
  for (const char* tissue : {"bone", "liver", "tumour"}) {  // nothing but the zone is warm
    files.tissues["tissues"][tissue]["colour"] = {0.5, 0.5, 0.5, 0.7};
  }
  const auto frame_at = [&](double time_s, const char* folder) {
    files.write();
    Observer nobody;
    MotionFramesSettings settings{.common = {.scenario = files.path().string(),
                                             .out = files.folder.path() / folder,
                                             .ultrasound_size = {64, 64},
                                             .from_s = time_s,
                                             .to_s = time_s},
                                  .view_size = {320, 240}};
    render_motion(settings, nobody);
    return picture::read_png(settings.common.out / "view_00000.png");
  };
  // Pixels that the zone makes orange.
  const auto orange = [](const picture::Picture& picture) {
    int count = 0;
    for (std::size_t i = 0; i < picture.rgba.size(); i += 4) {
      if (picture.rgba[i] > picture.rgba[i + 2] + 40) ++count;
    }
    return count;
  };
  EXPECT_EQ(orange(frame_at(0.45, "before")), 0);
  EXPECT_GT(orange(frame_at(1.35, "after")), 200);
  // Nobody presses: nothing is heated.
  for (auto& row : files.motion["tracks"]["stylus"]) row[8] = 0;
  EXPECT_EQ(orange(frame_at(1.35, "unheated")), 0);
}

}  // namespace
}  // namespace stylet::app
