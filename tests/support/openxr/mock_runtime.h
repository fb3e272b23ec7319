// An OpenXR runtime without a headset: head and hands move as a script says, and what an application submits is kept
// for the test. Debian's own loader loads it (XR_RUNTIME_JSON), so everything above it is the real thing.
//
// As strict as a conformant runtime may be: wrong order, wrong structs, dead handles, foreign poses and unknown paths
// are errors, and each is listed in Report::errors.
//
// A test links the library and calls what is below; in a program that knows nothing of it, STYLET_MOCK_OPENXR says
// what it does (environment.cpp). One application at a time. Thread: one.
#pragma once

#include <openxr/openxr.h>

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#define MOCK_XR_API __attribute__((visibility("default")))

namespace stylet::mock_xr {

struct HandScript {
  bool tracked = true;
  XrPosef grip{{0, 0, 0, 1}, {0, 0, 0}};  ///< in the local space
  bool trigger = false;
  bool squeeze = false;
  bool menu = false;
  bool thumbstick = false;  ///< or its only pad
  bool lower = false;       ///< X or A, or the pad beside a thumb stick
  bool upper = false;       ///< Y or B, where that is not its menu button
  XrVector2f stick{0, 0};   ///< where the thumb stick is
};

struct Script {
  std::uint32_t width = 320;  ///< recommended for each eye
  std::uint32_t height = 288;
  XrDuration period = 11'111'111;  ///< ns
  bool in_real_time = false;       ///< xrWaitFrame sleeps; else it returns at once and only the clock goes on
  bool connected = true;           ///< false: no headset on the runtime
  bool bgra_only = false;          ///< offers no R8G8B8A8
  std::string controller = "oculus/touch_controller";
  float eye_separation = 0.064F;
  /// Of the left eye; the right one's is its mirror image.
  XrFovf fov{-0.85F, 0.65F, 0.75F, -0.80F};
  /// Head and hands at a time, in the local space. Functions of time alone.
  std::function<XrPosef(XrTime)> head = [](XrTime) { return XrPosef{{0, 0, 0, 1}, {0, 0, 0}}; };
  std::function<HandScript(XrTime)> left = [](XrTime) { return HandScript{}; };
  std::function<HandScript(XrTime)> right = [](XrTime) { return HandScript{}; };
  bool head_tracked = true;
  bool stage = false;                                     ///< the runtime knows the floor
  XrPosef local_from_stage{{0, 0, 0, 1}, {0, -1.5F, 0}};  ///< the stage's origin, on the floor
};

/// What a hand was made to feel.
struct Felt {
  int hand = 0;  ///< 0: left
  float amplitude = 0;
  XrDuration duration = 0;  ///< ns
};

/// A frame as xrEndFrame got it.
struct Submitted {
  XrTime display_time = 0;    ///< as the application says
  XrTime predicted_time = 0;  ///< as xrWaitFrame said
  bool layer = false;         ///< with a projection layer; else nothing of the rest
  std::array<XrPosef, 2> poses{};
  std::array<XrFovf, 2> fovs{};
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::array<std::vector<std::uint8_t>, 2> rgba{};  ///< sRGB bytes of each eye, rows from the top
};

struct Report {
  std::vector<std::string> errors;  ///< every call that failed: "xrBeginFrame: ... (XR_ERROR_CALL_ORDER_INVALID)"
  std::vector<std::string> leaks;   ///< handles alive when their instance was destroyed
  std::vector<XrSessionState> states;
  std::uint64_t frames = 0;  ///< ended
  std::uint64_t swapchains = 0;
  XrTime views_at = 0;  ///< time of the last xrLocateViews
  XrTime hands_at = 0;  ///< of the last xrLocateSpace of a hand
  std::vector<Felt> felt;
  Submitted last;  ///< the last frame with a layer
};

/// Starts anew with this script, before the application makes its instance.
MOCK_XR_API void play(const Script& script);
/// Changes the script meanwhile.
MOCK_XR_API Script& script();
MOCK_XR_API const Report& report();

/// The trainee takes the headset off and on: frames are not shown meanwhile.
MOCK_XR_API void take_off();
MOCK_XR_API void put_on();
/// Ends the session as the runtime's menu does, to come back or for good.
MOCK_XR_API void stop(bool for_good);
/// The headset goes, with the event that says so or without a word.
MOCK_XR_API void lose_session(bool announced);
/// The runtime goes.
MOCK_XR_API void lose_instance(bool announced);
/// The user chose another resolution, or was recentred by the runtime: the application is told of a change of the
/// space, or of nothing.
MOCK_XR_API void resize(std::uint32_t width, std::uint32_t height, bool announced);
/// Position and rotation of `pose` as a point turned and moved: for oracles.
MOCK_XR_API XrPosef looking(float yaw, float pitch, XrVector3f from);

}  // namespace stylet::mock_xr
