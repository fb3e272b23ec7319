// A device and a channel, turn by turn: what the device host does all the time.
#pragma once

#include "haptic/host/channel.h"
#include "haptic/host/driver.h"

#include <cstdint>

namespace stylet::haptic::host {

/// The force stylus' rules are kept here, where Stylet may stand still or be gone: 20 ms after its last report 2 the
/// force is zero, as it is 20 ms after the last pose. Depends on its inputs and the clock only.
class HostLoop {
public:
  static constexpr std::int64_t kSilence = 20'000'000;  ///< ns without a pose

  /// @param driver, channel  outlive it; the device is open
  HostLoop(Driver& driver, Channel& channel, HostClock clock = real_clock())
      : driver_(driver), channel_(channel), clock_(clock) {}

  /// Orders, pose, force. @return false: the device has gone
  bool turn();
  /// Orders, and the force where there is another or none any more. Forces that waited for kSilence are none. @return
  /// false: the device has refused it
  bool obey();
  std::uint64_t obeyed() const { return next_; }

private:
  bool push(std::int64_t now_ns);

  Driver& driver_;
  Channel& channel_;
  HostClock clock_;
  hid::StylusAdapter adapter_{kMostForce};
  std::uint64_t next_ = 0;
  bool on_ = false;
  bool pushed_ = false;         // the device was told a force last
  std::int64_t pose_ns_ = 0;    // of the last one; 0: none yet
  std::int64_t looked_ns_ = 0;  // for orders
};

}  // namespace stylet::haptic::host
