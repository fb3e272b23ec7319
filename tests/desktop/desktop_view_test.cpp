// A running session on a desktop without a window: what its input does, and that nothing a user does breaks it.
#include "engine/desktop/desktop_view.h"

#include "engine/content/scenario.h"
#include "engine/session/live_session.h"
#include "tests/content/small_scenario.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <random>

namespace stylet::desktop {
namespace {

TEST(RenderScale, DrawsFewerPixelsWhereFramesAreSlowAndMoreAgainWhereTheyAreQuick) {
  RenderScale scale;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(scale.after(0.016), 1);
  for (int i = 0; i < 12; ++i) EXPECT_EQ(scale.after(0.080), 1);  // 0.96 s
  EXPECT_EQ(scale.after(0.080), 0.75);
  for (int i = 0; i < 100; ++i) scale.after(0.080);
  EXPECT_EQ(scale.now(), 0.5);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(scale.after(0.030), 0.5);  // neither slow nor quick
  for (int i = 0; i < 1000; ++i) scale.after(0.005);
  EXPECT_EQ(scale.now(), 1);
}

TEST(SessionWatch, AFrameThatIsNotFiniteIsPassedOver) {
  const content::Scene scene;
  SessionWatch watch(scene);
  state::FrameState frame;
  frame.needle_positions.assign(2, Eigen::Vector3f::Zero());
  frame.needle_orientations.assign(2, Eigen::Quaternionf::Identity());
  const auto points = [&] {
    SessionFacts facts;
    watch.fill(facts);
    return facts.force_curve.size();
  };
  frame.time_s = 1;
  watch.look(frame);
  EXPECT_EQ(points(), 1U);
  frame.time_s = 2;
  frame.insertion_depth = std::numeric_limits<float>::infinity();
  watch.look(frame);
  frame.insertion_depth = 0;
  frame.force.x() = std::numeric_limits<float>::quiet_NaN();
  watch.look(frame);
  EXPECT_EQ(points(), 1U);
  frame.force.x() = 1;
  watch.look(frame);
  EXPECT_EQ(points(), 2U);
}

const content::Scene& small_scene() {
  static const content::Scene scene = [] {
    content::test::SmallScenario small;
    small.scenario["labels"]["spacing_mm"] = 4;
    content::Scene loaded = content::load_scene(small.write());
    loaded.probe.scan_lines = 48;
    loaded.probe.samples = 128;
    return loaded;
  }();
  return scene;
}

haptic::MouseWorkspace workspace() {
  return {.entry = {0.1, 0, 0.05}, .axis = -Eigen::Vector3d::UnitZ(), .right = Eigen::Vector3d::UnitX()};
}

/// A session led by mouse and keyboard, started.
struct Running {
  explicit Running(gpu::Device& device, int width = 160, int height = 120)
      : live(small_scene(), mouse,
             {.duration_s = std::numeric_limits<double>::infinity(),
              .recording = folder / "session.rec",
              .probe = &probe}),
        image(device, {.width = static_cast<std::uint32_t>(width),
                       .height = static_cast<std::uint32_t>(height),
                       .format = VK_FORMAT_R8G8B8A8_SRGB,
                       .usage = gpu::kTargetUsage | VK_IMAGE_USAGE_TRANSFER_DST_BIT}),
        desktop(device, small_scene(), live,
                {.mouse = &mouse, .probe = &probe, .scanner = session::ScannerConsole(small_scene().probe)}) {
    live.start();
  }
  ~Running() { live.stop(); }

  support::TemporaryFolder folder;
  haptic::MouseDevice mouse{workspace()};
  session::HeldProbe probe{small_scene()};
  session::LiveSession live;
  gpu::Image image;
  DesktopView desktop;
};

struct Desktop : testing::Test {
  bool frame(Running& running, const view::Input& input, int width, int height, double dt_s = 0.3) {
    overlay.begin({.width = width,
                   .height = height,
                   .pointer_x = input.pointer_x,
                   .pointer_y = input.pointer_y,
                   .left = input.left,
                   .wheel = input.wheel});
    const bool goes_on = running.desktop.handle(overlay.wants_pointer() ? view::without_pointer(input) : input);
    running.desktop.draw(width, height, dt_s);
    gpu::run_now(device, [&](gpu::Commands& commands) {
      commands.clear(running.image, {0, 0, 0, 1});
      overlay.draw(commands, running.image);
    });
    return goes_on;
  }
  void TearDown() override { EXPECT_EQ(messages.load(), 0u) << "validation messages"; }

