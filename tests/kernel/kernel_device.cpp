#include "tests/kernel/kernel_device.h"

#include <algorithm>
#include <array>
#include <chrono>

namespace stylet::kernel_test {
namespace {

std::int64_t now_ns() {
  return std::chrono::steady_clock::now().time_since_epoch().count();
}

}  // namespace

KernelDevice::KernelDevice(PortKind kind, support::MockFirmware& firmware, const DeviceIdentity& identity,
                           std::chrono::nanoseconds period)
    : firmware_(firmware),
      port_(kind == PortKind::kUhid ? make_uhid_port(identity, firmware.descriptor(), *this)
                                    : make_usb_port(identity, firmware.descriptor(), *this)),
      thread_([this, period](const std::stop_token& stop) { run(stop, period); }) {}

KernelDevice::~KernelDevice() {
  if (plugged_) {
    port_->unplug();
  }  // ends a transfer that the thread may wait for
  thread_.request_stop();
  thread_.join();
  port_.reset();
}

void KernelDevice::plug() {
  port_->plug();
  plugged_ = true;
}

void KernelDevice::unplug() {
  plugged_ = false;
  port_->unplug();
  const std::scoped_lock lock(mutex_);
  firmware_.power_off();
}

void KernelDevice::output(std::span<const std::uint8_t> report) {
  const std::scoped_lock lock(mutex_);
  firmware_.output(now_ns(), report);
}

std::vector<std::uint8_t> KernelDevice::get_feature(std::uint8_t id) {
  std::vector<std::uint8_t> report(4096);
  report[0] = id;
  const std::scoped_lock lock(mutex_);
  const int size = firmware_.get_feature(report);
  report.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
  return report;
}

bool KernelDevice::set_feature(std::span<const std::uint8_t> report) {
  const std::scoped_lock lock(mutex_);
  return firmware_.set_feature(now_ns(), report) == 0;
}

/// Periods that a slow bus or a busy machine has eaten are not made up for: each report is taken when it is sent.
void KernelDevice::run(const std::stop_token& stop, std::chrono::nanoseconds period) {
  std::array<std::uint8_t, 4096> report{};
  auto next = std::chrono::steady_clock::now();
  while (!stop.stop_requested()) {
    next = std::max(next + period, std::chrono::steady_clock::now());
    std::this_thread::sleep_until(next);
    std::size_t size = 0;
    {
      const std::scoped_lock lock(mutex_);
      firmware_.tick(now_ns());
      if (plugged_ && streaming_) {
        size = firmware_.input(now_ns(), report);
      }
    }
    if (size > 0) {
      port_->send(std::span(report).first(size));
    }
  }
}

}  // namespace stylet::kernel_test
