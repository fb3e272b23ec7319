// What the trainee sees and holds: both eyes' disparity, and the controllers as needle and probe.
#include "engine/immersive/hands_on_patient.h"
#include "engine/immersive/immersive_view.h"
#include "engine/immersive/session_panel.h"
#include "engine/immersive/thumb_on_scanner.h"
#include "engine/immersive/trainee_panel.h"
#include "engine/picture/picture.h"
#include "engine/render/room_layout.h"
#include "engine/session/puncture_watch.h"
#include "engine/view/offscreen.h"
#include "physics/messages/messages.h"
#include "tests/headset/rig.h"

#include <cmath>
#include <cstdlib>
#include <numbers>

namespace stylet::tests {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// A magenta ball in an empty room: nothing else there has its colour.
content::Scene ball_scene(const Vector3d& centre, double radius) {
  content::Scene scene;
  scene.tissues.resize(2);
  scene.tissues[1] = {.name = "ball", .colour = {1, 0, 1, 1}};
  content::Surface ball;
  ball.name = "ball";
  ball.tissue = 1;
  ball.role = content::SurfaceRole::visual;
  constexpr int kAround = 48, kAlong = 24;
  for (int j = 0; j <= kAlong; ++j) {
    for (int i = 0; i < kAround; ++i) {
      const double polar = std::numbers::pi * j / kAlong, turn = 2 * std::numbers::pi * i / kAround;
      const Vector3d normal(std::sin(polar) * std::cos(turn), -std::cos(polar), -std::sin(polar) * std::sin(turn));
      ball.positions.push_back((centre + radius * normal).cast<float>());
      ball.normals.push_back(normal.cast<float>());
    }
  }
  const auto index = [](int i, int j) { return static_cast<std::uint32_t>(j * kAround + i % kAround); };
  for (int j = 0; j < kAlong; ++j)
    for (int i = 0; i < kAround; ++i)
      for (const std::uint32_t k :
           {index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j), index(i + 1, j + 1), index(i, j + 1)})
        ball.indices.push_back(k);
  scene.surfaces.push_back(ball);
  scene.probe.pose.position = {0, 0, -5};  // out of sight
  scene.camera = {.eye = {0.1, -0.2, 0.4}, .look_at = {0.05, 0.1, 0.1}};
  // Supine, as scenarios are.
  scene.room_from_patient.linear() << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return scene;
}

/// Centre of what is magenta in the picture of an eye, pixels.
std::optional<Eigen::Vector2d> magenta(const mock::Submitted& frame, std::size_t eye) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int count = 0;
  for (std::uint32_t y = 0; y < frame.height; ++y) {
    for (std::uint32_t x = 0; x < frame.width; ++x) {
      const std::uint8_t* pixel = &frame.rgba[eye][4UL * (y * frame.width + x)];
      if (pixel[0] < 30 || pixel[2] < 30 || 2 * pixel[1] > std::min(pixel[0], pixel[2])) continue;
      sum += Eigen::Vector2d(x + 0.5, y + 0.5);
      ++count;
    }
  }
  if (count < 10) return {};
  return sum / count;
}

/// Where an eye of this pose and field of view sees a point, pixels: the tangents of its angles, linearly.
Eigen::Vector2d expected(const Eigen::Isometry3d& room_from_eye, const XrFovf& fov, const Vector3d& point,
                         const mock::Submitted& frame) {
  const Vector3d p = room_from_eye.inverse() * point;
  const double right = p.x() / -p.z(), up = p.y() / -p.z();
  return {(right - std::tan(fov.angleLeft)) / (std::tan(fov.angleRight) - std::tan(fov.angleLeft)) * frame.width,
          (std::tan(fov.angleUp) - up) / (std::tan(fov.angleUp) - std::tan(fov.angleDown)) * frame.height};
}

