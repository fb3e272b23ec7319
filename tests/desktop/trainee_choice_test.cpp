// The choice of who trains, drawn into nothing and used by keys and pointer.
#include "engine/panels/trainee_choice.h"

#include "engine/desktop/layout.h"
#include "engine/gpu/device.h"
#include "engine/readers/texts_file.h"
#include "engine/view/overlay.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <imgui_internal.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace stylet::panels {
namespace {

using desktop::text_scale;
using view::Key;

/// Bob has the PIN 2468; each wrong try waits twice as long.
class TraineeChoiceTest : public ::testing::Test {
protected:
  TraineeChoice choice(std::vector<TraineeEntry> more = {}) {
    std::vector<TraineeEntry> entries{{.pseudonym = "P-BOB", .name = "Bob", .has_pin = true},
                                      {.pseudonym = "P-ADA", .name = "Ada L"}};
    entries.insert(entries.end(), more.begin(), more.end());
    return {std::move(entries), 12, [this](const std::string& pseudonym, const std::string& pin) {
              tries_.push_back(pseudonym + " " + pin);
              if (waits_) return PinAnswer{.looked_at = false, .wait_s = 7};
              if (pin == "2468") return PinAnswer{.right = true};
              return PinAnswer{.wait_s = std::int64_t{1} << tries_.size()};
            }};
  }
  static TraineeWish press(TraineeChoice& choice, const std::vector<Key>& keys) {
    TraineeWish wish = TraineeWish::nothing;
    for (const Key key : keys) {
      view::Input input;
      input.strokes = {{.key = key}};
      wish = choice.handle(input);
    }
    return wish;
  }
  static std::vector<Key> digits(const std::string& pin) {
    std::vector<Key> keys;
    for (const char digit : pin) keys.push_back(Key::digit_0 + (digit - '0'));
    return keys;
  }

