// A joystick with PID constant forces and no time-out of its own, as desktop sticks and wheels are: what has been
// started goes on until its duration is over.
#pragma once

#include "tests/support/hid/mock_firmware.h"

#include <array>
#include <vector>

namespace stylet::support {

/// Two axes at rest. Depends on the calls and their times only.
class PidStick final : public MockFirmware {
public:
  /// @param endless  its descriptor has no Duration: effects have no end
  explicit PidStick(bool endless = false) : endless_(endless) {}

  std::vector<std::uint8_t> descriptor() const override;
  std::size_t input(std::int64_t now_ns, std::span<std::uint8_t> report) override;
  int output(std::int64_t now_ns, std::span<const std::uint8_t> report) override;
  int set_feature(std::int64_t now_ns, std::span<const std::uint8_t> report) override;
  int get_feature(std::span<std::uint8_t> report) override;
  void tick(std::int64_t now_ns) override;
  void power_off() override;

  /// Of full magnitude along X (0) or Y (1), while the motors are on and an effect plays.
  double applied(int axis) const;
  /// When an effect ran out last, by the device's own timer; 0: none did.
  std::int64_t ran_out_ns() const { return ran_out_ns_; }
  int times_run_out() const { return times_run_out_; }
  int starts() const { return starts_; }
  std::int64_t last_report_ns() const { return last_report_ns_; }
  bool enabled() const { return enabled_; }

private:
  struct Effect {
    int axis = -1;
    std::int64_t duration_ns = 0;  // 0: for ever
    std::int64_t started_ns = 0;
    bool plays = false;
    double magnitude = 0;
  };

  bool endless_;
  std::vector<Effect> effects_;
  bool enabled_ = false;
  std::int64_t ran_out_ns_ = 0;
  int times_run_out_ = 0;
  int starts_ = 0;
  std::int64_t last_report_ns_ = 0;
  std::uint16_t reports_ = 0;
};

}  // namespace stylet::support