TEST(ImmersiveView, BothEyesSeeANearPointWithTheRightDisparity) {
  const Vector3d point(0.02, 0.05, 0.11);  // patient frame
  const content::Scene scene = ball_scene(point, 0.006);
  const XrPosef head = mock::looking(0.10F, -0.55F, {0.02F, -0.03F, -0.01F});
  Rig rig({.head = [&](XrTime) { return head; }}, {.room_from_standing = immersive::standing_place(scene)});
  {
    immersive::ImmersiveView view(rig.device(), scene);
    rig.turn_until_focused();
    rig.headset().poll();
    const auto frame = rig.headset().begin_frame();
    ASSERT_TRUE(frame.has_value());
    rig.headset().end_frame(&view.draw(*frame, {}, {}));
  }
  // Straight from the script: what the eyes are in the room is not asked of the code under test.
  const Vector3d eye_in_room = scene.room_from_patient * scene.camera.eye;
  const Vector3d ahead = scene.room_from_patient * scene.camera.look_at - eye_in_room;
  Eigen::Isometry3d standing = Eigen::Isometry3d::Identity();
  standing.translate(eye_in_room);
  standing.rotate(physics::rotation_between(-Vector3d::UnitZ(), Vector3d(ahead.x(), 0, ahead.z())));
  const mock::Submitted& last = mock::report().last;
  std::array<Eigen::Vector2d, 2> seen, wanted;
  for (std::size_t eye = 0; eye < 2; ++eye) {
    const Eigen::Translation3d aside((eye == 0 ? -0.5 : 0.5) * mock::script().eye_separation, 0, 0);
    const auto centre = magenta(last, eye);
    ASSERT_TRUE(centre.has_value()) << "eye " << eye << " does not see it";
    seen[eye] = *centre;
    wanted[eye] = expected(standing * isometry(head) * aside, last.fovs[eye], scene.room_from_patient * point, last);
    EXPECT_NEAR(seen[eye].x(), wanted[eye].x(), 1) << eye;
    EXPECT_NEAR(seen[eye].y(), wanted[eye].y(), 1) << eye;
  }
  const double disparity = wanted[0].x() - wanted[1].x();
  EXPECT_GT(std::abs(disparity), 20) << "or the test says nothing";
  EXPECT_NEAR(seen[0].x() - seen[1].x(), disparity, 1);
  rig.expect_clean();
}

TEST(ImmersiveView, BothEyesSeeThePanelAtItsPlace) {
  content::Scene scene = ball_scene({0.02, 0.05, 0.11}, 0.006);
  scene.tissues[1].colour = {0.5F, 0.5F, 0.5F, 1};
  const render::RoomLayout layout = render::room_layout(scene);
  const Eigen::Isometry3d standing = immersive::standing_place(scene);
  const std::array<Vector3d, 4> corners = layout.panel_corners();
  const Vector3d middle = scene.room_from_patient * ((corners[0] + corners[2]) / 2);
  const Vector3d towards = standing.inverse() * middle;
  const auto yaw = static_cast<float>(std::atan2(-towards.x(), -towards.z()));
  const XrPosef head = mock::looking(yaw - 0.2F, 0.1F, {0.02F, -0.03F, -0.01F});
  Rig rig({.head = [&](XrTime) { return head; }}, {.room_from_standing = standing});
  {
    // A magenta spot in the middle of the picture.
    std::vector<std::uint8_t> pixels;
    for (int v = 0; v < 20; ++v)
      for (int u = 0; u < 40; ++u) {
        const bool spot = 18 <= u && u < 22 && 8 <= v && v < 12;
        pixels.insert(pixels.end(),
                      {static_cast<std::uint8_t>(spot ? 255 : 0), 0, static_cast<std::uint8_t>(spot ? 255 : 0), 255});
      }
    const gpu::Image picture(rig.device(), {.width = 40, .height = 20, .format = VK_FORMAT_R8G8B8A8_SRGB});
    gpu::run_now(rig.device(),
                 [&](gpu::Commands& commands) { commands.upload(picture, std::as_bytes(std::span(pixels))); });
    immersive::ImmersiveView view(rig.device(), scene);
    rig.turn_until_focused();
    for (const bool shown : {true, false}) {
      rig.headset().poll();
      const auto frame = rig.headset().begin_frame();
      ASSERT_TRUE(frame.has_value());
      rig.headset().end_frame(&view.draw(*frame, {}, {.panel = shown ? &picture : nullptr}));
      std::array<Eigen::Vector2d, 2> seen, wanted;
      const mock::Submitted& last = mock::report().last;
      for (std::size_t eye = 0; eye < 2; ++eye) {
        const auto spot = magenta(last, eye);
        EXPECT_EQ(spot.has_value(), shown) << eye;
        if (!spot) continue;
        seen[eye] = *spot;
        const Eigen::Translation3d aside((eye == 0 ? -0.5 : 0.5) * mock::script().eye_separation, 0, 0);
        wanted[eye] = expected(standing * isometry(head) * aside, last.fovs[eye], middle, last);
        EXPECT_LT((seen[eye] - wanted[eye]).norm(), 1) << eye;
      }
      if (!shown) continue;
      const double disparity = wanted[0].x() - wanted[1].x();
      EXPECT_GT(std::abs(disparity), 20);
      EXPECT_NEAR(seen[0].x() - seen[1].x(), disparity, 1);
    }
  }
  rig.expect_clean();
}

