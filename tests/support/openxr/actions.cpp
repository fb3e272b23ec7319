// Actions, bound to the inputs that the controllers of the specification have.
#include "tests/support/openxr/state.h"

#include <algorithm>
#include <cstring>

namespace stylet::mock_xr {

namespace {

/// What an input of a scripted hand is, whatever the controller calls it.
enum class Input : std::uint8_t { none, grip, trigger, squeeze, menu, thumbstick, lower, upper, stick, haptic };

struct Known {
  const char* input;
  Input means;
  int only = -1;  ///< hand that has it; -1: both
};
struct Profile {
  const char* name;
  std::vector<Known> inputs;
};

/// Semantic paths from the specification, "Interaction Profile Paths"; of each as many as a test needs.
const std::vector<Profile>& profiles() {
  static const std::vector<Profile> all{
      {"khr/simple_controller",
       {{"select/click", Input::trigger}, {"menu/click", Input::menu}, {"grip/pose", Input::grip}}},
      {"oculus/touch_controller",
       {{"trigger/value", Input::trigger},
        {"squeeze/value", Input::squeeze},
        {"menu/click", Input::menu, 0},
        {"x/click", Input::lower, 0},
        {"a/click", Input::lower, 1},
        {"y/click", Input::upper, 0},
        {"b/click", Input::upper, 1},
        {"thumbstick/click", Input::thumbstick},
        {"thumbstick", Input::stick},
        {"grip/pose", Input::grip}}},
      {"valve/index_controller",
       {{"trigger/click", Input::trigger},
        {"trigger/value", Input::trigger},
        {"squeeze/value", Input::squeeze},
        {"squeeze/force", Input::squeeze},
        {"a/click", Input::lower},
        {"b/click", Input::menu},
        {"thumbstick/click", Input::thumbstick},
        {"thumbstick", Input::stick},
        {"grip/pose", Input::grip}}},
      {"htc/vive_controller",
       {{"trigger/click", Input::trigger},
        {"squeeze/click", Input::squeeze},
        {"menu/click", Input::menu},
        {"trackpad/click", Input::thumbstick},
        {"grip/pose", Input::grip}}},
      {"microsoft/motion_controller",
       {{"trigger/value", Input::trigger},
        {"squeeze/click", Input::squeeze},
        {"menu/click", Input::menu},
        {"thumbstick/click", Input::thumbstick},
        {"thumbstick", Input::stick},
        {"trackpad/click", Input::lower},
        {"grip/pose", Input::grip}}},
  };
  return all;
}

constexpr std::array kHands{"/user/hand/left", "/user/hand/right"};

/// What the input at a path is on a controller; none: it has no such input.
Input meaning(const std::string& profile, const std::string& path, int* hand) {
  for (int side = 0; side < 2; ++side) {
    if (path == std::string(kHands[side]) + "/output/haptic") {  // every one of these profiles has it
      *hand = side;
      return Input::haptic;
    }
    const std::string prefix = std::string(kHands[side]) + "/input/";
    if (path.rfind(prefix, 0) != 0) continue;
    *hand = side;
    for (const Profile& known : profiles())
      if (profile == std::string("/interaction_profiles/") + known.name)
        for (const Known& input : known.inputs)
          if (path == prefix + input.input && (input.only < 0 || input.only == side)) return input.means;
  }
  return Input::none;
}

bool value(const HandScript& hand, Input input) {
  switch (input) {
    case Input::trigger:
      return hand.trigger;
    case Input::squeeze:
      return hand.squeeze;
    case Input::menu:
      return hand.menu;
    case Input::thumbstick:
      return hand.thumbstick;
    case Input::lower:
      return hand.lower;
    case Input::upper:
      return hand.upper;
    default:
      return false;
  }
}

bool good_name(const char* name) {
  return *name != '\0' &&
         std::string(name).find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-_.") == std::string::npos;
}

XrResult xrCreateActionSet(XrInstance instance, const XrActionSetCreateInfo* create, XrActionSet* set) {
  MOCK_OBJECT(Instance, found, instance);
  MOCK_STRUCT(create, XR_TYPE_ACTION_SET_CREATE_INFO);
  MOCK_REQUIRE(good_name(create->actionSetName), XR_ERROR_PATH_FORMAT_INVALID, create->actionSetName);
  MOCK_REQUIRE(create->localizedActionSetName[0] != '\0', XR_ERROR_LOCALIZED_NAME_INVALID, "empty");
  for (const auto& [id, object] : runtime().objects) {
    const auto* const other = dynamic_cast<const ActionSet*>(object.get());
    MOCK_REQUIRE(other == nullptr || other->name != create->actionSetName, XR_ERROR_NAME_DUPLICATED,
                 create->actionSetName);
  }
  auto made = std::make_unique<ActionSet>();
  made->name = create->actionSetName;
  made->title = create->localizedActionSetName;
  *set = handle_of<XrActionSet>(runtime().add(std::move(made), found));
  return XR_SUCCESS;
}

XrResult xrDestroyActionSet(XrActionSet set) {
  ActionSet* const found = runtime().find<ActionSet>(set);
  MOCK_REQUIRE(found != nullptr, XR_ERROR_HANDLE_INVALID, "no such action set");
  runtime().destroy(found);
  return XR_SUCCESS;
}

XrResult xrCreateAction(XrActionSet set, const XrActionCreateInfo* create, XrAction* action) {
  MOCK_OBJECT(ActionSet, found, set);
  MOCK_STRUCT(create, XR_TYPE_ACTION_CREATE_INFO);
  MOCK_REQUIRE(!found->attached, XR_ERROR_ACTIONSETS_ALREADY_ATTACHED, "too late");
  MOCK_REQUIRE(good_name(create->actionName), XR_ERROR_PATH_FORMAT_INVALID, create->actionName);
  MOCK_REQUIRE(create->localizedActionName[0] != '\0', XR_ERROR_LOCALIZED_NAME_INVALID, "empty");
  for (const auto& [id, object] : runtime().objects) {
    const auto* const other = dynamic_cast<const Action*>(object.get());
    if (other == nullptr || other->parent != found) continue;
    MOCK_REQUIRE(other->name != create->actionName, XR_ERROR_NAME_DUPLICATED, create->actionName);
    MOCK_REQUIRE(other->title != create->localizedActionName, XR_ERROR_LOCALIZED_NAME_DUPLICATED,
                 create->localizedActionName);
  }
  auto made = std::make_unique<Action>();
  made->name = create->actionName;
  made->title = create->localizedActionName;
  made->type = create->actionType;
  for (std::uint32_t i = 0; i < create->countSubactionPaths; ++i) {
    const std::string* hand = path_text(instance_of(found), create->subactionPaths[i]);
    MOCK_REQUIRE(hand != nullptr && (*hand == kHands[0] || *hand == kHands[1]), XR_ERROR_PATH_UNSUPPORTED,
                 "subaction path");
    made->subactions.push_back(create->subactionPaths[i]);
  }
  *action = handle_of<XrAction>(runtime().add(std::move(made), found));
  return XR_SUCCESS;
}

XrResult xrSuggestInteractionProfileBindings(XrInstance instance,
                                             const XrInteractionProfileSuggestedBinding* suggested) {
  MOCK_OBJECT(Instance, found, instance);
  MOCK_STRUCT(suggested, XR_TYPE_INTERACTION_PROFILE_SUGGESTED_BINDING);
  const std::string* profile = path_text(*found, suggested->interactionProfile);
  MOCK_REQUIRE(profile != nullptr, XR_ERROR_PATH_INVALID, "profile");
  MOCK_REQUIRE(std::any_of(profiles().begin(), profiles().end(),
                           [&](const Profile& known) {
                             return *profile == std::string("/interaction_profiles/") + known.name;
                           }),
               XR_ERROR_PATH_UNSUPPORTED, *profile);
  MOCK_REQUIRE(suggested->countSuggestedBindings > 0, XR_ERROR_VALIDATION_FAILURE, "no bindings");
  std::map<std::uint64_t, std::set<XrPath>> bindings;
  for (std::uint32_t i = 0; i < suggested->countSuggestedBindings; ++i) {
    const XrActionSuggestedBinding& binding = suggested->suggestedBindings[i];
    MOCK_OBJECT(Action, action, binding.action);
    MOCK_REQUIRE(!dynamic_cast<ActionSet&>(*action->parent).attached, XR_ERROR_ACTIONSETS_ALREADY_ATTACHED,
                 "too late");
    const std::string* path = path_text(*found, binding.binding);
    MOCK_REQUIRE(path != nullptr, XR_ERROR_PATH_INVALID, "binding");
    int hand = 0;
    const Input input = meaning(*profile, *path, &hand);
    MOCK_REQUIRE(input != Input::none, XR_ERROR_PATH_UNSUPPORTED, *profile + " has no " + *path);
    MOCK_REQUIRE(action->type == (input == Input::grip     ? XR_ACTION_TYPE_POSE_INPUT
                                  : input == Input::stick  ? XR_ACTION_TYPE_VECTOR2F_INPUT
                                  : input == Input::haptic ? XR_ACTION_TYPE_VIBRATION_OUTPUT
                                                           : XR_ACTION_TYPE_BOOLEAN_INPUT),
                 XR_ERROR_PATH_UNSUPPORTED, *path + " is of another type");
    bindings[action->id].insert(binding.binding);
  }
  found->suggested[suggested->interactionProfile] = bindings;
  return XR_SUCCESS;
}

XrResult xrAttachSessionActionSets(XrSession session, const XrSessionActionSetsAttachInfo* attach) {
  MOCK_SESSION(found, session);
  MOCK_STRUCT(attach, XR_TYPE_SESSION_ACTION_SETS_ATTACH_INFO);
  MOCK_REQUIRE(!found->attached_once, XR_ERROR_ACTIONSETS_ALREADY_ATTACHED, "once a session");
  for (std::uint32_t i = 0; i < attach->countActionSets; ++i) {
    MOCK_OBJECT(ActionSet, set, attach->actionSets[i]);
    set->attached = true;
    found->attached.insert(set->id);
  }
  found->attached_once = true;
  return XR_SUCCESS;
}

/// What an action is bound to on a hand of the controller that the script holds.
std::vector<Input> bound_to(const Instance& instance, const Action& action, int hand) {
  const std::string wanted = "/interaction_profiles/" + runtime().script.controller;
  std::vector<Input> inputs;
  for (const auto& [profile, actions] : instance.suggested) {
    if (*path_text(instance, profile) != wanted) continue;
    const auto bound = actions.find(action.id);
    if (bound == actions.end()) continue;
    for (XrPath path : bound->second) {
      int side = 0;
      const Input input = meaning(wanted, *path_text(instance, path), &side);
      if (side == hand) inputs.push_back(input);
    }
  }
  return inputs;
}

XrResult xrSyncActions(XrSession session, const XrActionsSyncInfo* sync) {
  MOCK_SESSION(found, session);
  MOCK_STRUCT(sync, XR_TYPE_ACTIONS_SYNC_INFO);
  for (std::uint32_t i = 0; i < sync->countActiveActionSets; ++i) {
    MOCK_OBJECT(ActionSet, set, sync->activeActionSets[i].actionSet);
    MOCK_REQUIRE(found->attached.count(set->id) == 1, XR_ERROR_ACTIONSET_NOT_ATTACHED, set->name);
  }
  found->synced = found->predicted;
  const bool focused = found->state == XR_SESSION_STATE_FOCUSED;
  for (auto& [id, object] : runtime().objects) {
    auto* const action = dynamic_cast<Action*>(object.get());
    if (action == nullptr) continue;
    action->before = action->now;
    for (int hand = 0; hand < 2; ++hand) {
      const HandScript script =
          hand == 0 ? runtime().script.left(found->predicted) : runtime().script.right(found->predicted);
      bool down = false;
      XrVector2f stick{0, 0};
      for (const Input input : bound_to(instance_of(found), *action, hand)) {
        down = down || value(script, input);
        if (input == Input::stick) stick = script.stick;
      }
      action->now[hand] = focused && down;
      action->stick[hand] = focused ? stick : XrVector2f{0, 0};
    }
  }
  return focused ? XR_SUCCESS : XR_SESSION_NOT_FOCUSED;
}

/// An action of a type whose state is asked for, and of which hand.
struct Asked {
  Session* session = nullptr;
  Action* action = nullptr;
  std::size_t hand = 0;
};

XrResult find_asked(XrSession session, const XrActionStateGetInfo* get, XrActionType type, Asked& asked) {
  MOCK_SESSION(found, session);
  MOCK_STRUCT(get, XR_TYPE_ACTION_STATE_GET_INFO);
  MOCK_OBJECT(Action, action, get->action);
  MOCK_REQUIRE(found->attached.count(action->parent->id) == 1, XR_ERROR_ACTIONSET_NOT_ATTACHED, action->name);
  MOCK_REQUIRE(action->type == type, XR_ERROR_ACTION_TYPE_MISMATCH, action->name);
  MOCK_REQUIRE(
      std::find(action->subactions.begin(), action->subactions.end(), get->subactionPath) != action->subactions.end(),
      XR_ERROR_PATH_UNSUPPORTED, "not a subaction path of " + action->name);
  asked = {found, action, *path_text(instance_of(found), get->subactionPath) == kHands[0] ? 0U : 1U};
  return XR_SUCCESS;
}

XrResult xrGetActionStateBoolean(XrSession session, const XrActionStateGetInfo* get, XrActionStateBoolean* state) {
  MOCK_STRUCT(state, XR_TYPE_ACTION_STATE_BOOLEAN);
  Asked asked;
  const XrResult found = find_asked(session, get, XR_ACTION_TYPE_BOOLEAN_INPUT, asked);
  if (found != XR_SUCCESS) return found;
  const bool now = asked.action->now[asked.hand];
  state->isActive = asked.session->state == XR_SESSION_STATE_FOCUSED ? XR_TRUE : XR_FALSE;
  state->currentState = now ? XR_TRUE : XR_FALSE;
  state->changedSinceLastSync = now != asked.action->before[asked.hand] ? XR_TRUE : XR_FALSE;
  state->lastChangeTime = asked.session->predicted;
  return XR_SUCCESS;
}

XrResult xrGetActionStateVector2f(XrSession session, const XrActionStateGetInfo* get, XrActionStateVector2f* state) {
  MOCK_STRUCT(state, XR_TYPE_ACTION_STATE_VECTOR2F);
  Asked asked;
  const XrResult found = find_asked(session, get, XR_ACTION_TYPE_VECTOR2F_INPUT, asked);
  if (found != XR_SUCCESS) return found;
  const bool bound = !bound_to(instance_of(asked.session), *asked.action, static_cast<int>(asked.hand)).empty();
  state->isActive = bound && asked.session->state == XR_SESSION_STATE_FOCUSED ? XR_TRUE : XR_FALSE;
  state->currentState = asked.action->stick[asked.hand];
  state->changedSinceLastSync = XR_FALSE;
  state->lastChangeTime = asked.session->predicted;
  return XR_SUCCESS;
}

XrResult xrApplyHapticFeedback(XrSession session, const XrHapticActionInfo* info, const XrHapticBaseHeader* haptic) {
  MOCK_SESSION(found, session);
  MOCK_STRUCT(info, XR_TYPE_HAPTIC_ACTION_INFO);
  MOCK_OBJECT(Action, action, info->action);
  MOCK_REQUIRE(found->attached.count(action->parent->id) == 1, XR_ERROR_ACTIONSET_NOT_ATTACHED, action->name);
  MOCK_REQUIRE(action->type == XR_ACTION_TYPE_VIBRATION_OUTPUT, XR_ERROR_ACTION_TYPE_MISMATCH, action->name);
  MOCK_STRUCT(haptic, XR_TYPE_HAPTIC_VIBRATION);
  const auto& vibration = *reinterpret_cast<const XrHapticVibration*>(haptic);
  MOCK_REQUIRE(vibration.amplitude >= 0 && vibration.amplitude <= 1, XR_ERROR_VALIDATION_FAILURE, "amplitude");
  MOCK_REQUIRE(vibration.duration > 0 || vibration.duration == XR_MIN_HAPTIC_DURATION, XR_ERROR_VALIDATION_FAILURE,
               "duration");
  const std::string* hand = path_text(instance_of(found), info->subactionPath);
  MOCK_REQUIRE(hand != nullptr, XR_ERROR_PATH_INVALID, "subaction path");
  if (found->state != XR_SESSION_STATE_FOCUSED) return XR_SESSION_NOT_FOCUSED;
  const int side = *hand == kHands[0] ? 0 : 1;
  if (bound_to(instance_of(found), *action, side).empty()) return XR_SUCCESS;
  runtime().report.felt.push_back({side, vibration.amplitude, vibration.duration});
  return XR_SUCCESS;
}

}  // namespace

PFN_xrVoidFunction action_function(const char* name) {
  MOCK_ENTRY(xrCreateActionSet);
  MOCK_ENTRY(xrDestroyActionSet);
  MOCK_ENTRY(xrCreateAction);
  MOCK_ENTRY(xrSuggestInteractionProfileBindings);
  MOCK_ENTRY(xrAttachSessionActionSets);
  MOCK_ENTRY(xrSyncActions);
  MOCK_ENTRY(xrGetActionStateBoolean);
  MOCK_ENTRY(xrGetActionStateVector2f);
  MOCK_ENTRY(xrApplyHapticFeedback);
  return nullptr;
}

}  // namespace stylet::mock_xr
