// The device behind a mocked node: what a maker would put into it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace stylet::support {

/// Called by the node, one call at a time. Times are CLOCK_MONOTONIC, ns; buffers begin with the report's id.
class MockFirmware {
public:
  virtual ~MockFirmware() = default;
  virtual std::vector<std::uint8_t> descriptor() const = 0;
  /// Fills in the next input report. @return its bytes; 0: nothing to say now
  virtual std::size_t input(std::int64_t now_ns, std::span<std::uint8_t> report) = 0;
  /// @return 0 or errno
  virtual int output(std::int64_t /*now_ns*/, std::span<const std::uint8_t> /*report*/) { return 0; }
  virtual int set_feature(std::int64_t /*now_ns*/, std::span<const std::uint8_t> /*report*/) { return 0; }
  /// report[0] is the id asked for. @return bytes, or -errno
  virtual int get_feature(std::span<std::uint8_t> report);
  /// Every millisecond or sooner.
  virtual void tick(std::int64_t /*now_ns*/) {}
  /// It has been pulled out: no power.
  virtual void power_off() {}
};

}  // namespace stylet::support