/// How much of the picture of an eye is pink as the controller of the needle, and where.
int pink_pixels(const mock::Submitted& frame, std::size_t eye, Eigen::Vector2d* centre) {
  int count = 0;
  *centre = Eigen::Vector2d::Zero();
  for (std::uint32_t y = 0; y < frame.height; ++y) {
    for (std::uint32_t x = 0; x < frame.width; ++x) {
      const std::uint8_t* pixel = &frame.rgba[eye][4UL * (y * frame.width + x)];
      if (pixel[0] < 40 || 10 * pixel[1] > 7 * pixel[0] || 10 * pixel[2] > 9 * pixel[0]) continue;
      *centre += Eigen::Vector2d(x + 0.5, y + 0.5);
      ++count;
    }
  }
  if (count > 0) *centre /= count;
  return count;
}

TEST(ImmersiveView, BothEyesSeeTheControllersWhereTheHandsAre) {
  content::Scene scene = ball_scene({0.02, 0.05, 0.11}, 0.006);
  scene.tissues[1].colour = {0.5F, 0.5F, 0.5F, 1};
  for (const bool left_handed : {false, true}) {
    mock::HandScript needle, probe;
    needle.grip = mock::looking(0.3F, 0.5F, {0.05F, -0.04F, -0.4F});
    probe.tracked = false;
    Rig rig({.left = [&](XrTime) { return left_handed ? needle : probe; },
             .right = [&](XrTime) { return left_handed ? probe : needle; }},
            {.room_from_standing = immersive::standing_place(scene), .left_handed = left_handed});
    {
      immersive::ImmersiveView view(rig.device(), scene);
      rig.turn_until_focused();
      for (const bool tracked : {true, false}) {
        needle.tracked = tracked;
        rig.headset().poll();
        const auto frame = rig.headset().begin_frame();
        ASSERT_TRUE(frame.has_value());
        rig.headset().end_frame(&view.draw(*frame, {}, {}));
        const mock::Submitted& last = mock::report().last;
        for (std::size_t eye = 0; eye < 2; ++eye) {
          Eigen::Vector2d centre;
          const int pink = pink_pixels(last, eye, &centre);
          if (!tracked) {
            EXPECT_EQ(pink, 0) << "a hand that nobody sees";
            continue;
          }
          ASSERT_GT(pink, 100);
          const Eigen::Translation3d aside((eye == 0 ? -0.5 : 0.5) * mock::script().eye_separation, 0, 0);
          const Vector3d palm = isometry(needle.grip).translation();
          EXPECT_LT((centre - expected(Eigen::Isometry3d(aside), last.fovs[eye], palm, last)).norm(), 20)
              << "the palm lies in the middle of a controller, 40 cm away and 12 cm long";
        }
      }
    }
    rig.expect_clean();
  }
}

