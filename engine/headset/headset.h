// A session in a headset: where head and hands will be when a frame is shown, and the frame itself.
//
//   while (headset.poll() != HeadsetPhase::ended && ...) {
//     if (const auto frame = headset.begin_frame()) headset.end_frame(frame->draw ? &picture_of(*frame) : nullptr);
//   }
#pragma once

#include "engine/headset/headset_controllers.h"
#include "engine/headset/headset_runtime.h"
#include "engine/headset/headset_swapchain.h"

#include <array>
#include <optional>
#include <string>

namespace stylet::headset {

/// Where the trainee is and looks along -Z when the session starts and after recentring. Only place and turn about
/// +Y count: the horizon is never tilted.
struct HeadsetSettings {
  Eigen::Isometry3d room_from_standing = Eigen::Isometry3d::Identity();  ///< the head's
  /// On the floor, under the head: where the runtime knows the floor of the trainee's own room (OpenXR's stage), that
  /// is the floor here, and the head as high over it as it is. None: the head always begins at room_from_standing.
  std::optional<Eigen::Isometry3d> room_from_floor{};
  bool left_handed = false;  ///< the left hand holds the needle
};

/// An eye at the time its picture is shown. Axes of the eye: +X right, +Y up, -Z forward. The angles of the four
/// sides of its view from -Z: left and down negative.
struct HeadsetEye {
  Eigen::Isometry3d room_from_eye = Eigen::Isometry3d::Identity();
  double left = 0, right = 0, up = 0, down = 0;  ///< rad
};

struct HeadsetFrame {
  std::int64_t display_time_ns = 0;  ///< clock of the runtime
  double period_s = 0;               ///< between frames
  bool draw = false;                 ///< false: nobody looks, or the head is not tracked
  EyeSize size;                      ///< wanted for each eye; the copy scales what has another
  std::array<HeadsetEye, 2> eyes{};  ///< left, right
  Hands hands{};
};

enum class HeadsetPhase : std::uint8_t {
  waiting,  ///< the runtime wants no frames now: poll again in a while
  running,
  ended,  ///< the runtime or the trainee ended the session
  lost,   ///< headset or runtime has gone: reason()
};

/// Once it is made only a gpu::DeviceLost is thrown: what else goes wrong ends in HeadsetPhase::lost, and everything
/// after is without effect. Thread: the one that uses the device.
class Headset {
public:
  /// @param device  made through `runtime`; both outlive this
  /// @throws HeadsetError
  Headset(HeadsetRuntime& runtime, gpu::Device& device, const HeadsetSettings& settings = {});
  ~Headset();
  Headset(const Headset&) = delete;
  Headset& operator=(const Headset&) = delete;

  /// Handles the runtime's events; never waits.
  HeadsetPhase poll();
  HeadsetPhase phase() const { return phase_; }
  /// Why it is lost: one line, empty if it is not.
  const std::string& reason() const { return reason_; }
  XrSession session() const { return session_; }
  /// What the runtime calls its state.
  XrSessionState state() const { return state_; }
  /// Whether the trainee sees it and the controllers are its own.
  bool focused() const { return state_ == XR_SESSION_STATE_FOCUSED; }

  /// Waits until the runtime wants the next frame; head and hands as they will be when it is shown. Nothing unless
  /// running. Each frame must be ended.
  std::optional<HeadsetFrame> begin_frame();
  /// Shows layers 0 and 1 of `eyes`, R8G8B8A8_SRGB, as left and right eye; null: nothing.
  void end_frame(const gpu::Image* eyes);

  /// Asks the runtime to end the session; poll() will say so.
  void request_exit();
  /// From now on the head, wherever it is, stands and faces as it did at the start. The only thing that moves the
  /// view besides the head.
  void recentre() { recentre_ = true; }
  /// Lets the hand with the needle feel something; nothing unless focused.
  void vibrate(const Vibration& vibration);
  /// Whether the trainee stands on the floor.
  bool on_floor() const { return room_from_floor_.has_value(); }

private:
  void handle(const XrEventDataBuffer& event);
  void change_state(XrSessionState state);
  void fit_swapchain();
  HeadsetFrame start_frame();
  void submit_frame(const gpu::Image* eyes);
  void place_room(const XrPosef& head);
  void lose(const std::string& why);

  HeadsetRuntime& runtime_;
  gpu::Device& device_;
  Eigen::Isometry3d room_from_standing_;
  std::optional<Eigen::Isometry3d> room_from_floor_;  ///< none: `local_` knows no floor
  Eigen::Isometry3d room_from_local_;
  XrSession session_ = XR_NULL_HANDLE;
  XrSpace local_ = XR_NULL_HANDLE;  ///< all poses are in it
  std::optional<HeadsetControllers> controllers_;
  std::optional<HeadsetSwapchain> swapchain_;
  XrSessionState state_ = XR_SESSION_STATE_UNKNOWN;
  HeadsetPhase phase_ = HeadsetPhase::waiting;
  std::string reason_;
  bool recentre_ = false;
  bool look_at_size_ = false;
  // Of the frame begun.
  XrTime display_time_ = 0;
  XrTime size_looked_at_ = 0;
  bool drawable_ = false;
  std::array<XrView, 2> views_{};
};

}  // namespace stylet::headset
