#include "engine/app/probe_device.h"

#include "engine/app/hid_device.h"

#include <chrono>

namespace stylet::app {
namespace {

constexpr auto kPeriod = std::chrono::milliseconds(10);

HidChoice choice_of(const std::string& description) {
  if (description == "hid") return {};
  if (description.starts_with("hid:")) return parse_hid_id(description.substr(4), "--probe-device " + description);
  return parse_device(description);
}

}  // namespace

ProbeDevice::ProbeDevice(const std::string& description, const std::string& taken, const content::Scene& scene,
                         session::HeldProbe& probe)
    : hand_(scene, probe) {
  HidChoice choice = choice_of(description);
  choice.taken = taken;
  device_ = open_hid_probe(choice, "--probe-device " + description, scene);
}

std::jthread ProbeDevice::lead(const session::LiveSession& live) {
  return std::jthread([this, &live](const std::stop_token& stop) {
    auto due = std::chrono::steady_clock::now();
    while (!stop.stop_requested()) {
      const double time_s = live.time_s();
      const haptic::StylusSample sample = device_->read(time_s);
      if (sample.valid) {
        hand_.follow(sample.position, sample.orientation, time_s);
      } else {
        hand_.release();
      }
      std::this_thread::sleep_until(due += kPeriod);
    }
  });
}

}  // namespace stylet::app
