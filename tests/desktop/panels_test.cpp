// The panels, drawn into an image and used with a pointer as a hand would.
#include "engine/desktop/panels.h"
#include "engine/view/offscreen.h"
#include "engine/view/overlay.h"

#include <gtest/gtest.h>
#include <imgui_internal.h>

#include <atomic>
#include <cstdlib>
#include <functional>
#include <map>
#include <optional>
#include <string>

namespace stylet::desktop {
namespace {

constexpr int kWidth = 960;
constexpr int kHeight = 640;

content::Probe probe() {
  content::Probe probe;
  probe.name = "C5-2";
  return probe;
}

class PanelsOnAPicture : public testing::Test {
protected:
  /// @param scale  of the display: so many times the pixels
  explicit PanelsOnAPicture(int scale = 1) : scale_(scale) {}

  DesktopFacts facts() const {
    panels::SessionFacts session{
        .title = "Liver biopsy", .stage = "Procedure", .prompt = "Bring the tip to the tumour."};
    session.force_curve = curve_;
    session.target_distance = 0.012;
    session.warnings = {{panels::Concern::danger, "tip is beyond the target"}};
    return {
        .session = session,
        .choices = {{.label = "Fire", .key = "Enter"}, {.label = "Pause", .key = "X", .why_not = "nothing runs yet"}},
        .device = "mouse",
        .pictures = "14.2 frames/s of 1280 x 720, needle 61 ms old",
        .ending = ending_};
  }

  /// One frame with the pointer there. @return the choice taken
  std::optional<std::size_t> frame(double x = -1, double y = -1, bool left = false) {
    overlay_.begin({.width = width_, .height = height_, .pointer_x = x, .pointer_y = y, .left = left});
    const PanelInput input = panels_.draw(facts(), console_, width_, height_);
    for (const scanner::Command& command : input.scanner) console_.apply(command);
    return input.choice;
  }
  picture::Picture picture() {
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
    for (int y = 6; y < height_; y += 12) {
      for (int x = 6; x < width_; x += 24) {
        frame(x, y);
        if (!overlay_.wants_pointer()) continue;
        frame(x, y, true);
        if (done(frame(x, y))) return true;
      }
    }
    return false;
  }

