// The controllers: poses in the room, buttons of each kind of controller, and when there are none.
#include "tests/headset/rig.h"

#include <limits>

namespace stylet::tests {
namespace {

using mock::HandScript;

TEST(HeadsetControllers, HandsAreInTheRoom) {
  Eigen::Isometry3d standing = Eigen::Isometry3d::Identity();
  standing.translate(Eigen::Vector3d(-0.4, 0.5, 0.3));
  standing.rotate(Eigen::AngleAxisd(-1.1, Eigen::Vector3d::UnitY()));
  const XrPosef left = mock::looking(0.4F, -0.2F, {-0.2F, -0.3F, -0.4F});
  Rig rig({.left = [&](XrTime) { return HandScript{.grip = left}; },
           .right = [](XrTime) { return HandScript{.tracked = false}; }},
          {.room_from_standing = standing});
  rig.turn_until_focused();
  const auto frame = rig.turn();
  EXPECT_TRUE(frame->hands.left.tracked);
  EXPECT_TRUE(frame->hands.left.room_from_grip.isApprox(standing * isometry(left), 1e-6));
  EXPECT_FALSE(frame->hands.right.tracked);
  rig.expect_clean();
}

// A runtime may call valid what is no number: a hand that follows it would be nowhere.
TEST(HeadsetControllers, WhatIsNoPoseIsNotTracked) {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  XrPosef grip{{0, 0, 0, 1}, {0.2F, 0.1F, -0.4F}};
  const auto both = [&](XrTime) { return HandScript{.grip = grip}; };
  Rig rig({.left = both, .right = both});
  rig.turn_until_focused();
  const auto tracked = [&] {
    const headset::Hands hands = rig.turn()->hands;
    EXPECT_EQ(hands.left.tracked, hands.right.tracked);
    return hands.left.tracked;
  };
  EXPECT_TRUE(tracked());
  for (const XrPosef& bad :
       {XrPosef{{0, 0, 0, 1}, {kNone, 0, 0}}, XrPosef{{0, 0, 0, 1}, {0, 0, std::numeric_limits<float>::infinity()}},
        XrPosef{{0, kNone, 0, 1}, {0, 0, 0}}, XrPosef{{0, 0, 0, 0}, {0, 0, 0}}}) {
    grip = bad;
    EXPECT_FALSE(tracked());
    grip = {{0, 0, 0, 1}, {0.2F, 0.1F, -0.4F}};
    EXPECT_TRUE(tracked());
  }
  rig.expect_clean();
}

class EveryController : public testing::TestWithParam<const char*> {};

TEST_P(EveryController, ReportsItsPressedButtons) {
  HandScript left, right;
  Rig rig({.controller = GetParam(), .left = [&](XrTime) { return left; }, .right = [&](XrTime) { return right; }});
  rig.turn_until_focused();
  const auto hands = [&] { return rig.turn()->hands; };
  const bool simple = std::string(GetParam()) == "khr/simple_controller";
  headset::Hands now = hands();
  EXPECT_FALSE(now.left.trigger || now.right.trigger || now.left.squeeze || now.right.squeeze || now.menu_pressed);

  right.trigger = true;
  left.squeeze = true;
  now = hands();
  EXPECT_TRUE(now.right.trigger);
  EXPECT_FALSE(now.left.trigger);
  EXPECT_EQ(now.left.squeeze, !simple);
  EXPECT_FALSE(now.right.squeeze);
  EXPECT_TRUE(hands().right.trigger) << "as long as it is held";

  left.menu = true;
  EXPECT_TRUE(hands().menu_pressed);
  EXPECT_FALSE(hands().menu_pressed) << "once, however long it is held";
  left.menu = false;
  hands();
  left.menu = true;
  EXPECT_TRUE(hands().menu_pressed);

  right.thumbstick = true;
  now = hands();
  EXPECT_EQ(now.recentre_pressed, !simple);
  EXPECT_FALSE(now.panel_pressed);

  // The lower button; of the controllers without one the left pad, or the left trigger.
  left.lower = left.thumbstick = left.trigger = true;
  EXPECT_TRUE(hands().panel_pressed);
  EXPECT_FALSE(hands().panel_pressed) << "once";
  left.lower = left.thumbstick = left.trigger = false;
  hands();
  right.lower = true;
  const bool one_hand = simple || std::string(GetParam()) == "htc/vive_controller";
  EXPECT_EQ(hands().panel_pressed, !one_hand);

  // The upper button, or the menu button of the hand with the needle, whose twin is no menu button then.
  right.lower = false;
  right.upper = right.menu = true;
  now = hands();
  EXPECT_TRUE(now.breath_pressed);
  EXPECT_FALSE(now.menu_pressed);
  EXPECT_FALSE(hands().breath_pressed) << "once";
  right.upper = right.menu = left.menu = false;
  hands();
  left.upper = left.menu = true;
  now = hands();
  EXPECT_FALSE(now.breath_pressed);
  EXPECT_TRUE(now.menu_pressed);

  // The scanner is in the left hand; HTC's has no stick, the simple one's trigger is the panel's.
  right.lower = false;
  hands();
  left.trigger = right.trigger = true;
  now = hands();
  EXPECT_EQ(now.freeze_pressed, !simple);
  EXPECT_FALSE(hands().freeze_pressed) << "once";
  left.stick = right.stick = {0.25F, -1};
  now = hands();
  EXPECT_EQ(now.left.stick, one_hand ? Eigen::Vector2f::Zero() : Eigen::Vector2f(0.25F, -1));
  EXPECT_TRUE(now.right.stick.isZero());
  rig.expect_clean();
}

TEST_P(EveryController, InLeftHandsIsTheOtherWayRound) {
  HandScript left, right;
  Rig rig({.controller = GetParam(), .left = [&](XrTime) { return left; }, .right = [&](XrTime) { return right; }},
          {.left_handed = true});
  rig.turn_until_focused();
  const auto hands = [&] { return rig.turn()->hands; };
  const bool simple = std::string(GetParam()) == "khr/simple_controller";
  const bool vive = std::string(GetParam()) == "htc/vive_controller";
  left.trigger = true;
  headset::Hands now = hands();
  EXPECT_TRUE(now.needle().trigger);
  EXPECT_FALSE(now.probe().trigger);
  EXPECT_FALSE(now.freeze_pressed || now.panel_pressed);
  right.trigger = true;
  now = hands();
  EXPECT_TRUE(now.probe().trigger);
  EXPECT_EQ(now.freeze_pressed, !simple);
  EXPECT_EQ(now.panel_pressed, simple);
  left.stick = {1, 0};
  right.stick = {0.25F, -1};
  EXPECT_EQ(hands().probe().stick, simple || vive ? Eigen::Vector2f::Zero() : Eigen::Vector2f(0.25F, -1));
  EXPECT_TRUE(hands().needle().stick.isZero());
  left.thumbstick = true;
  EXPECT_EQ(hands().recentre_pressed, !simple);
  left.upper = left.menu = true;
  now = hands();
  EXPECT_TRUE(now.breath_pressed);
  const bool touch = std::string(GetParam()) == "oculus/touch_controller";
  EXPECT_EQ(now.menu_pressed, touch) << "its only one is there";
  left.upper = left.menu = false;
  hands();
  right.upper = right.menu = true;
  now = hands();
  EXPECT_FALSE(now.breath_pressed);
  EXPECT_EQ(now.menu_pressed, !touch);
  rig.expect_clean();
}

TEST_P(EveryController, LetsTheHandWithTheNeedleFeel) {
  for (const bool left_handed : {false, true}) {
    Rig rig({.controller = GetParam()}, {.left_handed = left_handed});
    rig.headset().vibrate({0.5, 0.04});
    rig.turn_until_focused();
    EXPECT_TRUE(mock::report().felt.empty()) << "nobody holds it yet";
    rig.headset().vibrate({0.5, 0.04});
    ASSERT_EQ(mock::report().felt.size(), 1U);
    EXPECT_EQ(mock::report().felt[0].hand, left_handed ? 0 : 1);
    EXPECT_EQ(mock::report().felt[0].amplitude, 0.5F);
    EXPECT_EQ(mock::report().felt[0].duration, 40'000'000);
    rig.headset().vibrate({7, 0.04});
    EXPECT_EQ(mock::report().felt[1].amplitude, 1) << "all that it can";
    rig.expect_clean();
  }
}

INSTANTIATE_TEST_SUITE_P(All, EveryController,
                         testing::Values("khr/simple_controller", "oculus/touch_controller", "valve/index_controller",
                                         "htc/vive_controller", "microsoft/motion_controller"),
                         [](const auto& one) {
                           const std::string name = one.param;
                           return name.substr(0, name.find('/'));
                         });

TEST(HeadsetControllers, RestWhileTheRuntimesMenuIsOpen) {
  Rig rig({.right = [](XrTime) { return HandScript{.trigger = true}; }});
  rig.turn_until_focused();
  EXPECT_TRUE(rig.turn()->hands.right.trigger);
  mock::take_off();
  for (int i = 0; i < 3; ++i) rig.turn();
  const auto frame = rig.turn();
  EXPECT_FALSE(frame->hands.right.trigger);
  EXPECT_FALSE(frame->hands.right.tracked);
  rig.expect_clean();
}

TEST(HeadsetControllers, ThumbStickRecentresFromTheNextFrameOn) {
  const XrPosef head = mock::looking(1.0F, 0, {0.5F, 0, 0});
  HandScript left;
  Rig rig({.head = [&](XrTime) { return head; }, .left = [&](XrTime) { return left; }});
  rig.turn_until_focused();
  left.thumbstick = true;
  rig.turn();
  const auto frame = rig.turn();
  const Eigen::Vector3d between =
      (frame->eyes[0].room_from_eye.translation() + frame->eyes[1].room_from_eye.translation()) / 2;
  EXPECT_LT(between.norm(), 1e-6);
  rig.expect_clean();
}

}  // namespace
}  // namespace stylet::tests
