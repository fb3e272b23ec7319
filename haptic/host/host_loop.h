// A device and a channel, turn by turn: what the device host does all the time.
#pragma once

#include "haptic/host/channel.h"
#include "haptic/host/driver.h"

#include <cstdint>

namespace stylet::haptic::host {

/// The force stylus' rules are kept here, where Stylet may stand still or be gone: 20 ms after its last report 2 the
/// force is zero, as it is 20 ms after the last pose. Depends on its inputs only.
class HostLoop {
public:
  static constexpr std::int64_t kSilence = 20'000'000;  ///< ns without a pose

  /// @param driver, channel  outlive it; the device is open
  HostLoop(Driver& driver, Channel& channel) : driver_(driver), channel_(channel) {}

  /// Orders, pose, force. @return false: the device has gone
  bool turn(std::int64_t now_ns);
  /// Orders, and the force where there is another. @return false: the device has refused it
  bool obey(std::int64_t now_ns);
  std::uint64_t obeyed() const { return next_; }

private:
  bool push(std::int64_t now_ns);

  Driver& driver_;
  Channel& channel_;
  hid::StylusAdapter adapter_{kMostForce};
  std::uint64_t next_ = 0;
  bool on_ = false;
  std::int64_t pose_ns_ = 0;  // of the last one; 0: none yet
};

}  // namespace stylet::haptic::host