TEST(ImmersiveView, DrawsInTheSizeThatTheRuntimeWants) {
  const content::Scene scene = ball_scene({0.02, 0.05, 0.11}, 0.006);
  Rig rig({.width = 96, .height = 80}, {.room_from_standing = immersive::standing_place(scene)});
  {
    immersive::ImmersiveView view(rig.device(), scene);
    rig.turn_until_focused();
    for (const std::uint32_t width : {96U, 64U}) {
      mock::resize(width, 80, true);
      rig.headset().poll();
      const auto frame = rig.headset().begin_frame();
      ASSERT_TRUE(frame.has_value());
      const gpu::Image& eyes = view.draw(*frame, {}, {});
      EXPECT_EQ(eyes.extent().width, width);
      EXPECT_EQ(eyes.settings().layers, 2U);
      rig.headset().end_frame(&eyes);
      EXPECT_EQ(mock::report().last.width, width);
    }
  }
  rig.expect_clean();
}

// --- panel ---

/// Pixels that differ in the left and in the right half.
std::array<int, 2> changed(const picture::Picture& a, const picture::Picture& b) {
  std::array<int, 2> count{};
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x)
      if (!std::equal(a.at(x, y), a.at(x, y) + 3, b.at(x, y))) ++count[x < a.width / 2 ? 0 : 1];
  return count;
}

struct PanelRig : Rig {
  picture::Picture draw(immersive::PanelLevel level, double now_s) {
    panel->draw(facts, level, now_s);
    return view::read_picture(device(), *panel->picture());
  }
  ~PanelRig() { panel.reset(); }
  panels::SessionFacts facts{.title = "Liver biopsy", .stage = "procedure", .prompt = "Advance the needle."};
  std::optional<immersive::SessionPanel> panel{device()};
};

TEST(SessionPanel, UpdatesItsValuesTenTimesASecond) {
  using immersive::PanelLevel;
  PanelRig rig;
  const std::vector<figures::ForceSample> curve{{}, {.time_s = 1, .depth = 0.03, .axial = 2.4, .lateral = 0.4}};
  const picture::Picture before = rig.draw(PanelLevel::panel, 1);
  EXPECT_EQ(changed(rig.draw(PanelLevel::panel, 1.2), before), (std::array{0, 0})) << "nothing new";
  rig.facts.hint = "The probe has lost the skin: press it on gently.";
  EXPECT_EQ(changed(rig.draw(PanelLevel::panel, 1.25), before), (std::array{0, 0})) << "not yet";
  const picture::Picture hint = rig.draw(PanelLevel::panel, 1.31);
  EXPECT_GT(changed(hint, before)[0], 500);
  EXPECT_EQ(changed(hint, before)[1], 0);
  rig.facts.force_curve = curve;
  const picture::Picture force = rig.draw(PanelLevel::panel, 1.5);
  EXPECT_EQ(changed(force, hint)[0], 0);
  EXPECT_GT(changed(force, hint)[1], 500);
  rig.facts.target_distance = 0.012;
  rig.facts.tissue = "liver";
  rig.facts.warnings = {{panels::Concern::danger, "tip is beyond the target"}};
  EXPECT_EQ(changed(rig.draw(PanelLevel::panel, 1.7), force), (std::array{0, 0})) << "for instructors";
  const picture::Picture instructor = rig.draw(PanelLevel::instructor, 1.71);
  EXPECT_GT(changed(instructor, force)[0], 500) << "at once";
  EXPECT_GT(changed(instructor, force)[1], 500);
  rig.panel->draw(rig.facts, PanelLevel::hidden, 1.72);
  EXPECT_EQ(rig.panel->picture(), nullptr);
  rig.panel.reset();
  rig.expect_clean();
}

TEST(SessionPanel, NamesTheButtonsOfTheHandThatHasThem) {
  PanelRig rig;
  const picture::Picture right = rig.draw(immersive::PanelLevel::panel, 1);
  rig.panel.reset();
  rig.panel.emplace(rig.device(), true);
  EXPECT_GT(changed(rig.draw(immersive::PanelLevel::panel, 1), right)[1], 50);
  rig.panel.reset();
  rig.expect_clean();
}

