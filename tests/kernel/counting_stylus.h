// A force stylus that numbers its reports and keeps every force it gets: for counting what the way loses.
#pragma once

#include "haptic/hid/force_stylus.h"
#include "tests/support/hid/mock_firmware.h"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <span>
#include <vector>

namespace stylet::kernel_test {

class CountingStylus final : public support::MockFirmware {
public:
  std::vector<std::uint8_t> descriptor() const override {
    return {haptic::hid::kForceStylusDescriptor.begin(), haptic::hid::kForceStylusDescriptor.end()};
  }
  std::size_t input(std::int64_t, std::span<std::uint8_t> report) override {
    const auto pose =
        haptic::hid::pack_pose({.position = {sent * 1e-7, 0, 0},
                                .scan_time = static_cast<std::uint16_t>(sent * haptic::hid::kScanTicksPerReport)});
    std::copy(pose.begin(), pose.end(), report.begin());
    ++sent;
    return pose.size();
  }
  int output(std::int64_t, std::span<const std::uint8_t> report) override {
    if (report.size() != haptic::hid::kForceReportBytes || report[0] != haptic::hid::kForceReport) {
      ++strange;
      return EINVAL;
    }
    forces.push_back(word(report, 1));
    return 0;
  }
  int set_feature(std::int64_t, std::span<const std::uint8_t> report) override {
    if (report.size() != haptic::hid::kGainReportBytes || report[0] != haptic::hid::kGainReport) {
      return EINVAL;
    }
    gain = report[1];
    return 0;
  }
  int get_feature(std::span<std::uint8_t> report) override {
    if (report[0] != haptic::hid::kGainReport) {
      return -EINVAL;
    }
    report[1] = gain;
    return haptic::hid::kGainReportBytes;
  }

  /// Of a pose report: its number modulo 2^16 (X in units of 0.1 um).
  static std::uint16_t number(std::span<const std::uint8_t> report) { return word(report, 1); }
  static std::uint16_t scan_time(std::span<const std::uint8_t> report) { return word(report, 25); }
  /// A force report that CountingStylus keeps as `number`.
  static std::vector<std::uint8_t> numbered_force(std::uint16_t number) {
    return {haptic::hid::kForceReport,
            static_cast<std::uint8_t>(number),
            static_cast<std::uint8_t>(number >> 8),
            0,
            0,
            0,
            0};
  }

  std::uint32_t sent = 0;
  std::vector<std::uint16_t> forces;  ///< numbers, in order of arrival
  std::uint32_t strange = 0;          ///< output reports that are no forces
  std::uint8_t gain = 255;

private:
  static std::uint16_t word(std::span<const std::uint8_t> report, std::size_t at) {
    return static_cast<std::uint16_t>(report[at] | report[at + 1] << 8);
  }
};

}  // namespace stylet::kernel_test