  const int scale_, width_ = kWidth * scale_, height_ = kHeight * scale_;
  std::atomic<std::uint32_t> messages_{0};
  gpu::Device device_{{.validation = std::getenv("STYLET_VALIDATION") != nullptr, .message_counter = &messages_}};
  gpu::Image image_{device_,
                    {.width = static_cast<std::uint32_t>(width_),
                     .height = static_cast<std::uint32_t>(height_),
                     .format = VK_FORMAT_R8G8B8A8_SRGB,
                     .usage = gpu::kTargetUsage | VK_IMAGE_USAGE_TRANSFER_DST_BIT}};
  view::Overlay overlay_{device_, VK_FORMAT_R8G8B8A8_SRGB, static_cast<double>(scale_)};
  scanner::ScannerConsole console_{probe()};
  Panels panels_;
  const panels::Ending* ending_ = nullptr;
  std::vector<figures::ForceSample> curve_{{.time_s = 0}, {.time_s = 1, .depth = 0.03, .axial = 2.4, .lateral = 0.4}};
};

TEST_F(PanelsOnAPicture, CoverWhereTheyLieAndNothingElse) {
  const picture::Picture shown = picture();
  const std::array<int, 3> ground{63, 124, 63};  // of the clear colour, in sRGB
  const auto is_ground = [&](int x, int y) {
    return std::abs(shown.at(x, y)[0] - ground[0]) <= 1 && std::abs(shown.at(x, y)[1] - ground[1]) <= 1;
  };
  EXPECT_TRUE(is_ground(kWidth / 2, kHeight / 2));
  EXPECT_FALSE(is_ground(kHeight / 60 + 20, kHeight / 60 + 20));            // the procedure, upper left
  EXPECT_FALSE(is_ground(kHeight / 60 + 20, kHeight - kHeight / 60 - 20));  // the force, lower left
  EXPECT_TRUE(is_ground(kWidth - kHeight / 60 - 20, kHeight - kHeight / 60 - 20));
  panels_.apply(PanelCommand::toggle_instructor);
  EXPECT_NE(picture().at(kWidth - kHeight / 60 - 20, kHeight - kHeight / 60 - 20)[1], ground[1]);
  panels_.apply(PanelCommand::toggle_all);
  const picture::Picture hidden = picture();
  for (int y = 0; y < kHeight; y += 7)
    for (int x = 0; x < kWidth; x += 7) ASSERT_NEAR(hidden.at(x, y)[1], ground[1], 1) << x << ' ' << y;
  EXPECT_EQ(messages_.load(), 0u);
}

TEST_F(PanelsOnAPicture, FiguresStandAtTheLowerEdgeWhereTheyAreAskedFor) {
  const auto light = [&] {
    const picture::Picture shown = picture();
    int count = 0;
    for (int y = kHeight - 40; y < kHeight; ++y)
      for (int x = kWidth / 3; x < 2 * kWidth / 3; ++x) count += shown.at(x, y)[1] > 200 ? 1 : 0;
    return count;
  };
  EXPECT_EQ(light(), 0);
  panels_.apply(PanelCommand::toggle_figures);
  panels_.apply(PanelCommand::toggle_all);  // they stay, to be read over a bare picture
  EXPECT_GT(light(), 200);
  panels_.apply(PanelCommand::toggle_figures);
  EXPECT_EQ(light(), 0);
}

TEST_F(PanelsOnAPicture, ReadLightOnDark) {
  const picture::Picture shown = picture();
  int light = 0, dark = 0;
  for (int y = 16; y < 120; ++y)
    for (int x = 16; x < 240; ++x) {
      light += shown.at(x, y)[1] > 200 ? 1 : 0;
      dark += shown.at(x, y)[1] < 70 ? 1 : 0;
    }
  EXPECT_GT(light, 300);
  EXPECT_GT(dark, 5000);
}

TEST_F(PanelsOnAPicture, EnabledButtonsReturnTheirChoice) {
  std::vector<std::size_t> taken;
  click_until([&](std::optional<std::size_t> choice) {
    if (choice) taken.push_back(*choice);
    return false;
  });
  ASSERT_FALSE(taken.empty());
  for (const std::size_t choice : taken) EXPECT_EQ(choice, 0u);
}

TEST_F(PanelsOnAPicture, TheEndingHasItsButtonsAndSpeaksAnotherLanguage) {
  panels::Ending ending{.score = 41, .verdict = "Not passed", .advice = "Aim before you enter the skin."};
  ending.lines.assign(11, {.title = "path inefficiency", .value = "12 %", .points = 3, .most = 6});
  ending_ = &ending;
  std::map<std::size_t, int> taken;
  click_until([&](std::optional<std::size_t> choice) {
    if (choice) ++taken[*choice];
    return false;
  });
  EXPECT_EQ(taken.count(0), 1U);
  EXPECT_EQ(taken.count(1), 0U) << "it cannot be done";
  const ImGuiWindow* window = ImGui::FindWindowByName("##ending");
  ASSERT_NE(window, nullptr);
  const Layout layout = layout_of(width_, height_, 15, {.ending = true});
  EXPECT_GE(window->Pos.x, static_cast<float>(layout.middle.x));
  EXPECT_LE(window->Pos.x + window->Size.x, static_cast<float>(layout.ultrasound.x));
  EXPECT_LE(window->Size.y, static_cast<float>(layout.middle.height));
  const content::Texts german(std::map<std::string, std::string, std::less<>>{
      {"Not passed", "Nicht bestanden"}, {"Aim before you enter the skin.", "Ziele erst."}});
  panels::translate(ending, german);
  EXPECT_EQ(ending.verdict, "Nicht bestanden");
  EXPECT_EQ(ending.advice, "Ziele erst.");
}

TEST_F(PanelsOnAPicture, SlidersTurnTheScannersKnobs) {
  panels_.apply(PanelCommand::toggle_scanner);
  const ultrasound::ScannerControls before = console_.controls();
  EXPECT_TRUE(click_until([&](std::optional<std::size_t>) { return console_.controls().depth != before.depth; }));
  EXPECT_TRUE(click_until([&](std::optional<std::size_t>) { return console_.controls().tgc_db != before.tgc_db; }));
  EXPECT_TRUE(click_until([&](std::optional<std::size_t>) { return console_.frozen(); }));
  ultrasound::ScannerControls limited = console_.controls();
  EXPECT_EQ(ultrasound::limit(limited, probe()), "");
}

TEST_F(PanelsOnAPicture, HelpFitsTheWindowAndClosesAgain) {
  const auto window = [] { return ImGui::FindWindowByName("Keys (H closes)"); };
  panels_.apply(PanelCommand::toggle_help);
  picture();
  ASSERT_NE(window(), nullptr);
  EXPECT_TRUE(window()->WasActive);
  EXPECT_LE(window()->Size.y, static_cast<float>(kHeight));
  EXPECT_LE(window()->Size.x, static_cast<float>(kWidth));
  EXPECT_GE(window()->Pos.y, 0);
  panels_.apply(PanelCommand::toggle_help);
  picture();
  EXPECT_FALSE(window()->WasActive);
}

/// The same panels at one scale after the other: one overlay at a time.
struct AtScale : PanelsOnAPicture {
  explicit AtScale(int scale) : PanelsOnAPicture(scale) {
    panels_.apply(PanelCommand::toggle_scanner);
    panels_.apply(PanelCommand::toggle_instructor);
    picture();
  }
  void TestBody() override {}