TEST(SessionPanel, ButtonGoesRound) {
  using immersive::PanelLevel;
  EXPECT_EQ(next(PanelLevel::panel), PanelLevel::instructor);
  EXPECT_EQ(next(PanelLevel::instructor), PanelLevel::hidden);
  EXPECT_EQ(next(PanelLevel::hidden), PanelLevel::panel);
  EXPECT_EQ(see_through(PanelLevel::panel), render::SeeThrough::window);
  EXPECT_EQ(see_through(PanelLevel::instructor), render::SeeThrough::glass);
}

// --- who trains ---

TEST(HandsOnChoice, ButtonsOfEitherHandAreKeys) {
  using view::Key;
  for (const bool left_handed : {false, true}) {
    immersive::HandsOnChoice choice;
    headset::Hands hands{.left_handed = left_handed};
    headset::Hand& needle = left_handed ? hands.left : hands.right;
    double time_s = 0;
    /// The keys of the next half a second of frames, in which what is pressed since the last frame is so once.
    const auto keys = [&] {
      std::vector<Key> all;
      for (int frame = 0; frame < 40; ++frame) {
        for (const view::Stroke& stroke : choice.keys(hands, time_s += 0.01).strokes) all.push_back(stroke.key);
        hands.menu_pressed = hands.panel_pressed = false;
      }
      return all;
    };
    using Keys = std::vector<Key>;
    needle.trigger = true;
    EXPECT_EQ(keys(), Keys{}) << "pulled before it was asked";
    needle.trigger = false;
    EXPECT_EQ(keys(), Keys{});
    needle.trigger = true;
    EXPECT_EQ(keys(), Keys{Key::space});
    hands.panel_pressed = true;
    EXPECT_EQ(keys(), Keys{Key::tab});
    hands.menu_pressed = true;
    EXPECT_EQ(keys(), Keys{Key::backspace});
    for (headset::Hand* hand : {&hands.left, &hands.right}) {
      hand->stick = {0, 1};
      EXPECT_EQ(keys(), Keys{Key::up});
      hand->stick = {0, 0};
      keys();
      hand->stick = {-1, 0.1F};
      EXPECT_EQ(keys(), Keys{Key::left});
      hand->stick = {0, 0};
      keys();
    }
  }
}

TEST(TraineePanel, ShowsNamesAndAPadThatFit) {
  Rig rig;
  {
    immersive::TraineePanel panel(rig.device());
    panels::TraineeChoice choice(
        {{.pseudonym = "P-ADA", .name = "Ada"}, {.pseudonym = "P-BOB", .name = "Bob", .has_pin = true}}, 12,
        [](const std::string&, const std::string&) { return panels::PinAnswer{.wait_s = 300}; });
    const auto drawn = [&] {
      for (int i = 0; i < 3; ++i) panel.draw(choice, {}, 0.01);
      return view::read_picture(rig.device(), panel.picture());
    };
    const auto press = [&](std::vector<view::Key> keys) {
      for (const view::Key key : keys) {
        view::Input input;
        input.strokes = {{.key = key}};
        choice.handle(input);
      }
    };
    const picture::Picture nobody = drawn();
    press({view::Key::tab});
    const picture::Picture ada = drawn();
    EXPECT_GT(changed(ada, nobody)[0], 500) << "who is chosen is seen";
    press({view::Key::tab, view::Key::space});
    ASSERT_TRUE(choice.asks_for_pin());
    const picture::Picture pad = drawn();
    press({view::Key::right});
    EXPECT_GT(changed(drawn(), pad)[0], 500) << "where one is on the pad is seen";
    press({view::Key::space, view::Key::enter});
    EXPECT_GT(changed(drawn(), pad)[1], 500) << "that the PIN was wrong";
  }
  rig.expect_clean();
}

// --- hands ---

