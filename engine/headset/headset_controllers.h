// The controllers in both hands: where they are and what is pressed on them.
#pragma once

#include "engine/headset/xr.h"

#include <Eigen/Geometry>

#include <array>

namespace stylet::headset {

/// A controller, in the room. Grip: origin in the palm, -Z from the little finger to the thumb (along a rod that is
/// held), +X across the palm to the right.
struct Hand {
  bool tracked = false;  ///< false: the pose means nothing
  Eigen::Isometry3d room_from_grip = Eigen::Isometry3d::Identity();
  bool trigger = false;
  bool squeeze = false;
  Eigen::Vector2f stick = Eigen::Vector2f::Zero();  ///< thumb stick: right and up, to 1
};

/// The button of the panel, in words for whoever holds any of the controllers: of Touch and Index the lower one, of
/// Windows Mixed Reality the pad, of Vive the left pad, of the simple one the left trigger.
inline constexpr const char* kPanelButton = "A, X or pad";

/// That of the breath, of the hand with the needle: of Touch and Index the upper one, of the others the menu button,
/// whose twin in the hand with the probe begins and pauses.
inline constexpr const char* kBreathButton = "B, Y or menu";

struct Hands {
  Hand left;
  Hand right;
  bool left_handed = false;       ///< the left hand holds the needle, the right the probe
  bool menu_pressed = false;      ///< since the last frame; where both have one, of the hand with the probe
  bool recentre_pressed = false;  ///< the same: thumb stick or pad, pushed
  bool panel_pressed = false;     ///< the same: kPanelButton
  bool freeze_pressed = false;    ///< the same: trigger of the hand with the probe
  bool breath_pressed = false;    ///< the same: kBreathButton

  const Hand& needle() const { return left_handed ? left : right; }
  const Hand& probe() const { return left_handed ? right : left; }
};

/// Of a controller, by the frequency that it does best.
struct Vibration {
  double amplitude = 0;   ///< [0, 1]
  double duration_s = 0;  ///< > 0
};

/// Actions of a session, bound to the controllers that runtimes know: Oculus Touch, Valve Index, HTC Vive, Windows
/// Mixed Reality, and Khronos' simple one (no squeeze, recentring or freezing).
/// HTC's has one pad a hand and no stick: the right one recentres.
class HeadsetControllers {
public:
  /// @param left_handed  what the right hand does the left one does, and the other way round
  /// @throws HeadsetError
  HeadsetControllers(XrInstance instance, XrSession session, bool left_handed);
  ~HeadsetControllers();
  HeadsetControllers(const HeadsetControllers&) = delete;
  HeadsetControllers& operator=(const HeadsetControllers&) = delete;

  /// State at `time`, poses in `base`, which stands in the room as `room_from_base` says. Hands are untracked while
  /// the session is not focused. @throws HeadsetError
  Hands read(XrTime time, XrSpace base, const Eigen::Isometry3d& room_from_base);
  /// Lets the hand with the needle feel something. @throws HeadsetError
  void vibrate(const Vibration& vibration) const;

private:
  XrAction make(XrActionType type, const char* name, const char* title);
  /// Inputs of a controller in one hand, as the profile calls them; empty: it has none.
  struct Inputs {
    const char* trigger = "";
    const char* squeeze = "";
    const char* menu = "";
    const char* recentre = "";
    const char* panel = "";
    const char* freeze = "";
    const char* stick = "";
    const char* breath = "";
  };
  void suggest(const char* profile, Inputs left, Inputs right);
  bool pressed(XrAction action, XrPath hand, bool only_new) const;
  Eigen::Vector2f stick(XrPath hand) const;

  XrInstance instance_;
  XrSession session_;
  bool left_handed_;
  XrActionSet set_ = XR_NULL_HANDLE;
  std::array<XrPath, 2> paths_{};  // left, right
  XrAction grip_ = XR_NULL_HANDLE;
  XrAction trigger_ = XR_NULL_HANDLE;
  XrAction squeeze_ = XR_NULL_HANDLE;
  XrAction menu_ = XR_NULL_HANDLE;
  XrAction recentre_ = XR_NULL_HANDLE;
  XrAction panel_ = XR_NULL_HANDLE;
  XrAction freeze_ = XR_NULL_HANDLE;
  XrAction breath_ = XR_NULL_HANDLE;
  XrAction stick_ = XR_NULL_HANDLE;
  XrAction touch_ = XR_NULL_HANDLE;
  std::array<XrSpace, 2> grips_{};
};

}  // namespace stylet::headset
