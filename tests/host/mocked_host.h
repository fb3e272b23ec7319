// The device host's work with a mocked vendor's library, a millisecond a step: the library is loaded as the vendor's
// is, its clock is the test's.
#pragma once

#include "haptic/host/channel.h"
#include "haptic/host/driver.h"
#include "haptic/host/host_loop.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/vendor/mock_device.h"

#include <dlfcn.h>

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>

namespace stylet::haptic::host {

inline constexpr std::int64_t kMs = 1'000'000;

/// Of all tests: the libraries keep it for ever.
inline support::MockDevice& mock() {
  static support::TemporaryFolder folder;
  static support::MockDevice& device = [&]() -> support::MockDevice& {
    setenv("STYLET_MOCK_DEVICE", (folder.path() / "device").c_str(), 1);
    return *support::mock_device();
  }();
  return device;
}

/// A vendor's library that is mocked.
struct Mocked {
  const char* kind;
  const char* library;
  const char* tick;    ///< its own turn, where it has a thread; else null
  const char* forget;  ///< of what a process that died leaves in it
};
inline constexpr Mocked kDhd{"force_dimension", STYLET_MOCK_DHD, nullptr, nullptr};
inline constexpr Mocked kHd{"openhaptics", STYLET_MOCK_HD, "mock_hd_tick", "mock_hd_forget"};

inline void call(const Mocked& mocked, const char* function) {
  if (function == nullptr) return;
  static void* library = nullptr;
  static const char* path = nullptr;
  if (path != mocked.library) library = dlopen(path = mocked.library, RTLD_NOW | RTLD_LOCAL);
  reinterpret_cast<void (*)()>(dlsym(library, function))();
}

inline const HostClock kTestClock{.now_ns = [] { return mock().clock_ns(); }, .pause = [] { call(kHd, kHd.tick); }};

/// One connection of a device host and its device.
struct Host {
  explicit Host(const Mocked& mocked)
      : driver(make_driver(mocked.kind, mocked.library, kTestClock)), channel(std::make_unique<Channel>()) {
    device = driver->open();
    loop.emplace(*driver, *channel, kTestClock);
  }
  std::unique_ptr<Driver> driver;
  std::unique_ptr<Channel> channel;
  Driver::Device device;
  std::optional<HostLoop> loop;
};

}  // namespace stylet::haptic::host
