#include "haptic/host/dhd_driver.h"
#include "haptic/host/driver.h"
#include "haptic/host/hd_driver.h"

#include <ctime>

namespace stylet::haptic::host {

HostClock real_clock() {
  return {.now_ns =
              [] {
                timespec now{};
                clock_gettime(CLOCK_MONOTONIC, &now);
                return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
              },
          .pause =
              [] {
                const timespec millisecond{.tv_sec = 0, .tv_nsec = 1'000'000};
                nanosleep(&millisecond, nullptr);
              }};
}

std::unique_ptr<Driver> make_driver(const std::string& kind, const std::string& library, HostClock clock) {
  if (kind == "force_dimension") return make_dhd_driver(library);
  if (kind == "openhaptics") return make_hd_driver(library, clock);
  return nullptr;
}

}  // namespace stylet::haptic::host
