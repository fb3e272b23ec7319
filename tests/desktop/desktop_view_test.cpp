// A running session on a desktop without a window: what its input does.
#include "engine/desktop/desktop_view.h"
#include "engine/desktop/framing.h"
#include "engine/recording/recording.h"

#include "tests/desktop/running.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

namespace stylet::desktop {
namespace {

TEST(RenderScale, DrawsFewerPixelsWhereFramesAreSlowAndMoreAgainWhereTheyAreQuick) {
  RenderScale scale;
  const auto after = [&](int frames, double frame_s) {
    for (int i = 0; i < frames; ++i) scale.after(frame_s);
    return scale.now();
  };
  EXPECT_EQ(after(200, 0.016), 1);
  EXPECT_EQ(after(100, 0.080), 1) << "twelve frames a second: sharp ones";
  EXPECT_EQ(after(20, 0.100), 0.85) << "two seconds of less than ten, in the first of them quicker ones";
  EXPECT_EQ(after(100, 0.100), 0.5);
  EXPECT_EQ(after(200, 0.070), 0.5) << "neither slow nor quick";
  EXPECT_EQ(after(1000, 0.010), 1);
}

TEST(RenderScale, JudgesFramesWithAndWithoutAnUltrasoundImageByTheirMean) {
  RenderScale scale;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(scale.after(i % 2 == 0 ? 0.045 : 0.115), 1) << "80 ms on average";
  for (int i = 0; i < 100; ++i) scale.after(i % 2 == 0 ? 0.07 : 0.14);
  EXPECT_LT(scale.now(), 0.7);
}

TEST(RenderScale, AStepUpIsNotTakenBackAtOnce) {
  // A frame takes as long as it has pixels, and 10 ms: the worst that a step can do.
  for (double all_s = 0.02; all_s < 0.2; all_s += 0.001) {
    RenderScale scale;
    const auto frame_s = [&] { return 0.010 + all_s * scale.now() * scale.now(); };
    for (int i = 0; i < 400; ++i) scale.after(frame_s());
    int steps = 0;
    for (int i = 0; i < 400; ++i) {
      const double before = scale.now();
      steps += scale.after(frame_s()) != before ? 1 : 0;
    }
    EXPECT_LE(steps, 1) << all_s;
  }
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
  EXPECT_LT(moved.z(), -0.001);
  EXPECT_GT(moved.head<2>().norm(), 0.0015) << "L";
  EXPECT_NE(running.probe.moved(), content::ProbeMove{});
  input = {};
  input.strokes = {{.key = view::Key::q}};
  EXPECT_FALSE(desktop.handle(input));
}

TEST_F(Desktop, TheLeftButtonMeasuresOnTheImageAndLeadsTheNeedleBesideIt) {
  Running running(device);
  haptic::MouseDevice led(workspace());
  scanner::SavedImages saved;
  DesktopView desktop(
      device, small_scene(), running.live,
      {.mouse = &led, .arrangement = {.scanner = scanner::ScannerConsole(small_scene().probe)}, .saved = &saved});
  double now_s = 0;
  const auto at = [&] {  // through one low-pass, then the other
    led.read(now_s += 10);
    return led.read(now_s += 10).position;
  };
  const auto measures = [&] { return desktop.scanner().calipers().distances(); };
  const auto turn = [&](const view::Input& input) {
    overlay.begin({.width = 1280, .height = 720});
    EXPECT_TRUE(desktop.handle(input));
    desktop.draw(1280, 720, 0.02);
  };
  turn({});
  const picture::Pane place = desktop.scanner_place();
  const double x = place.x + 0.5 * place.width, y = place.y + 0.5 * place.height;
  const Eigen::Vector3d before = at();
  // Dragged over the image, and a way beyond it, all within a frame and over several.
  turn({.drag_x = 0.1, .pointer_x = x, .pointer_y = y, .left = true, .presses = {{true, x, y}}});
  turn({.drag_x = -0.4, .pointer_x = x - 400, .pointer_y = y, .left = true});
  turn({.drag_x = 0.3, .pointer_x = x, .pointer_y = y + 50, .presses = {{false, x, y + 50}}});
  ASSERT_EQ(measures().size(), 1U);
  const double per_pixel = measures()[0] / 50;
  turn({.pointer_x = x, .pointer_y = y, .left = true, .presses = {{true, x, y}, {false, x, y}}});
  turn({.pointer_x = x + 30, .pointer_y = y});
  turn({.presses = {{true, x + 30, y + 40}, {false, x + 30, y + 40}}});
  ASSERT_EQ(measures().size(), 2U);
  EXPECT_NEAR(measures()[1], 50 * per_pixel, 1e-9) << "30, 40, 50 pixels";
  EXPECT_EQ(at(), before) << "the needle stays";
  turn({.drag_x = 0.1, .pointer_x = 100, .pointer_y = 360, .left = true, .presses = {{true, 90, 360}}});
  EXPECT_NE(at(), before);
  EXPECT_EQ(measures().size(), 2U);
  turn({.strokes = {{.key = view::Key::space}}});
  EXPECT_NE(desktop.scanner().note().find("measure"), std::string::npos) << "says what can be done now";
  turn({.strokes = {{.key = view::Key::f12}}});
  ASSERT_EQ(saved.size(), 1U);
  EXPECT_EQ(saved[0].distances, measures());
  turn({.strokes = {{.key = view::Key::u}}});
  EXPECT_EQ(measures().size(), 1U);
  turn({.strokes = {{.key = view::Key::u, .shift = true}}});
  EXPECT_TRUE(measures().empty());
}

TEST_F(Desktop, IsMirroredForLeftHandsAndTheNeedleStaysInSight) {
  Running running(device);
  content::Scene scene = small_scene();
  scene.camera.eye = {-0.1, -0.1, 0.6};  // from where the needle lies under the image on the right
  scene.camera.look_at = {-0.1, -0.1, 0};
  DesktopView desktop(device, scene, running.live,
                      {.arrangement = {.scanner = scanner::ScannerConsole(scene.probe)}});
  const auto turn = [&](const view::Input& input) {
    overlay.begin({.width = 1280, .height = 720});
    EXPECT_TRUE(desktop.handle(input));
    desktop.draw(1280, 720, 0.02);
  };
  for (int i = 0; i < 200 && !desktop.arrangement().home; ++i) turn({});
  const picture::Pane right = desktop.scanner_place();
  const auto before = desktop.arrangement();
  ASSERT_TRUE(before.home.has_value()) << "the needle is known";
  turn({.strokes = {{.key = view::Key::f10}}});
  EXPECT_EQ(desktop.scanner_place().x, 1280 - right.x - right.width);
  const auto mirrored = desktop.arrangement();
  EXPECT_TRUE(mirrored.panels.left_handed());
  EXPECT_EQ(mirrored.camera->eye, mirrored.home->eye) << "a camera that nobody has turned follows";
  EXPECT_NE(mirrored.home->eye, before.home->eye) << "the needle would lie under the image";
  turn({.orbit_x = 0.1});
  const auto turned = desktop.arrangement();
  turn({.strokes = {{.key = view::Key::f10}}});
  EXPECT_EQ(desktop.arrangement().camera->eye, turned.camera->eye) << "one that was turned stays";
  EXPECT_EQ(desktop.arrangement().home->eye, before.home->eye);
}

TEST_F(Desktop, ADragMovesTheNeedleThatWayOnTheScreenFromAnySide) {
  Running running(device);
  haptic::MouseDevice led(workspace());  // read here, and not by the loops
  DesktopView desktop(device, small_scene(), running.live,
                      {.mouse = &led, .arrangement = {.scanner = scanner::ScannerConsole(small_scene().probe)}});
  double now_s = 0;
  const auto settled = [&] {  // through one low-pass, then the other
    led.read(now_s += 10);
    return led.read(now_s += 10).position;
  };
  settled();
  for (int side = 0; side < 12; ++side) {
    EXPECT_TRUE(desktop.handle({.orbit_x = 0.175}));
    const content::Camera camera = desktop.arrangement().camera.value_or(small_scene().camera);
    const Eigen::Vector2d before = projected(camera, settled(), 1280, 720);
    EXPECT_TRUE(desktop.handle({.drag_x = 0.01, .drag_y = side % 2 == 0 ? 0.0 : 0.01}));
    const Eigen::Vector2d went = projected(camera, settled(), 1280, 720) - before;
    const Eigen::Vector2d drag(1, side % 2);
    EXPECT_GT(went.dot(drag.normalized()), 0.94 * went.norm()) << "side " << side << ": " << went.transpose();
    EXPECT_GT(went.norm(), 0.5) << "pixels, side " << side;
  }
}

TEST_F(Desktop, AKeyAsksForTheBreathToBeHeldAndLetsItGo) {
  using State = session::HeldBreath::State;
  Running running(device);
  session::HeldBreath breath({.amplitude = 1, .period = 1});
  DesktopView desktop(device, small_scene(), running.live,
                      {.breath = &breath, .arrangement = {.scanner = scanner::ScannerConsole(small_scene().probe)}});
  view::Input f8;
  f8.strokes = {{.key = view::Key::f8}};
  EXPECT_TRUE(desktop.handle(f8));
  EXPECT_EQ(breath.state(), State::breathing_out);
  for (int i = 0; i < 60; ++i) breath.inspiration(0.02 * i);
  EXPECT_TRUE(desktop.handle({}));
  EXPECT_EQ(breath.state(), State::held);
  f8.strokes[0].repeated = true;
  EXPECT_TRUE(desktop.handle(f8));
  EXPECT_EQ(breath.state(), State::held) << "a key that is held asks once";
  f8.strokes[0].repeated = false;
  EXPECT_TRUE(desktop.handle(f8));
  EXPECT_EQ(breath.state(), State::breathing);
  running.stop();
  std::vector<std::string> names;
  for (const recording::EventRecord& event : recording::read_recording(running.folder / "session.rec").events) {
    if (event.name.starts_with("breath")) names.push_back(event.name);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"breath_out", "breath_held", "breathing"}));
}