  std::vector<std::string> tries_;
  bool waits_ = false;
};

TEST_F(TraineeChoiceTest, NobodyIsChosenAtFirstAndEnterGoesOn) {
  TraineeChoice nobody = choice();
  EXPECT_EQ(nobody.pseudonym(), "");
  EXPECT_EQ(press(nobody, {Key::enter}), TraineeWish::chosen);
  EXPECT_EQ(press(nobody, {Key::backspace}), TraineeWish::back);
  view::Input closed;
  closed.close = true;
  EXPECT_EQ(nobody.handle(closed), TraineeWish::back);
}

TEST_F(TraineeChoiceTest, KeysChooseByOrderAndByLetter) {
  TraineeChoice keys = choice();
  EXPECT_EQ(press(keys, {Key::down}), TraineeWish::nothing);
  EXPECT_EQ(keys.pseudonym(), "P-ADA") << "by name";
  press(keys, {Key::page_down});
  EXPECT_EQ(keys.pseudonym(), "P-BOB");
  press(keys, {Key::a});
  EXPECT_EQ(keys.pseudonym(), "P-ADA");
  EXPECT_EQ(press(keys, {Key::enter}), TraineeWish::chosen) << "without a PIN the name is enough";
  press(keys, {Key::page_up});
  EXPECT_EQ(keys.pseudonym(), "");
  press(keys, {Key::z});
  EXPECT_EQ(keys.pseudonym(), "") << "nobody begins with that";
  keys.choose("P-BOB");
  EXPECT_EQ(keys.pseudonym(), "P-BOB");
  keys.choose("gone");
  EXPECT_EQ(keys.pseudonym(), "");
}

TEST_F(TraineeChoiceTest, ThePinIsAskedForAndAWrongOneLetsNobodyIn) {
  TraineeChoice bob = choice();
  bob.choose("P-BOB");
  EXPECT_EQ(press(bob, {Key::enter}), TraineeWish::nothing);
  EXPECT_TRUE(bob.asks_for_pin());
  EXPECT_EQ(press(bob, {Key::enter}), TraineeWish::nothing);
  EXPECT_TRUE(tries_.empty()) << "nothing was typed";
  press(bob, digits("1111"));
  EXPECT_EQ(press(bob, {Key::enter}), TraineeWish::nothing);
  EXPECT_TRUE(bob.asks_for_pin());
  waits_ = true;
  press(bob, digits("2468"));
  EXPECT_EQ(press(bob, {Key::enter}), TraineeWish::nothing) << "too early";
  waits_ = false;
  press(bob, digits("24689"));
  press(bob, {Key::backspace});
  EXPECT_EQ(press(bob, {Key::enter}), TraineeWish::chosen);
  EXPECT_EQ(tries_, (std::vector<std::string>{"P-BOB 1111", "P-BOB 2468", "P-BOB 2468"}));
  EXPECT_EQ(bob.pseudonym(), "P-BOB");
  // Backspace on an empty PIN leads to the names, letters do nothing there.
  press(bob, {Key::enter, Key::a});
  EXPECT_EQ(bob.pseudonym(), "P-BOB");
  EXPECT_EQ(press(bob, {Key::backspace}), TraineeWish::nothing);
  EXPECT_FALSE(bob.asks_for_pin());
}

TEST_F(TraineeChoiceTest, WhoHasNeitherDigitsNorLettersChoosesAndTypesByFewButtons) {
  TraineeChoice bob = choice();
  press(bob, {Key::tab, Key::tab});
  EXPECT_EQ(bob.pseudonym(), "P-BOB");
  press(bob, {Key::tab});
  EXPECT_EQ(bob.pseudonym(), "") << "round and round";
  press(bob, {Key::tab, Key::tab});
  EXPECT_EQ(press(bob, {Key::space}), TraineeWish::nothing);
  ASSERT_TRUE(bob.asks_for_pin());
  // The pad is 789 456 123 0: from 7 to 2, 4, 6, then 9, which is taken back, and 8; Go on is right of it.
  press(bob, {Key::down, Key::down, Key::right, Key::space});
  press(bob, {Key::up, Key::left, Key::left, Key::space});
  press(bob, {Key::right, Key::right, Key::space});
  press(bob, {Key::up, Key::up, Key::space});
  press(bob, {Key::down, Key::down, Key::down, Key::space});
  press(bob, {Key::up, Key::up, Key::up, Key::space});
  EXPECT_EQ(press(bob, {Key::right, Key::right, Key::down, Key::up, Key::space}), TraineeWish::chosen);
  EXPECT_EQ(tries_, (std::vector<std::string>{"P-BOB 2468"}));
  // By two buttons alone: Other name is the last key.
  press(bob, {Key::space});
  ASSERT_TRUE(bob.asks_for_pin());
  for (int i = 0; i < 12; ++i) press(bob, {Key::tab});
  EXPECT_EQ(press(bob, {Key::space}), TraineeWish::nothing);
  EXPECT_FALSE(bob.asks_for_pin());
}

TEST_F(TraineeChoiceTest, ThePointerDoesTheSameInWindowsOfEverySizeAndInGerman) {
  gpu::Device device{gpu::DeviceSettings{}};
  std::vector<TraineeEntry> many;
  for (int i = 0; i < 100; ++i) many.push_back({.pseudonym = fmt::format("P{}", i), .name = fmt::format("Z {}", i)});
  for (const auto& size : {std::pair{1024, 640}, {1280, 720}, {3840, 2160}}) {
    const int width = size.first, height = size.second;
    view::Overlay overlay(device, VK_FORMAT_R8G8B8A8_SRGB, text_scale(width, height, 1));
    const content::Texts german = readers::find_texts("de");
    for (const bool long_list : {false, true}) {
      tries_.clear();
      TraineeChoice clicked = choice(long_list ? many : std::vector<TraineeEntry>{});
      const auto frame = [&](double x = -1, double y = -1, bool left = false) {
        overlay.begin({.width = width, .height = height, .pointer_x = x, .pointer_y = y, .left = left});
        return clicked.draw(width, height, german);
      };
      const auto settled = [&] {
        for (int i = 0; i < 3; ++i) frame();
        const ImGuiWindow* window = ImGui::FindWindowByName("###trainee");
        EXPECT_GE(window->Pos.y, 0);
        EXPECT_LE(window->Pos.y + window->Size.y, static_cast<float>(height));
        EXPECT_EQ(window->ScrollMax.y, 0) << width << ": all of it is seen";
        return window;
      };
      const auto click = [&](double x, double y) {
        frame(x, y);
        frame(x, y, true);
        return frame(x, y);
      };
      /// Clicks down the middle of a column until `until` holds.
      const auto sweep = [&](double column, const auto& until) {
        const ImGuiWindow* window = settled();
        const double from = window->Pos.y, to = window->Pos.y + window->Size.y;
        const double x = window->Pos.x + column * ImGui::GetFontSize();
        TraineeWish wish = TraineeWish::nothing;
        for (double y = from; y < to && !until(wish); y += ImGui::GetFontSize() / 3) wish = click(x, y);
        return until(wish);
      };
      EXPECT_TRUE(sweep(3, [&](TraineeWish) { return clicked.pseudonym() == "P-ADA"; })) << width;
      EXPECT_TRUE(sweep(3, [&](TraineeWish) { return clicked.pseudonym() == "P-BOB"; })) << width;
      // The button under the list, then the pad.
      clicked.choose("P-BOB");
      EXPECT_EQ(press(clicked, {Key::enter}), TraineeWish::nothing);
      const ImGuiWindow* window = settled();
      const double column = window->Pos.x + ImGui::GetStyle().WindowPadding.x + 1.6 * ImGui::GetFontSize();
      // Down the pad's first column.
      for (double y = window->Pos.y; y < window->Pos.y + window->Size.y; y += 1.4 * ImGui::GetFontSize()) {
        click(column, y);
      }
      press(clicked, {Key::enter});
      ASSERT_EQ(tries_.size(), 1u) << width;
      for (const char digit : std::string("7410")) {
        EXPECT_NE(tries_[0].find(digit), std::string::npos) << tries_[0];
      }
    }
  }
}

TEST_F(TraineeChoiceTest, ANameIsDrawnAsItIsWritten) {
  gpu::Device device{gpu::DeviceSettings{}};
  view::Overlay overlay(device, VK_FORMAT_R8G8B8A8_SRGB, 1);
  // Dear ImGui would end a label at "##" and take the rest for its id.
  const std::string name = "Eva ## of ward seven, the one who comes on Mondays";
  TraineeChoice drawn = choice({{.pseudonym = "P-EVA", .name = name}});
  for (int i = 0; i < 3; ++i) {
    overlay.begin({.width = 1280, .height = 720, .pointer_x = -1, .pointer_y = -1});
    drawn.draw(1280, 720, {});
  }
  float widest = 0;
  for (const ImGuiWindow* window : ImGui::GetCurrentContext()->Windows) {
    if (std::string(window->Name).find("/names") != std::string::npos) widest = window->ContentSize.x;
  }
  EXPECT_GE(widest, ImGui::CalcTextSize(name.c_str(), nullptr, false).x);
}

TEST_F(TraineeChoiceTest, WhatItSaysIsInGermanToo) {
  const content::Texts german = readers::find_texts("de");
  for (const char* english :
       {"Who trains?", "Without a name: nothing is kept", "Go on", "Back", "Other name", "Delete",
        "The PIN is wrong; the next try in 4 s", "Too early, the PIN was not looked at; the next try in 4 s"}) {
    EXPECT_NE(german.of(english), english);
  }
}

}  // namespace
}  // namespace stylet::panels