  std::atomic<std::uint32_t> messages{0};
  gpu::Device device{{.validation = std::getenv("STYLET_VALIDATION") != nullptr, .message_counter = &messages}};
  view::Overlay overlay{device, VK_FORMAT_R8G8B8A8_SRGB};
};

TEST_F(Desktop, KeysLeadNeedleAndProbeAndEndTheSession) {
  Running running(device);
  haptic::MouseDevice led(workspace());  // read here, and not by the loops
  DesktopView desktop(
      device, small_scene(), running.live,
      {.mouse = &led, .probe = &running.probe, .scanner = session::ScannerConsole(small_scene().probe)});
  const auto settled = [&](double now_s) {  // through one low-pass, then the other
    led.read(now_s);
    return led.read(now_s + 10).position;
  };
  const Eigen::Vector3d before = settled(0);
  view::Input input;
  input.strokes = {{.key = 'W'}, {.key = 'L'}, {.key = 262 /* right */}};
  EXPECT_TRUE(desktop.handle(input));
  const Eigen::Vector3d moved = settled(20) - before;
  EXPECT_NEAR(moved.z(), -0.002, 1e-9);
  EXPECT_NEAR(moved.x(), 0.002, 1e-9);
  EXPECT_NE(running.probe.moved(), content::ProbeMove{});
  input = {};
  input.keys = {'Q'};
  EXPECT_FALSE(desktop.handle(input));
}

TEST_F(Desktop, FollowsTheSizeOfItsWindow) {
  Running running(device);
  frame(running, {}, 160, 120);
  EXPECT_EQ(running.desktop.scene().settings().width, 160u);
  frame(running, {}, 120, 100);
  frame(running, {}, 120, 100);
  EXPECT_EQ(running.desktop.scene().settings().width, 120u);
  EXPECT_EQ(running.desktop.scene().settings().height, 100u);
}

// What someone who has never seen it, or a cat, does: any key, any motion, any size, at any time.
TEST_F(Desktop, SurvivesAHundredRandomUsers) {
  constexpr int kSessions = 4, kUsers = 25;
  const int frames = support::kSanitized ? 1 : 3;
  std::mt19937 random(20261122);
  const auto one_of = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  const auto within = [&](double most) { return std::uniform_real_distribution<double>(-most, most)(random); };
  for (int session = 0; session < kSessions; ++session) {
    Running running(device);
    for (int user = 0; user < kUsers; ++user) {
      const int width = 16 + one_of(145), height = 16 + one_of(105);
      for (int i = 0; i < frames; ++i) {
        view::Input input;
        input.pointer_x = one_of(160);
        input.pointer_y = one_of(120);
        input.left = one_of(2) == 0;
        input.wheel = one_of(3) - 1;
        input.drag_x = within(0.5), input.drag_y = within(0.5);
        input.orbit_x = within(3), input.orbit_y = within(3);
        input.slide_x = within(1), input.slide_y = within(1), input.turn_x = within(1), input.turn_y = within(1);
        input.zoom = within(30);
        input.advance = within(20);
        input.shift = one_of(2) == 0;
        for (int k = one_of(6); k > 0; --k) {
          const int key = one_of(2) == 0 ? 32 + one_of(64) : 256 + one_of(60);
          input.strokes.push_back({.key = key, .shift = one_of(2) == 0, .repeated = one_of(4) == 0});
          if (key != 'Q') input.keys.push_back(key);
        }
        ASSERT_TRUE(frame(running, input, width, height, user % 5 == 0 ? 0.3 : 0.02));  // seldom a new size
      }
    }
    EXPECT_TRUE(std::isfinite(running.live.time_s()));
    EXPECT_FALSE(running.live.finished());
  }
}

}  // namespace
}  // namespace stylet::desktop