  struct Shown {
    ImVec2 at, size;
  };
  /// Of every panel; none is cut, and all of each is seen.
  std::map<std::string, Shown> panels() const {
    std::map<std::string, Shown> found;
    for (const ImGuiWindow* window : ImGui::GetCurrentContext()->Windows) {
      if (!window->WasActive || window->Name == std::string("Debug##Default")) continue;
      EXPECT_EQ(window->ScrollMax.x, 0) << window->Name;
      EXPECT_EQ(window->ScrollMax.y, 0) << window->Name;
      EXPECT_LE(window->ContentSize.x + 2 * window->WindowPadding.x, window->Size.x + 0.5F) << window->Name;
      EXPECT_GE(window->Pos.x, 0) << window->Name;
      EXPECT_LE(window->Pos.x + window->Size.x, static_cast<float>(width_)) << window->Name;
      EXPECT_LE(window->Pos.y + window->Size.y, static_cast<float>(height_)) << window->Name;
      found[window->Name] = {window->Pos, window->Size};
    }
    return found;
  }
  float font() const { return ImGui::GetCurrentContext()->FontBaseSize; }
  /// Where the first button takes its choice.
  std::optional<ImVec2> button() {
    for (int y = 6; y < height_ / 3; y += 6 * scale_)
      for (int x = 6; x < width_ / 4; x += 12 * scale_)
        if (clicked(x, y)) return ImVec2(static_cast<float>(x), static_cast<float>(y));
    return std::nullopt;
  }
  bool clicked(double x, double y) {
    frame(x, y);
    frame(x, y, true);
    return frame(x, y) == std::size_t{0};
  }
  using PanelsOnAPicture::picture;
};

TEST(PanelsOnADenseDisplay, AreTwiceAsManyPixelsAndAnswerWhereTheyLie) {
  std::map<std::string, AtScale::Shown> once, twice;
  std::optional<ImVec2> button;
  {
    AtScale plain(1);
    once = plain.panels();
    EXPECT_EQ(plain.font(), 15);
    button = plain.button();
  }
  ASSERT_TRUE(button.has_value());
  ASSERT_EQ(once.size(), 4U);
  AtScale dense(2);
  twice = dense.panels();
  EXPECT_EQ(dense.font(), 30);
  for (const auto& [name, panel] : once) {
    ASSERT_EQ(twice.count(name), 1U) << name;
    const AtScale::Shown& other = twice[name];
    // The letters of a font are rounded to whole pixels: a line of 40 may be some pixels off.
    const float letters = 0.03F * other.size.x + 2;
    EXPECT_NEAR(other.size.x, 2 * panel.size.x, letters) << name;
    EXPECT_NEAR(other.size.y, 2 * panel.size.y, 8) << name;
    EXPECT_NEAR(other.at.x, 2 * panel.at.x, letters) << name;
    EXPECT_NEAR(other.at.y, 2 * panel.at.y, 8) << name;
  }
  EXPECT_TRUE(dense.clicked(2 * button->x, 2 * button->y));
  EXPECT_FALSE(dense.clicked(button->x, button->y)) << "a point of the picture, not of the window";
  const Layout plain_layout = layout_of(kWidth, kHeight, 15, {});
  const Layout dense_layout = layout_of(2 * kWidth, 2 * kHeight, 30, {});
  EXPECT_NEAR(dense_layout.ultrasound.width, 2 * plain_layout.ultrasound.width, 2);
  EXPECT_NEAR(dense_layout.ultrasound.x, 2 * plain_layout.ultrasound.x, 2);
  if (const char* to = std::getenv("STYLET_SAVE_PANELS")) picture::write_png(to, dense.picture());
}

}  // namespace
}  // namespace stylet::desktop
