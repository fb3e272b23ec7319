// A node /dev/hidrawN with a mocked device behind it, for the real hidapi: what the kernel's hidraw does.
#pragma once

#include "tests/support/hid/hidraw_wire.h"
#include "tests/support/hid/mock_firmware.h"
#include "tests/support/hid/mock_hid_bus.h"

#include <array>
#include <condition_variable>
#include <functional>
#include <list>
#include <mutex>
#include <thread>

namespace stylet::support {

struct MockNodeSettings {
  int number = 0;         ///< N of /dev/hidrawN
  double rate_hz = 1000;  ///< of input reports
  bool streaming = true;  ///< from the beginning
  int most_behind = 10;   ///< periods that it makes up for; a device that could not run longer skips reports
  int fifo_priority = 0;  ///< of the device's thread, where the system allows it; 0: an ordinary thread
  MockHidIdentity identity{};
};

/// A thread of its own is the kernel and the device. Each file that is open has a ring of 63 reports, and one more is
/// dropped, as in hidraw. Pulled out, reads fail with EIO and writes with ENODEV. All calls from any thread.
class MockHidNode {
public:
  /// Plugs it in. @param bus, firmware  outlive the node
  MockHidNode(MockHidBus& bus, MockFirmware& firmware, const MockNodeSettings& settings = {});
  ~MockHidNode();
  MockHidNode(const MockHidNode&) = delete;
  MockHidNode& operator=(const MockHidNode&) = delete;

  void unplug();
  /// Back in, as /dev/hidraw`number`.
  void plug(int number);
  /// Opening fails with this errno from now on; 0: it works.
  void refuse_open(int error);
  /// The device says nothing for so long; its force time-out goes on.
  void stall(double seconds);
  /// No reports by themselves: what inject() says only.
  void set_streaming(bool on);
  /// An input report of these bytes, whatever they are.
  void inject(std::span<const std::uint8_t> report);
  /// A write takes so long, as with a slow bus.
  void delay_writes(double seconds);
  /// Writes fail with this errno; 0: they work.
  void fail_writes(int error);

  std::uint64_t sent() const;     ///< reports put into rings
  std::uint64_t dropped() const;  ///< reports that found a ring full
  std::size_t open_files() const;

  /// Runs `look` while the device stands still.
  template <typename Look>
  auto with_device(const Look& look) const {
    const std::scoped_lock lock(mutex_);
    return look();
  }
  /// Waits until `condition`, evaluated while the device stands still. @return false: not within the time
  bool wait(const std::function<bool()>& condition, double seconds = 10) const;

private:
  struct OpenFile;

  void run(const std::stop_token& stop);
  std::int64_t serve(std::int64_t now_ns);  // @return when there is something to do again
  void accept_file();
  void listen_at(int number);
  void stop_listening();
  void deliver(std::span<const std::uint8_t> report);
  bool take_request(OpenFile& file, std::int64_t now_ns);
  HidrawAnswer answer(const HidrawRequest& request, std::int64_t now_ns);
  void wake() const;

  MockHidBus& bus_;
  MockFirmware& firmware_;
  MockNodeSettings settings_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::list<OpenFile> files_;
  int listening_ = -1;
  int wake_ = -1;
  int open_error_ = 0;
  int write_error_ = 0;
  std::int64_t write_delay_ns_ = 0;
  std::int64_t next_report_ns_ = 0;
  std::uint64_t sent_ = 0;
  std::uint64_t dropped_ = 0;
  std::jthread thread_;
};

}  // namespace stylet::support
