// A drag moves the needle on the screen as it goes itself, wherever the camera is.
#include "engine/desktop/screen_move.h"
#include "engine/desktop/framing.h"
#include "engine/desktop/input_commands.h"
#include "engine/readers/scenario.h"
#include "engine/session/start_pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <variant>
#include <vector>

namespace stylet::desktop {
namespace {

constexpr double kOneDegree = std::numbers::pi / 180;

/// Where the mouse holds the needle when it has come to rest.
class Hand {
public:
  explicit Hand(const haptic::MouseWorkspace& workspace) : length_(workspace.needle_length), mouse_(workspace) {}

  struct Needle {
    Eigen::Vector3d hub, tip;
  };
  Needle at_rest() {
    mouse_.read(now_s_ += 10);
    mouse_.read(now_s_ += 10);  // through one low-pass, then the other
    const haptic::StylusSample sample = mouse_.read(now_s_ += 10);
    return {sample.position, sample.position + length_ * (sample.orientation * Eigen::Vector3d::UnitZ())};
  }
  void drag(const view::Input& input, const content::Camera& camera) {
    for (const Command& command : commands_of(input)) {
      mouse_.lead(as_on_screen(std::get<haptic::NeedleMove>(command), mouse_.motion(), camera));
    }
  }
  haptic::MouseDevice& mouse() { return mouse_; }

private:
  double length_;
  haptic::MouseDevice mouse_;
  double now_s_ = 0;
};

/// Rad, between where `drag` goes and where a point does that is projected from `before` and `after`.
double off(const content::Camera& camera, const Eigen::Vector3d& before, const Eigen::Vector3d& after,
           const Eigen::Vector2d& drag) {
  const Eigen::Vector2d went = projected(camera, after, 1600, 900) - projected(camera, before, 1600, 900);
  return std::abs(std::atan2(went.x() * drag.y() - went.y() * drag.x(), went.dot(drag)));
}

/// From all sides, heights and two distances; none looks along its own upward direction.
std::vector<content::Camera> cameras(const content::Camera& like) {
  std::vector<content::Camera> all{like};
  for (const double distance : {0.35, 0.8}) {
    for (int height = -80; height <= 80; height += 20) {
      for (int side = 0; side < 360; side += 20) {
        content::Camera camera = like;
        const Eigen::Vector3d from(std::cos(height * kOneDegree) * std::cos(side * kOneDegree),
                                   std::cos(height * kOneDegree) * std::sin(side * kOneDegree),
                                   std::sin(height * kOneDegree));
        camera.up = Eigen::Vector3d::UnitZ();
        camera.eye = camera.look_at + distance * from;
        all.push_back(camera);
      }
    }
  }
  return all;
}

/// Drags a millimetre in eight directions before each camera; the needle stays where it was.
void expect_on_screen(const haptic::MouseWorkspace& workspace, const content::Camera& like,
                      const std::string& where) {
  double worst = 0;
  int compared = 0;
  for (const content::Camera& camera : cameras(like)) {
    for (int direction = 0; direction < 8; ++direction) {
      const Eigen::Vector2d drag(std::cos(direction * 45 * kOneDegree), std::sin(direction * 45 * kOneDegree));
      Hand hand(workspace);
      const Hand::Needle before = hand.at_rest();
      hand.drag({.drag_x = 0.002 * drag.x(), .drag_y = 0.002 * drag.y()}, camera);
      const Hand::Needle after = hand.at_rest();
      EXPECT_GT((after.hub - before.hub).norm(), 0.5 * 0.0002) << where;
      EXPECT_LT((after.hub - before.hub).norm(), 2 * 1.5 * 0.0002) << where << ": not faster than a hand expects";
      for (const auto& [from, to] : {std::pair{before.hub, after.hub}, std::pair{before.tip, after.tip}}) {
        const Eigen::Vector2d at = projected(camera, from, 1600, 900);
        if (at.x() < 0 || at.x() > 1600 || at.y() < 0 || at.y() > 900) continue;
        worst = std::max(worst, off(camera, from, to, drag));
        ++compared;
      }
    }
  }
  EXPECT_LT(worst, 20 * kOneDegree) << where << ": " << worst / kOneDegree << " degrees";
  EXPECT_GT(compared, 1000) << where;
}

TEST(ScreenMove, ADragMovesHubAndTipThatWayInEveryScenarioFromAnyCamera) {
  for (const std::string name : {"tutorial", "liver_biopsy", "rfa", "cyst_aspiration"}) {
    const content::Scene scene = readers::load_scene(readers::find_scenario(name));
    const session::StartPose start = session::start_of(scene);
    expect_on_screen({.entry = start.tip,
                      .axis = start.aim - start.tip,
                      .right = start.hub.orientation * Eigen::Vector3d::UnitX(),
                      .needle_length = scene.needle.length},
                     scene.camera, name);
  }
}

TEST(ScreenMove, ATiltedNeedleGoesThatWayToo) {
  const content::Camera like{.eye = {-0.3, -0.3, 0.3}, .up = {0, 0, 1}, .vertical_fov = 0.5};
  for (const content::Camera& camera : cameras(like)) {
    Hand hand({.entry = {0, 0, 0}, .axis = {0.3, -0.2, -1}, .right = {1, 0, 0}});
    hand.mouse().tilt(0.4, -0.3);
    const Hand::Needle before = hand.at_rest();
    hand.drag({.drag_x = 0.002, .drag_y = 0.001}, camera);
    EXPECT_LT(off(camera, before.hub, hand.at_rest().hub, {2, 1}), 20 * kOneDegree);
  }
}

TEST(ScreenMove, WithShiftTheHubIsTiltedThatWay) {
  const content::Camera like{.eye = {-0.3, -0.3, 0.3}, .up = {0, 0, 1}, .vertical_fov = 0.5};
  double worst = 0;
  int tilted = 0, all = 0;
  for (const content::Camera& camera : cameras(like)) {
    for (int direction = 0; direction < 8; ++direction) {
      const Eigen::Vector2d drag(std::cos(direction * 45 * kOneDegree), std::sin(direction * 45 * kOneDegree));
      Hand hand({.entry = {0, 0, 0}, .axis = {0.3, -0.2, -1}, .right = {1, 0, 0}});
      hand.mouse().tilt(0.3, 0.2);
      const Hand::Needle before = hand.at_rest();
      hand.drag({.drag_x = 0.001 * drag.x(), .drag_y = 0.001 * drag.y(), .shift = true}, camera);
      const Hand::Needle after = hand.at_rest();
      ++all;
      // A hub that would have to go along the shaft stays where it is.
      if ((after.hub - before.hub).norm() < 0.1 * 0.0015 * 0.2) continue;
      ++tilted;
      worst = std::max(worst, off(camera, before.hub, after.hub, drag));
      EXPECT_LT((after.hub - before.hub).norm(), 1.6 * 0.0015 * 0.22) << "by no more than it should";
    }
  }
  EXPECT_LT(worst, 20 * kOneDegree) << worst / kOneDegree << " degrees";
  EXPECT_GT(tilted, 0.8 * all);
}

TEST(ScreenMove, LeavesDepthAndBevelAlone) {
  const content::Camera camera{.eye = {-0.3, -0.3, 0.3}, .up = {0, 0, 1}, .vertical_fov = 0.5};
  haptic::MouseDevice mouse{haptic::MouseWorkspace{}};
  const haptic::NeedleMove move = as_on_screen({.twist_rad = 0.1, .advance_m = 0.002}, mouse.motion(), camera);
  EXPECT_EQ(move.twist_rad, 0.1);
  EXPECT_EQ(move.advance_m, 0.002);
  EXPECT_EQ(move.right_m, 0);
  EXPECT_EQ(move.up_m, 0);
}

TEST(ScreenMove, IsFiniteWhereTheCameraIsInTheNeedle) {
  haptic::MouseDevice mouse{haptic::MouseWorkspace{}};
  const haptic::NeedleMotion motion = mouse.motion();
  content::Camera camera{.eye = motion.middle, .look_at = motion.middle + 0.1 * motion.advance, .up = {0, 1, 0}};
  const haptic::NeedleMove move = as_on_screen({.right_m = 0.001, .tilt_up_rad = 0.01}, motion, camera);
  for (const double part : {move.right_m, move.up_m, move.advance_m, move.tilt_right_rad, move.tilt_up_rad}) {
    EXPECT_TRUE(std::isfinite(part));
    EXPECT_LT(std::abs(part), 0.1);
  }
}

}  // namespace
}  // namespace stylet::desktop
