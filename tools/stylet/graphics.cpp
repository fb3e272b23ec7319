#include "tools/stylet/graphics.h"

#include <chrono>
#include <stdexcept>
#include <thread>
#include <utility>

namespace stylet::tools {

namespace {

constexpr int kMostLosses = 3;  // of a session: what is lost again and again is broken
constexpr int kAttempts = 3;
constexpr auto kBetweenAttempts = std::chrono::milliseconds(700);  // a driver that was reset takes a while

}  // namespace

Graphics::Graphics(gpu::DeviceSettings settings)
    : settings_(std::move(settings)), device_(std::make_unique<gpu::Device>(settings_)) {}

gpu::Device& Graphics::device() {
  if (!device_) device_ = std::make_unique<gpu::Device>(settings_);
  return *device_;
}

bool Graphics::recover(const gpu::DeviceLost& lost, const std::string& if_none) {
  device_.reset();
  if (++losses_ >= kMostLosses) {
    fmt::print(stderr, "stylet: the graphics device was lost ({}) {} times; {}\n", lost.why(), losses_, if_none);
    return false;
  }
  std::string problem;
  for (int attempt = 1; attempt <= kAttempts; ++attempt) {
    if (attempt == kAttempts) settings_.maker = nullptr;  // a headset's runtime may have gone with its device
    try {
      device();
      fmt::print(stderr, "stylet: the graphics device was lost ({}); the session goes on with another\n", lost.why());
      return true;
    } catch (const std::runtime_error& error) {
      problem = error.what();
    }
    if (attempt < kAttempts) std::this_thread::sleep_for(kBetweenAttempts);
  }
  fmt::print(stderr, "stylet: the graphics device was lost ({}), and there is no other ({}); {}\n", lost.why(),
             problem, if_none);
  return false;
}

}  // namespace stylet::tools
