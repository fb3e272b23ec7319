// What someone who has never seen it, or a cat, does at a window: any key, any motion, any size, at any time.
//
// STYLET_RANDOM_STEPS: steps of each of the hundred users, all of them drawn; unset: few, some of them drawn.
// Run so by tools/test.sh --all.
#include "engine/recording/recording.h"
#include "tests/desktop/running.h"
#include "tests/support/sanitized.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>

namespace stylet::desktop {
namespace {

constexpr int kMostWidth = 160, kMostHeight = 120;  // of the largest window

class RandomUser {
public:
  explicit RandomUser(unsigned seed) : random_(seed) {}

  int one_of(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }
  double within(double most) { return std::uniform_real_distribution<double>(-most, most)(random_); }

  view::Input step() {
    view::Input input;
    input.close = one_of(400) == 0;
    input.pointer_x = one_of(kMostWidth);
    input.pointer_y = one_of(kMostHeight);
    input.left = one_of(2) == 0;
    for (int presses = one_of(4); presses > 0; --presses) {
      input.presses.push_back({one_of(2) == 0, input.pointer_x - one_of(90), input.pointer_y - one_of(90)});
    }
    input.wheel = one_of(3) - 1;
    input.drag_x = within(0.5), input.drag_y = within(0.5);
    input.orbit_x = within(3), input.orbit_y = within(3);
    input.slide_x = within(1), input.slide_y = within(1), input.turn_x = within(1), input.turn_y = within(1);
    input.zoom = within(30);
    input.advance = within(20);
    input.shift = one_of(2) == 0;
    for (int k = one_of(6); k > 0; --k) {
      const auto key = static_cast<view::Key>(one_of(view::kKeys));
      const bool ends = key == view::Key::q || key == view::Key::backspace || key == view::Key::enter;  // mostly
      if (ends && one_of(12) != 0) continue;
      input.strokes.push_back({.key = key, .shift = one_of(2) == 0, .repeated = !ends && one_of(4) == 0});
    }
    if (one_of(60) == 0) input.strokes.push_back({.key = view::Key::enter});
    return input;
  }

private:
  std::mt19937 random_;
};

/// The size of a window: another now and then, none while it is minimised.
struct WindowSize {
  int width = kMostWidth, height = kMostHeight;
  void change(RandomUser& user) {
    if (user.one_of(10) != 0) return;
    const bool minimised = user.one_of(4) == 0;
    width = minimised ? 0 : 16 + user.one_of(kMostWidth - 15);
    height = minimised ? 0 : 16 + user.one_of(kMostHeight - 15);
  }
};

TEST(RandomUsers, AHundredBreakNothing) {
  const char* asked = std::getenv("STYLET_RANDOM_STEPS");
  const int steps = asked != nullptr ? std::atoi(asked) : 20;
  const int drawn_of = asked != nullptr ? 1 : 20;
  const int users = asked == nullptr && support::kSanitized ? 25 : 100;
  std::atomic<std::uint32_t> messages{0};
  int sessions = 0, minimised = 0, drawn = 0, unplugged = 0;
  {
    gpu::Device device({.validation = std::getenv("STYLET_VALIDATION") != nullptr, .message_counter = &messages});
    view::Overlay overlay(device, VK_FORMAT_R8G8B8A8_SRGB);
    std::optional<Running> running;
    const auto end_session = [&] {
      const session::RunStatistics run = running->stop();
      EXPECT_EQ(run.needle_flags & (physics::kNeedleRowOverflow | physics::kNeedleNonFinite), 0u);
      const recording::Recording recording = recording::read_recording(running->folder / "session.rec");
      EXPECT_TRUE(recording.complete()) << recording.condition();
      EXPECT_EQ(recording.haptic.size(), run.haptic.steps);
      running.reset();
    };
    for (int who = 0; who < users; ++who) {
      RandomUser user(20261122U + static_cast<unsigned>(who));
      WindowSize window;
      for (int step = 0; step < steps; ++step) {
        if (!running) {
          running.emplace(device, kMostWidth, kMostHeight, true);
          ++sessions;
        }
        if (user.one_of(15) == 0) {
          running->stylus.plugged = !running->stylus.plugged;
          ++unplugged;
        }
        window.change(user);
        const view::Input input = user.step();
        overlay.begin({.width = window.width,
                       .height = window.height,
                       .pointer_x = input.pointer_x,
                       .pointer_y = input.pointer_y,
                       .left = input.left,
                       .wheel = input.wheel});
        if (!running->desktop.handle(overlay.wants_pointer() ? view::without_pointer(input) : input)) {
          end_session();
          continue;
        }
        ASSERT_TRUE(std::isfinite(running->live.time_s()));
        ASSERT_FALSE(running->live.finished());
        if (window.width == 0) {
          ++minimised;
          continue;
        }
        if ((who + step) % drawn_of != 0) continue;
        ++drawn;
        running->desktop.draw(window.width, window.height, user.one_of(5) == 0 ? 0.3 : 0.02);  // seldom a new size
        gpu::run_now(device, [&](gpu::Commands& commands) {
          commands.clear(running->image, {0, 0, 0, 1});
          overlay.draw(commands, running->image);
        });
      }
    }
    if (running) end_session();
  }
  EXPECT_EQ(messages.load(), 0u) << "validation messages";
  EXPECT_GT(sessions, users / 10);
  EXPECT_GT(minimised, users / 5);
  EXPECT_GT(drawn, users / 5);
  EXPECT_GT(unplugged, users / 2);
  std::printf("%d users, %d steps each, in %d sessions; %d frames, %d times minimised, %d times pulled out or in\n",
              users, steps, sessions, drawn, minimised, unplugged);
}

}  // namespace
}  // namespace stylet::desktop