/// Skin at z = 0, level, the patient below; the probe looks down on it from the middle.
content::Scene flat_patient() {
  content::Scene scene;
  scene.room_from_patient.linear() << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  constexpr int kVoxels = 60;
  scene.labels.spacing = 0.004F;
  scene.labels.origin = Vector3f::Constant(-0.118F);
  scene.labels.size = {kVoxels, kVoxels, kVoxels};
  for (int k = 0; k < kVoxels; ++k)
    scene.labels.labels.insert(scene.labels.labels.end(), std::size_t(kVoxels) * kVoxels, k < kVoxels / 2 ? 1 : 0);
  scene.labels.bodies.assign(scene.labels.labels.size(), -1);
  scene.probe.pose.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Vector3d::UnitX()));
  return scene;
}

TEST(ThumbOnScanner, TurnsAKnobOnceThenAgainWhileItIsHeld) {
  immersive::ThumbOnScanner thumb;
  headset::Hands hands;
  std::vector<std::string> seen;
  double time_s = 0;
  const auto name = [](const scanner::Command& command) -> std::string {
    if (const auto* gain = std::get_if<scanner::SetGain>(&command); gain != nullptr && gain->relative) {
      return gain->db == 2 ? "gain up" : gain->db == -2 ? "gain down" : "gain?";
    }
    if (const auto* depth = std::get_if<scanner::SetDepth>(&command); depth != nullptr && depth->relative) {
      return depth->m == 0.01 ? "deeper" : depth->m == -0.01 ? "less deep" : "depth?";
    }
    const auto* freeze = std::get_if<scanner::Freeze>(&command);
    return freeze != nullptr && !freeze->on ? "freeze" : "?";
  };
  /// @return what was asked for meanwhile
  const auto hold = [&](float x, float y, double for_s) {
    seen.clear();
    hands.left.stick = {x, y};
    for (int frame = 0; frame < static_cast<int>(std::lround(for_s * 100)); ++frame) {
      for (const scanner::Command& command : thumb.commands(hands, time_s)) seen.push_back(name(command));
      time_s += 0.01;
    }
    hands.freeze_pressed = false;
    return seen;
  };
  using Seen = std::vector<std::string>;
  EXPECT_EQ(hold(0, 0.6F, 1), Seen{}) << "a thumb at rest";
  EXPECT_EQ(hold(0, 0.9F, 0.4), Seen{"gain up"});
  EXPECT_EQ(hold(0.3F, 0.5F, 0.2), Seen{"gain up"}) << "still held, half a second later";
  EXPECT_EQ(hold(0, 0.3F, 0.1), Seen{});
  EXPECT_EQ(hold(0.1F, -1, 0.1), Seen{"gain down"});
  EXPECT_EQ(hold(-0.8F, 0.1F, 0.8), (Seen{"less deep", "less deep", "less deep"})) << "at once, after 0.5 s, 0.65 s";
  hands.freeze_pressed = true;
  EXPECT_EQ(hold(0, 0, 0.01), Seen{"freeze"});
}

TEST(HandsOnPatient, InLeftHandsTheNeedleIsInTheLeft) {
  const content::Scene scene = flat_patient();
  haptic::HandDevice needle({.start = {0.01, 0.02, 0.2}});
  session::HeldProbe probe(scene);
  mock::HandScript left, right;
  Rig rig({.left = [&](XrTime) { return left; }, .right = [&](XrTime) { return right; }}, {.left_handed = true});
  immersive::HandsOnPatient hands(scene, &needle, &probe);
  double now_s = 0;
  const auto turn = [&] {
    hands.move(rig.turn()->hands, 0);
    haptic::StylusSample sample;
    for (int i = 0; i < 300; ++i) sample = needle.read(now_s += 0.001);
    return sample;
  };
  rig.turn_until_focused();
  turn();
  left.grip.position = {0.01F, 0, 0};
  left.trigger = true;
  right.grip.position = {-0.02F, 0, 0};
  const haptic::StylusSample moved = turn();
  EXPECT_TRUE(moved.position.isApprox(Vector3d(0.02, 0.02, 0.2), 1e-6)) << moved.position.transpose();
  EXPECT_EQ(moved.buttons, 1U);
  physics::RigidPose pose;
  for (int i = 0; i < 200; ++i) pose = probe.pose(0.02 * i);
  EXPECT_NEAR(pose.position.x(), -0.02, 1e-4);
  rig.expect_clean();
}

