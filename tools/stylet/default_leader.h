// Who leads the needle where the user did not say.
#pragma once

#include "haptic/hid/device_profile.h"

#include <cstdint>

namespace stylet::tools {

/// Where a session is seen.
enum class Seen : std::uint8_t { headless, in_window, in_headset };

/// As --device names it: a person where one looks on, else the scenario's motion. Pens and joysticks lie on many
/// desks for something else and must be asked for.
/// @param connected  kind of the best HID device that is plugged in
constexpr const char* default_leader(Seen seen, haptic::hid::DeviceKind connected) {
  using haptic::hid::DeviceKind;
  if (seen == Seen::headless) return "recorded";
  if (seen == Seen::in_headset) return "hand";
  return connected == DeviceKind::kStylus || connected == DeviceKind::kSpaceMouse ? "hid" : "mouse";
}

}  // namespace stylet::tools
