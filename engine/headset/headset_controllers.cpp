#include "engine/headset/headset_controllers.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace stylet::headset {

namespace {

constexpr std::array kHands{"/user/hand/left", "/user/hand/right"};

XrPath path(XrInstance instance, const std::string& text) {
  XrPath out = XR_NULL_PATH;
  xr::check(xrStringToPath(instance, text.c_str(), &out), "xrStringToPath");
  return out;
}

}  // namespace

HeadsetControllers::HeadsetControllers(XrInstance instance, XrSession session, bool left_handed)
    : instance_(instance), session_(session), left_handed_(left_handed) {
  XrActionSetCreateInfo set{XR_TYPE_ACTION_SET_CREATE_INFO};
  xr::put_text(set.actionSetName, "procedure");
  xr::put_text(set.localizedActionSetName, "Procedure");
  for (std::size_t i = 0; i < 2; ++i) paths_[i] = path(instance, kHands[i]);
  xr::check(xrCreateActionSet(instance, &set, &set_), "xrCreateActionSet");
  try {
    grip_ = make(XR_ACTION_TYPE_POSE_INPUT, "hand",
                 left_handed ? "Hand: the right holds the probe, the left the needle"
                             : "Hand: the left holds the probe, the right the needle");
    trigger_ = make(XR_ACTION_TYPE_BOOLEAN_INPUT, "trigger", "Fire");
    squeeze_ = make(XR_ACTION_TYPE_BOOLEAN_INPUT, "let_go", "Let go, to take hold elsewhere");
    menu_ = make(XR_ACTION_TYPE_BOOLEAN_INPUT, "pause", "Pause");
    recentre_ = make(XR_ACTION_TYPE_BOOLEAN_INPUT, "recentre", "Stand at the table again");
    panel_ = make(XR_ACTION_TYPE_BOOLEAN_INPUT, "panel", "Panel, instructor's panel, none");
    freeze_ = make(XR_ACTION_TYPE_BOOLEAN_INPUT, "freeze", "Freeze the ultrasound image");
    breath_ = make(XR_ACTION_TYPE_BOOLEAN_INPUT, "breath", "The patient holds the breath, breathes on");
    stick_ = make(XR_ACTION_TYPE_VECTOR2F_INPUT, "knobs", "Ultrasound: gain up and down, depth right and left");
    touch_ = make(XR_ACTION_TYPE_VIBRATION_OUTPUT, "touch", "The needle goes through something");
    suggest("khr/simple_controller", {.trigger = "select/click", .menu = "menu/click", .panel = "select/click"},
            {.trigger = "select/click", .breath = "menu/click"});
    suggest(
        "oculus/touch_controller",  // whose one menu button is on the left
        {"trigger/value", "squeeze/value", "menu/click", "thumbstick/click", "x/click", "trigger/value", "thumbstick",
         left_handed ? "y/click" : ""},
        {"trigger/value", "squeeze/value", "", "thumbstick/click", "a/click", "", "", left_handed ? "" : "b/click"});
    suggest(
        "valve/index_controller",
        {"trigger/click", "squeeze/value", "b/click", "thumbstick/click", "a/click", "trigger/click", "thumbstick"},
        {"trigger/click", "squeeze/value", "", "thumbstick/click", "a/click", "", "", "b/click"});
    suggest("htc/vive_controller",
            {"trigger/click", "squeeze/click", "menu/click", "", "trackpad/click", "trigger/click"},
            {"trigger/click", "squeeze/click", "", "trackpad/click", "", "", "", "menu/click"});
    suggest("microsoft/motion_controller",
            {"trigger/value", "squeeze/click", "menu/click", "thumbstick/click", "trackpad/click", "trigger/value",
             "thumbstick"},
            {"trigger/value", "squeeze/click", "", "thumbstick/click", "trackpad/click", "", "", "menu/click"});
    XrSessionActionSetsAttachInfo attach{XR_TYPE_SESSION_ACTION_SETS_ATTACH_INFO};
    attach.countActionSets = 1;
    attach.actionSets = &set_;
    xr::check(xrAttachSessionActionSets(session, &attach), "xrAttachSessionActionSets");
    for (std::size_t i = 0; i < 2; ++i) {
      XrActionSpaceCreateInfo create{XR_TYPE_ACTION_SPACE_CREATE_INFO};
      create.action = grip_;
      create.subactionPath = paths_[i];
      create.poseInActionSpace = xr::kIdentityPose;
      xr::check(xrCreateActionSpace(session, &create, &grips_[i]), "xrCreateActionSpace");
    }
  } catch (...) {
    xrDestroyActionSet(set_);  // and with it its actions; the spaces go with the session
    throw;
  }
}

HeadsetControllers::~HeadsetControllers() {
  for (XrSpace space : grips_) xrDestroySpace(space);
  xrDestroyActionSet(set_);
}

XrAction HeadsetControllers::make(XrActionType type, const char* name, const char* title) {
  XrActionCreateInfo create{XR_TYPE_ACTION_CREATE_INFO};
  xr::put_text(create.actionName, name);
  xr::put_text(create.localizedActionName, title);
  create.actionType = type;
  create.countSubactionPaths = 2;
  create.subactionPaths = paths_.data();
  XrAction action = XR_NULL_HANDLE;
  xr::check(xrCreateAction(set_, &create, &action), "xrCreateAction");
  return action;
}