TEST(HandsOnPatient, FeelAPunctureMoreTheHarderTheTipWasPushed) {
  session::PunctureWatch watch;
  physics::NeedleState state;
  EXPECT_FALSE(watch.take().has_value());
  watch.haptic_stepped({}, state);
  EXPECT_FALSE(watch.take().has_value());
  state.puncture_count = 1;
  state.last_puncture.force = 1.5;
  watch.haptic_stepped({}, state);
  watch.haptic_stepped({}, state);
  const auto puncture = watch.take();
  ASSERT_TRUE(puncture.has_value());
  EXPECT_FALSE(watch.take().has_value()) << "once";
  const double felt = immersive::vibration_of(*puncture).amplitude;
  EXPECT_NEAR(felt, 0.5, 1e-12);
  EXPECT_GT(immersive::vibration_of({.force = 2.5}).amplitude, felt);
  EXPECT_EQ(immersive::vibration_of({.force = 9}).amplitude, 1);
  EXPECT_GT(immersive::vibration_of({.force = 0.01}).amplitude, 0.1) << "or nobody feels it";
}

/// Middle of both eyes.
Vector3d head_place(const headset::HeadsetFrame& frame) {
  return (frame.eyes[0].room_from_eye.translation() + frame.eyes[1].room_from_eye.translation()) / 2;
}

TEST(Floor, IsThatOfTheTraineesRoomWhereTheRuntimeKnowsIt) {
  const content::Scene scene = ball_scene({0.02, 0.05, 0.11}, 0.006);
  const headset::HeadsetSettings settings{.room_from_standing = immersive::standing_place(scene),
                                          .room_from_floor = immersive::floor_place(scene)};
  // The stage lies aside of the head and is turned; the head is 1.7 m over it, then 1.2 m: who sits down.
  XrPosef head = mock::looking(0.8F, -0.3F, {0.4F, 0.1F, -0.7F});
  mock::Script script{.head = [&](XrTime) { return head; },
                      .left = [&](XrTime) { return mock::HandScript{.grip = head}; },
                      .stage = true,
                      .local_from_stage = mock::looking(-0.5F, 0, {1, -1.6F, 2})};
  Rig rig(script, settings);
  const headset::HeadsetFrame first = rig.turn_until_focused();
  EXPECT_TRUE(rig.headset().on_floor());
  const render::RoomLayout layout = render::room_layout(scene);
  const double floor = (scene.room_from_patient * layout.patient_from_table * Vector3d(0, 0, layout.floor_z)).y();
  const Vector3d eye = scene.room_from_patient * layout.standing_camera().eye;
  EXPECT_NEAR(head_place(first).y() - floor, 1.7, 1e-5) << "as tall as the trainee is";
  EXPECT_NEAR(head_place(first).x(), eye.x(), 1e-5) << "beside the table";
  EXPECT_NEAR(head_place(first).z(), eye.z(), 1e-5);
  const Vector3d ahead = -first.eyes[0].room_from_eye.linear().col(2);
  const Vector3d field = scene.room_from_patient * layout.standing_camera().look_at - eye;
  EXPECT_LT(std::abs(std::remainder(std::atan2(ahead.x(), ahead.z()) - std::atan2(field.x(), field.z()), 2 * M_PI)),
            1e-4)
      << "turned to the field";
  const double mattress = (scene.room_from_patient * layout.patient_from_table * Vector3d(0, 0, 0)).y() - floor;
  EXPECT_TRUE(mattress > 0.75 && mattress < 1.05) << "a table is as high as a table: " << mattress;
  head.position.y -= 0.5F;
  const headset::HeadsetFrame sitting = *rig.turn();
  EXPECT_NEAR(head_place(sitting).y() - floor, 1.2, 1e-5);
  EXPECT_TRUE(sitting.hands.left.room_from_grip.translation().isApprox(head_place(sitting), 1e-5)) << "hands too";
  rig.headset().recentre();
  EXPECT_NEAR(head_place(*rig.turn()).y() - floor, 1.2, 1e-5) << "who is recentred does not grow";
  rig.expect_clean();
}

