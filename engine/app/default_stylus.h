// The stylus of a session whose user did not say which.
#pragma once

#include "engine/app/observer.h"
#include "engine/app/stylus.h"
#include "engine/content/scene.h"
#include "haptic/hid/device_profile.h"

#include <cstdint>
#include <string>

namespace stylet::app {

/// Where a session is shown.
enum class ShownIn : std::uint8_t { nothing, window, headset };

/// By name, as stylus_kinds() has them: a person where there is a picture, else the scenario's motion. Pens and
/// joysticks lie on many desks for something else and must be asked for.
/// @param connected  kind of the best HID device that is plugged in
constexpr const char* default_stylus(ShownIn shown, haptic::hid::DeviceKind connected) {
  using haptic::hid::DeviceKind;
  if (shown == ShownIn::nothing) return "recorded";
  if (shown == ShownIn::headset) return "hand";
  return connected == DeviceKind::kStylus || connected == DeviceKind::kSpaceMouse ? "hid" : "mouse";
}

/// The stylus asked for, or the default, which is noted where a person holds it: where a HID device cannot be opened
/// that is noted and the mouse leads.
/// @param device  as of open_stylus(); empty: the user did not say. @param log, start  as of open_stylus()
/// @throws files::ContentError, haptic::hid::HidError
Stylus open_stylus_or_default(const std::string& device, ShownIn shown, const content::Scene& scene,
                              haptic::hid::ReportLog* log, const session::StartPose* start, Observer& observer);

inline constexpr const char* kDefaultStylusHelp =
    "in a window a HID stylus or space mouse that is plugged in, else mouse; in a headset hand; headless recorded";

}  // namespace stylet::app
