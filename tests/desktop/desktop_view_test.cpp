// A running session on a desktop without a window: what its input does.
#include "engine/desktop/desktop_view.h"

#include "tests/desktop/running.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <limits>

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

TEST(SessionWatch, TellsTheScaleOfTheForceAndWhenTheStylusCannotGiveIt) {
  const content::Scene scene;
  panels::SessionWatch watch(scene);
  state::FrameState frame;
  frame.needle_positions.assign(2, Eigen::Vector3f::Zero());
  frame.needle_orientations.assign(2, Eigen::Quaternionf::Identity());
  frame.force_scale = 0.5F;
  const auto told = [&] {
    frame.time_s += 1;
    watch.look(frame);
    panels::SessionFacts facts;
    watch.fill(facts);
    EXPECT_EQ(facts.force_scale, 0.5);
    return facts.warnings.front().text;
  };
  EXPECT_EQ(told(), "nothing to remark");
  frame.force_clipped = 1;
  EXPECT_EQ(told(), "stylus cannot give this force");
}

TEST(SessionWatch, AFrameThatIsNotFiniteIsPassedOver) {
  const content::Scene scene;
  panels::SessionWatch watch(scene);
  state::FrameState frame;
  frame.needle_positions.assign(2, Eigen::Vector3f::Zero());
  frame.needle_orientations.assign(2, Eigen::Quaternionf::Identity());
  const auto points = [&] {
    panels::SessionFacts facts;
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
  DesktopView desktop(device, small_scene(), running.live,
                      {.mouse = &led,
                       .probe = &running.probe,
                       .arrangement = {.scanner = scanner::ScannerConsole(small_scene().probe)}});
  const auto settled = [&](double now_s) {  // through one low-pass, then the other
    led.read(now_s);
    return led.read(now_s + 10).position;
  };
  const Eigen::Vector3d before = settled(0);
  view::Input input;
  input.strokes = {{.key = view::Key::w}, {.key = view::Key::l}, {.key = view::Key::right}};
  EXPECT_TRUE(desktop.handle(input));
  const Eigen::Vector3d moved = settled(20) - before;
  EXPECT_NEAR(moved.z(), -0.002, 1e-9);
  EXPECT_NEAR(moved.x(), 0.002, 1e-9);
  EXPECT_NE(running.probe.moved(), content::ProbeMove{});
  input = {};
  input.strokes = {{.key = view::Key::q}};
  EXPECT_FALSE(desktop.handle(input));
}

TEST_F(Desktop, IsArrangedAsTheOneBeforeItWas) {
  Running running(device);
  view::Input input;
  input.strokes = {{.key = view::Key::f4}};
  input.orbit_x = 0.1;
  EXPECT_TRUE(running.desktop.handle(input));
  const Arrangement arranged = running.desktop.arrangement();
  const DesktopView next(device, small_scene(), running.live, {.arrangement = arranged});
  EXPECT_TRUE(next.panels().instructor());
  EXPECT_EQ(next.arrangement().camera->eye, arranged.camera->eye);
  EXPECT_NE(arranged.camera->eye, small_scene().camera.eye);
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

}  // namespace
}  // namespace stylet::desktop
