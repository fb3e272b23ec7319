#include "engine/app/graphics.h"

#include <chrono>
#include <stdexcept>
#include <thread>
#include <utility>

namespace stylet::app {

namespace {

constexpr int kMostLosses = 3;  // of a session: what is lost again and again is broken
constexpr int kAttempts = 3;
constexpr auto kBetweenAttempts = std::chrono::milliseconds(700);  // a driver that was reset takes a while

}  // namespace

Graphics::Graphics(gpu::DeviceSettings settings, Observer& observer)
    : settings_(std::move(settings)), observer_(observer), device_(std::make_unique<gpu::Device>(settings_)) {}

gpu::Device& Graphics::device() {
  if (!device_) device_ = std::make_unique<gpu::Device>(settings_);
  return *device_;
}

bool Graphics::recover(const gpu::DeviceLost& lost, const std::string& if_none) {
  device_.reset();
  const auto note = [&](const std::string& how) {
    observer_.note(Note::notice, fmt::format("the graphics device was lost ({}){}", lost.why(), how));
  };
  if (++losses_ >= kMostLosses) {
    note(fmt::format(" {} times; {}", losses_, if_none));
    return false;
  }
  std::string problem;
  for (int attempt = 1; attempt <= kAttempts; ++attempt) {
    if (attempt == kAttempts) settings_.maker = nullptr;  // a headset's runtime may have gone with its device
    try {
      device();
      note("; the session goes on with another");
      return true;
    } catch (const std::runtime_error& error) {
      problem = error.what();
    }
    if (attempt < kAttempts) std::this_thread::sleep_for(kBetweenAttempts);
  }
  note(fmt::format(", and there is no other ({}); {}", problem, if_none));
  return false;
}

}  // namespace stylet::app
