// A device by its vendor's library, as the device host drives it.
#pragma once

#include "haptic/hid/stylus_adapter.h"

#include <Eigen/Core>

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

namespace stylet::haptic::host {

/// The library or the device cannot be used. One line: why not, what to do.
class DriverError final : public std::runtime_error {
public:
  DriverError(const std::string& what, bool installed) : std::runtime_error(what), installed_(installed) {}
  bool installed() const { return installed_; }  ///< the library is there

private:
  bool installed_;
};

/// N, of a device that does not tell its own largest force.
inline constexpr double kStrangeMost = 3;

/// One thread calls it; every call may wait for the bus.
class Driver {
public:
  struct Device {
    std::string name{};
    std::string serial{};
  };
  enum class Read : std::uint8_t {
    kPose,
    kNothing,  ///< an error that may pass
    kGone,
  };

  virtual ~Driver() = default;
  /// Motors off. @throws DriverError
  virtual Device open() = 0;
  /// @param now_ns  monotonic clock
  virtual Read read(hid::AdaptedState& state, std::int64_t now_ns) = 0;
  /// @param force  N, axes of the reports; beyond what the device gives it is made shorter
  virtual bool push(const Eigen::Vector3d& force) = 0;
  /// Motors on or off, without a force.
  virtual void enable(bool on) = 0;
  /// What the device needs before it can lead or push, one line; empty: nothing.
  virtual std::string needs() const = 0;
  /// Zero force, motors off.
  virtual void close() = 0;
};

/// The time of a driver whose library has a thread of its own.
struct HostClock {
  std::int64_t (*now_ns)();  ///< monotonic
  void (*pause)();           ///< a millisecond
};
HostClock real_clock();

/// By name: "force_dimension" or "openhaptics". @param library  path of the vendor's library; empty: where it is
/// found
/// @return null: there is no such kind
std::unique_ptr<Driver> make_driver(const std::string& kind, const std::string& library,
                                    HostClock clock = real_clock());

}  // namespace stylet::haptic::host