TEST(Floor, IsMissedWhereTheRuntimeKnowsNone) {
  const content::Scene scene = ball_scene({0.02, 0.05, 0.11}, 0.006);
  Rig rig({},
          {.room_from_standing = immersive::standing_place(scene), .room_from_floor = immersive::floor_place(scene)});
  const headset::HeadsetFrame frame = rig.turn_until_focused();
  EXPECT_FALSE(rig.headset().on_floor());
  EXPECT_TRUE(head_place(frame).isApprox(scene.room_from_patient * scene.camera.eye, 1e-5))
      << "at the scene's camera";
  rig.expect_clean();
}

TEST(HandsOnPatient, ControllersMoveNeedleAndProbe) {
  const content::Scene scene = flat_patient();
  haptic::HandDevice needle({.start = {0.01, 0.02, 0.2}});
  session::HeldProbe probe(scene);
  mock::HandScript left, right;
  right.grip = mock::looking(0.5F, 0.2F, {0.3F, -0.2F, -0.4F});
  left.grip = mock::looking(-0.2F, 0, {-0.3F, -0.2F, -0.4F});
  Rig rig({.left = [&](XrTime) { return left; }, .right = [&](XrTime) { return right; }});
  immersive::HandsOnPatient hands(scene, &needle, &probe);
  double now_s = 0;
  const auto turn = [&] {
    hands.move(rig.turn()->hands, 0);
    haptic::StylusSample sample;
    for (int i = 0; i < 300; ++i) sample = needle.read(now_s += 0.001);
    return sample;
  };
  rig.turn_until_focused();
  const haptic::StylusSample taken = turn();
  EXPECT_TRUE(taken.position.isApprox(Vector3d(0.01, 0.02, 0.2), 1e-9));

  // Room +X is the patient's +X, up the patient's +Z, towards the trainee (+Z) the patient's -Y.
  right.grip.position = {0.31F, -0.22F, -0.43F};
  left.grip.position = {-0.28F, -0.2F, -0.39F};
  right.trigger = true;
  const haptic::StylusSample moved = turn();
  EXPECT_TRUE(moved.position.isApprox(Vector3d(0.02, 0.05, 0.18), 1e-6));
  EXPECT_EQ(moved.buttons, 1U);
  physics::RigidPose pose;
  for (int i = 0; i < 200; ++i) pose = probe.pose(0.02 * i);
  EXPECT_TRUE(pose.position.isApprox(Vector3d(0.02, -0.01, 0), 1e-4)) << pose.position.transpose();

  // Turned about the vertical by the same angle, whatever way the hand holds it.
  right.grip = mock::looking(1.0F, 0.2F, {0.31F, -0.22F, -0.43F});
  const haptic::StylusSample turned = turn();
  const Eigen::Quaterniond vertical(Eigen::AngleAxisd(0.5, Vector3d::UnitZ()));
  EXPECT_LT(turned.orientation.angularDistance(vertical * moved.orientation), 1e-5);
  EXPECT_TRUE(turned.position.isApprox(moved.position, 1e-6));

  // Squeezed, and out of sight, both stay, and go on from there.
  right.squeeze = true;
  left.tracked = false;
  right.grip.position = left.grip.position = {0, 0, 0};
  EXPECT_TRUE(turn().position.isApprox(moved.position, 1e-6));
  right.squeeze = false;
  left.tracked = true;
  EXPECT_TRUE(turn().position.isApprox(moved.position, 1e-6));
  right.grip.position = {0, 0.01F, 0};
  EXPECT_TRUE(turn().position.isApprox(moved.position + Vector3d(0, 0, 0.01), 1e-6));
  for (int i = 200; i < 400; ++i) pose = probe.pose(0.02 * i);
  EXPECT_TRUE(pose.position.isApprox(Vector3d(0.02, -0.01, 0), 1e-4));
  rig.expect_clean();
}

}  // namespace
}  // namespace stylet::tests
