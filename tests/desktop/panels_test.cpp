// The panels, drawn into an image and used with a pointer as a hand would.
#include "engine/desktop/panels.h"
#include "engine/view/offscreen.h"
#include "engine/view/overlay.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <functional>

namespace stylet::desktop {
namespace {

constexpr int kWidth = 960;
constexpr int kHeight = 640;
constexpr int kF3 = 292, kF4 = 293, kTab = 258;

content::Probe probe() {
  content::Probe probe;
  probe.name = "C5-2";
  return probe;
}

class PanelsOnAPicture : public testing::Test {
protected:
  SessionFacts facts() const {
    SessionFacts facts{.title = "Liver biopsy", .stage = "Procedure", .prompt = "Bring the tip to the tumour."};
    facts.choices = {{.label = "Fire", .key = "Enter"},
                     {.label = "Pause", .key = "X", .why_not = "nothing runs yet"}};
    facts.device = "mouse";
    facts.force_curve = curve_;
    facts.target_distance = 0.012;
    facts.warnings = {{Concern::danger, "tip is beyond the target"}};
    return facts;
  }

  /// One frame with the pointer there. @return the choice taken
  std::optional<std::size_t> frame(double x = -1, double y = -1, bool left = false) {
    overlay_.begin({.width = kWidth, .height = kHeight, .pointer_x = x, .pointer_y = y, .left = left});
    return panels_.draw(facts(), console_, kWidth, kHeight, view::PaneLayout::over_scene(kWidth, kHeight).ultrasound);
  }
  view::Picture picture() {
    frame();  // a panel that is new is measured first and shown in the next frame
    frame();
    gpu::run_now(device_, [&](gpu::Commands& commands) {
      commands.clear(image_, {0.05F, 0.2F, 0.05F, 1});
      overlay_.draw(commands, image_);
    });
    return view::read_picture(device_, image_);
  }

  /// Presses and releases the button at places of a grid, until `done`.
  bool click_until(const std::function<bool(std::optional<std::size_t>)>& done) {
    for (int y = 6; y < kHeight; y += 12) {
      for (int x = 6; x < kWidth; x += 24) {
        frame(x, y);
        if (!overlay_.wants_pointer()) continue;
        frame(x, y, true);
        if (done(frame(x, y))) return true;
      }
    }
    return false;
  }

  std::atomic<std::uint32_t> messages_{0};
  gpu::Device device_{{.validation = std::getenv("STYLET_VALIDATION") != nullptr, .message_counter = &messages_}};
  gpu::Image image_{device_,
                    {.width = kWidth,
                     .height = kHeight,
                     .format = VK_FORMAT_R8G8B8A8_SRGB,
                     .usage = gpu::kTargetUsage | VK_IMAGE_USAGE_TRANSFER_DST_BIT}};
  view::Overlay overlay_{device_, VK_FORMAT_R8G8B8A8_SRGB};
  session::ScannerConsole console_{probe()};
  Panels panels_;
  std::vector<session::ForceSample> curve_{{.time_s = 0}, {.time_s = 1, .depth = 0.03, .axial = 2.4, .lateral = 0.4}};
};

TEST_F(PanelsOnAPicture, CoverWhereTheyLieAndNothingElse) {
  const view::Picture shown = picture();
  const std::array<int, 3> ground{63, 124, 63};  // of the clear colour, in sRGB
  const auto is_ground = [&](int x, int y) {
    return std::abs(shown.at(x, y)[0] - ground[0]) <= 1 && std::abs(shown.at(x, y)[1] - ground[1]) <= 1;
  };
  EXPECT_TRUE(is_ground(kWidth / 2, kHeight / 2));
  EXPECT_FALSE(is_ground(kHeight / 60 + 20, kHeight / 60 + 20));            // the procedure, upper left
  EXPECT_FALSE(is_ground(kHeight / 60 + 20, kHeight - kHeight / 60 - 20));  // the force, lower left
  EXPECT_TRUE(is_ground(kWidth - kHeight / 60 - 20, kHeight - kHeight / 60 - 20));
  panels_.press(kF4);
  EXPECT_NE(picture().at(kWidth - kHeight / 60 - 20, kHeight - kHeight / 60 - 20)[1], ground[1]);
  panels_.press(kTab);
  const view::Picture hidden = picture();
  for (int y = 0; y < kHeight; y += 7)
    for (int x = 0; x < kWidth; x += 7) ASSERT_NEAR(hidden.at(x, y)[1], ground[1], 1) << x << ' ' << y;
  EXPECT_EQ(messages_.load(), 0u);
}

TEST_F(PanelsOnAPicture, ReadLightOnDark) {
  const view::Picture shown = picture();
  int light = 0, dark = 0;
  for (int y = 16; y < 120; ++y)
    for (int x = 16; x < 240; ++x) {
      light += shown.at(x, y)[1] > 200 ? 1 : 0;
      dark += shown.at(x, y)[1] < 70 ? 1 : 0;
    }
  EXPECT_GT(light, 300);
  EXPECT_GT(dark, 5000);
}

TEST_F(PanelsOnAPicture, ButtonsGiveTheirChoiceUnlessItCannotBeTaken) {
  std::vector<std::size_t> taken;
  click_until([&](std::optional<std::size_t> choice) {
    if (choice) taken.push_back(*choice);
    return false;
  });
  ASSERT_FALSE(taken.empty());
  for (const std::size_t choice : taken) EXPECT_EQ(choice, 0u);
}

TEST_F(PanelsOnAPicture, SlidersTurnTheScannersKnobs) {
  panels_.press(kF3);
  const ultrasound::ScannerControls before = console_.controls();
  EXPECT_TRUE(click_until([&](std::optional<std::size_t>) { return console_.controls().depth != before.depth; }));
  EXPECT_TRUE(click_until([&](std::optional<std::size_t>) { return console_.controls().tgc_db != before.tgc_db; }));
  EXPECT_TRUE(click_until([&](std::optional<std::size_t>) { return console_.frozen(); }));
  ultrasound::ScannerControls limited = console_.controls();
  EXPECT_EQ(ultrasound::limit(limited, probe()), "");
}

}  // namespace
}  // namespace stylet::desktop