TEST_F(Desktop, AButtonOfTheStylusAsksForTheBreathAsTheKeyDoes) {
  using State = session::HeldBreath::State;
  Running running(device);
  session::HeldBreath breath({.amplitude = 1, .period = 1}, 4);
  DesktopView desktop(device, small_scene(), running.live,
                      {.breath = &breath, .arrangement = {.scanner = scanner::ScannerConsole(small_scene().probe)}});
  const auto press = [&](std::uint32_t buttons) {
    recording::HapticStepRecord record;
    record.buttons = buttons;
    for (int i = 0; i < 5; ++i) breath.haptic_stepped(record, {});
    EXPECT_TRUE(desktop.handle({}));
    return breath.state();
  };
  EXPECT_EQ(press(3), State::breathing) << "other buttons";
  EXPECT_EQ(press(4), State::breathing_out) << "once, however long it is held";
  EXPECT_EQ(press(0), State::breathing_out);
  for (int i = 0; i < 60; ++i) breath.inspiration(0.02 * i);
  EXPECT_EQ(press(5), State::breathing);
  running.stop();
  std::vector<std::string> names;
  for (const recording::EventRecord& event : recording::read_recording(running.folder / "session.rec").events) {
    if (event.name.starts_with("breath")) names.push_back(event.name);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"breath_out", "breathing"}));
}

