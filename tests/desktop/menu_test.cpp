// The menu, drawn into nothing and used by keys and pointer.
#include "engine/desktop/menu.h"

#include "engine/desktop/layout.h"
#include "engine/gpu/device.h"
#include "engine/view/overlay.h"

#include <gtest/gtest.h>
#include <imgui_internal.h>

namespace stylet::desktop {
namespace {

Menu menu() {
  return {{{.name = "a", .title = "Tutorial", .about = std::string(120, 'x')},
           {.name = "b", .title = "Biopsy", .about = std::string(120, 'x')},
           {.name = "c", .title = "Ablation", .about = std::string(120, 'x')},
           {.name = "d", .title = "Aspiration", .about = std::string(120, 'x')}},
          {{.name = "", .title = "What is connected"}, {.name = "mouse", .title = "Mouse and keyboard"}},
          {{.name = "window", .title = "Here"}, {.name = "headset", .title = "Headset"}},
          {{.name = "de", .title = "Deutsch"}, {.name = "en", .title = "English"}}};
}

view::Input pressed(view::Key key) {
  view::Input input;
  input.strokes = {{.key = key}};
  return input;
}

TEST(Menu, KeysChooseAScenarioStartAndLeave) {
  Menu chosen = menu();
  EXPECT_EQ(chosen.scenario(), "a");
  EXPECT_EQ(chosen.handle(pressed(view::Key::up)), MenuWish::nothing);
  EXPECT_EQ(chosen.scenario(), "a") << "there is none above";
  for (int i = 0; i < 9; ++i) chosen.handle(pressed(view::Key::down));
  EXPECT_EQ(chosen.scenario(), "d");
  chosen.handle(pressed(view::Key::up));
  EXPECT_EQ(chosen.scenario(), "c");
  EXPECT_EQ(chosen.stylus(), "");
  EXPECT_EQ(chosen.view(), "window");
  EXPECT_EQ(chosen.handle(pressed(view::Key::enter)), MenuWish::start);
  EXPECT_EQ(chosen.handle(pressed(view::Key::q)), MenuWish::leave);
  view::Input closed;
  closed.close = true;
  EXPECT_EQ(chosen.handle(closed), MenuWish::leave);
}

TEST(Menu, FitsWindowsOfEverySizeAndAnswersThePointer) {
  gpu::Device device{gpu::DeviceSettings{}};
  for (const auto& size : {std::pair{1024, 640}, {1280, 720}, {3840, 2160}}) {
    const int width = size.first, height = size.second;
    view::Overlay overlay(device, VK_FORMAT_R8G8B8A8_SRGB, text_scale(width, height, 1));
    Menu chosen = menu();
    const auto frame = [&](double x = -1, double y = -1, bool left = false) {
      overlay.begin({.width = width, .height = height, .pointer_x = x, .pointer_y = y, .left = left});
      return chosen.draw(width, height, {});
    };
    frame();
    frame();
    const ImGuiWindow* window = ImGui::FindWindowByName("###menu");
    ASSERT_NE(window, nullptr);
    EXPECT_GE(window->Pos.y, 0);
    EXPECT_LE(window->Pos.y + window->Size.y, static_cast<float>(height));
    EXPECT_EQ(window->ScrollMax.y, 0) << width << ": all of it is seen";
    bool started = false, headset = false, left_handed = false;
    for (float y = window->Pos.y; y < window->Pos.y + window->Size.y; y += 6) {
      const double x = window->Pos.x + 2 * ImGui::GetFontSize();
      frame(x, y);
      frame(x, y, true);
      started = frame(x, y) == MenuWish::start || started;
      headset = headset || chosen.view() == "headset";
      left_handed = left_handed || chosen.left_handed();
    }
    EXPECT_TRUE(started) << width;
    EXPECT_TRUE(headset) << width;
    EXPECT_TRUE(left_handed) << width;
    EXPECT_EQ(chosen.scenario(), "d") << "the last that the pointer came by";
  }
}

}  // namespace
}  // namespace stylet::desktop