void HeadsetControllers::suggest(const char* profile, Inputs left, Inputs right) {
  if (left_handed_) {
    const auto swap_if_one = [](const char*& a, const char*& b) {
      if ((*a == '\0') != (*b == '\0')) std::swap(a, b);
    };
    swap_if_one(left.freeze, right.freeze);
    swap_if_one(left.stick, right.stick);
    swap_if_one(left.panel, right.panel);
    swap_if_one(left.recentre, right.recentre);
    if (std::string_view(left.menu) == right.breath) {
      std::swap(left.menu, right.menu);
      std::swap(left.breath, right.breath);
    }
  }
  std::vector<XrActionSuggestedBinding> bindings;
  for (const char* hand : kHands) {
    const Inputs& inputs = hand == kHands[0] ? left : right;
    const auto bind = [&](XrAction action, const char* input) {
      if (*input != '\0') bindings.push_back({action, path(instance_, std::string(hand) + "/input/" + input)});
    };
    bind(grip_, "grip/pose");
    bindings.push_back({touch_, path(instance_, std::string(hand) + "/output/haptic")});
    bind(trigger_, inputs.trigger);
    bind(squeeze_, inputs.squeeze);
    bind(menu_, inputs.menu);
    bind(recentre_, inputs.recentre);
    bind(panel_, inputs.panel);
    bind(freeze_, inputs.freeze);
    bind(stick_, inputs.stick);
    bind(breath_, inputs.breath);
  }
  XrInteractionProfileSuggestedBinding suggested{XR_TYPE_INTERACTION_PROFILE_SUGGESTED_BINDING};
  suggested.interactionProfile = path(instance_, std::string("/interaction_profiles/") + profile);
  suggested.countSuggestedBindings = static_cast<std::uint32_t>(bindings.size());
  suggested.suggestedBindings = bindings.data();
  xr::check(xrSuggestInteractionProfileBindings(instance_, &suggested), "xrSuggestInteractionProfileBindings");
}

bool HeadsetControllers::pressed(XrAction action, XrPath hand, bool only_new) const {
  XrActionStateGetInfo get{XR_TYPE_ACTION_STATE_GET_INFO};
  get.action = action;
  get.subactionPath = hand;
  XrActionStateBoolean state{XR_TYPE_ACTION_STATE_BOOLEAN};
  xr::check(xrGetActionStateBoolean(session_, &get, &state), "xrGetActionStateBoolean");
  return state.isActive == XR_TRUE && state.currentState == XR_TRUE &&
         (!only_new || state.changedSinceLastSync == XR_TRUE);
}

Eigen::Vector2f HeadsetControllers::stick(XrPath hand) const {
  XrActionStateGetInfo get{XR_TYPE_ACTION_STATE_GET_INFO};
  get.action = stick_;
  get.subactionPath = hand;
  XrActionStateVector2f state{XR_TYPE_ACTION_STATE_VECTOR2F};
  xr::check(xrGetActionStateVector2f(session_, &get, &state), "xrGetActionStateVector2f");
  if (state.isActive != XR_TRUE) return Eigen::Vector2f::Zero();
  return {state.currentState.x, state.currentState.y};
}

void HeadsetControllers::vibrate(const Vibration& vibration) const {
  XrHapticVibration wanted{XR_TYPE_HAPTIC_VIBRATION};
  wanted.amplitude = static_cast<float>(std::clamp(vibration.amplitude, 0.0, 1.0));
  wanted.duration = static_cast<XrDuration>(vibration.duration_s * 1e9);
  wanted.frequency = XR_FREQUENCY_UNSPECIFIED;
  XrHapticActionInfo info{XR_TYPE_HAPTIC_ACTION_INFO};
  info.action = touch_;
  info.subactionPath = paths_[left_handed_ ? 0 : 1];
  xr::check(xrApplyHapticFeedback(session_, &info, reinterpret_cast<const XrHapticBaseHeader*>(&wanted)),
            "xrApplyHapticFeedback");
}

Hands HeadsetControllers::read(XrTime time, XrSpace base, const Eigen::Isometry3d& room_from_base) {
  const XrActiveActionSet active{set_, XR_NULL_PATH};
  XrActionsSyncInfo sync{XR_TYPE_ACTIONS_SYNC_INFO};
  sync.countActiveActionSets = 1;
  sync.activeActionSets = &active;
  const XrResult synced = xrSyncActions(session_, &sync);
  xr::check(synced, "xrSyncActions");
  Hands hands{.left_handed = left_handed_};
  if (synced == XR_SESSION_NOT_FOCUSED) return hands;
  for (std::size_t i = 0; i < 2; ++i) {
    Hand& hand = i == 0 ? hands.left : hands.right;
    XrSpaceLocation location{XR_TYPE_SPACE_LOCATION};
    xr::check(xrLocateSpace(grips_[i], base, time, &location), "xrLocateSpace");
    constexpr XrSpaceLocationFlags kValid =
        XR_SPACE_LOCATION_POSITION_VALID_BIT | XR_SPACE_LOCATION_ORIENTATION_VALID_BIT;
    hand.tracked = (location.locationFlags & kValid) == kValid && xr::is_pose(location.pose);
    if (hand.tracked) hand.room_from_grip = room_from_base * xr::pose(location.pose);
    hand.trigger = pressed(trigger_, paths_[i], false);
    hand.squeeze = pressed(squeeze_, paths_[i], false);
    hand.stick = stick(paths_[i]);
    hands.menu_pressed = pressed(menu_, paths_[i], true) || hands.menu_pressed;
    hands.recentre_pressed = pressed(recentre_, paths_[i], true) || hands.recentre_pressed;
    hands.panel_pressed = pressed(panel_, paths_[i], true) || hands.panel_pressed;
    hands.freeze_pressed = pressed(freeze_, paths_[i], true) || hands.freeze_pressed;
    hands.breath_pressed = pressed(breath_, paths_[i], true) || hands.breath_pressed;
  }
  return hands;
}

}  // namespace stylet::headset