TEST_F(Desktop, AKeyMutesAlsoWhenTheSessionIsOver) {
  Running running(device);
  sound::Speaker speaker(true);
  DesktopView desktop(
      device, small_scene(), running.live,
      {.arrangement = {.scanner = scanner::ScannerConsole(small_scene().probe)}, .speaker = &speaker});
  view::Input f7;
  f7.strokes = {{.key = view::Key::f7}};
  EXPECT_TRUE(desktop.handle(f7));
  EXPECT_FALSE(speaker.muted());
  f7.strokes[0].repeated = true;
  EXPECT_TRUE(desktop.handle(f7));
  EXPECT_FALSE(speaker.muted()) << "a key that is held asks once";
  f7.strokes[0].repeated = false;
  desktop.end({});
  EXPECT_EQ(desktop.handle_at_end(f7, ""), std::nullopt);
  EXPECT_TRUE(speaker.muted());
  EXPECT_TRUE(running.desktop.handle(f7)) << "without a speaker there is nothing to mute";
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

TEST_F(Desktop, AtTheEndKeysSayWhatComesNext) {
  Running running(device, 160, 120, true);
  view::Input finish;
  finish.strokes = {{.key = view::Key::enter}};
  EXPECT_TRUE(frame(running, finish, 160, 120));
  EXPECT_FALSE(frame(running, finish, 160, 120)) << "the course is over";
  running.stop();
  running.desktop.end({.score = 41, .pass_mark = 60, .advice = "Aim before you enter the skin."});
  const auto at_end = [&](const view::Input& input, const std::string& next = "Ablation") {
    overlay.begin({.width = 160,
                   .height = 120,
                   .pointer_x = input.pointer_x,
                   .pointer_y = input.pointer_y,
                   .left = input.left});
    const auto wish = running.desktop.handle_at_end(input, next);
    running.desktop.draw(160, 120, 0.02);
    return wish;
  };
  const auto pressed = [&](view::Key key, const std::string& next = "Ablation") {
    view::Input input;
    input.strokes = {{.key = key}};
    return at_end(input, next);
  };
  EXPECT_EQ(pressed(view::Key::enter), std::nullopt) << "whoever presses twice loses nothing";
  EXPECT_EQ(pressed(view::Key::w), std::nullopt);
  EXPECT_EQ(pressed(view::Key::o), EndWish(EndButton::debrief));
  EXPECT_EQ(pressed(view::Key::n), EndWish(EndButton::next));
  EXPECT_EQ(pressed(view::Key::n, ""), std::nullopt) << "nothing comes next";
  EXPECT_EQ(pressed(view::Key::backspace), EndWish(CourseButton::again));
  EXPECT_EQ(pressed(view::Key::q), EndWish(EndButton::leave));
}

// What is shown is drawn once: while a session stands, no pass of the scene or of the scanner is recorded.
TEST_F(Desktop, ASessionThatStandsIsNotDrawnAgain) {
  constexpr double kQuick = 0.02;  // s: the size of the picture stays, too
  Running running(device);
  do {
    frame(running, {}, 160, 120, kQuick);
  } while (!running.desktop.thinned());
  running.live.pause();
  running.stop();  // a step under way when it is paused still counts
  for (int i = 0; i < 5; ++i) frame(running, {}, 160, 120, kQuick);
  const std::uint64_t scenes = running.desktop.scenes_drawn(), screens = running.desktop.scanner().screens();
  EXPECT_GT(scenes, 0U);
  for (int i = 0; i < 5; ++i) frame(running, {}, 160, 120, kQuick);
  EXPECT_EQ(running.desktop.scenes_drawn(), scenes);
  EXPECT_EQ(running.desktop.scanner().screens(), screens);
  EXPECT_TRUE(running.desktop.pass_times().empty());
  frame(running, {.orbit_x = 0.1}, 160, 120, kQuick);
  EXPECT_EQ(running.desktop.scenes_drawn(), scenes + 1) << "looking round goes on";
  frame(running, {.strokes = {{.key = view::Key::g}}}, 160, 120, kQuick);
  EXPECT_EQ(running.desktop.scanner().screens(), screens + 1) << "and the knobs turn";
  EXPECT_EQ(running.desktop.scenes_drawn(), scenes + 2) << "the scanner's screen stands in the room";
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
