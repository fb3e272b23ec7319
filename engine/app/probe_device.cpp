#include "engine/app/probe_device.h"

#include "engine/app/hid_device.h"
#include "engine/session/needle_base.h"

#include "haptic/hid/force_writer.h"
#include "haptic/output_guard.h"
#include "haptic/paced_loop.h"

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace stylet::app {
namespace {

constexpr auto kPeriod = std::chrono::milliseconds(10);
constexpr std::uint64_t kStepsOfAPeriod = 10;  // of a loop at 1 kHz
constexpr double kStep = 1e-3;                 // s
constexpr int kPriority = 78;                  // below the needle's haptic thread

HidChoice choice_of(const std::string& description) {
  if (description == "hid") return {};
  if (description.starts_with("hid:")) return parse_hid_id(description.substr(4), "--probe-device " + description);
  return parse_device(description);
}

std::unique_ptr<haptic::hid::HidStylus> opened(const std::string& description, const std::string& taken,
                                               const content::Scene& scene) {
  HidChoice choice = choice_of(description);
  choice.taken = taken;
  return open_hid_probe(choice, "--probe-device " + description, scene);
}

session::ProbeHand feeling_hand(const content::Scene& scene, session::HeldProbe& probe, session::FeltSkin& skin,
                                const haptic::DeviceLimits& limits) {
  const physics::NeedleBase held = session::needle_base(limits, 1 / kStep);
  return {scene, probe, skin, held.stiffness, held.damping};
}

}  // namespace

ProbeDevice::ProbeDevice(const std::string& description, const std::string& taken, const content::Scene& scene,
                         session::HeldProbe& probe)
    : device_(opened(description, taken, scene)),
      feels_(device_->limits().renders_force && scene.probe.presses >= 0),
      hand_(feels_ ? feeling_hand(scene, probe, skin_, device_->limits()) : session::ProbeHand(scene, probe)) {}

std::string ProbeDevice::warning() const {
  if (!feels_ || device_->lets_go()) return {};
  return name() + ": its force may stay on if this computer stops; be ready to switch it off";
}

std::jthread ProbeDevice::lead(const session::LiveSession& live) {
  return std::jthread([this, &live](const std::stop_token& stop) {
    if (feels_) {
      lead_with_force(live, stop);
    } else {
      lead_without_force(live, stop);
    }
  });
}

void ProbeDevice::lead_without_force(const session::LiveSession& live, const std::stop_token& stop) {
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
}

void ProbeDevice::lead_with_force(const session::LiveSession& live, const std::stop_token& stop) {
  haptic::hid::run_under_fifo(kPriority);
  haptic::OutputGuard guard(device_->limits());
  haptic::MonotonicClock clock;
  haptic::LoopStatistics statistics;
  double last_s = 0;
  const auto step = [&](const haptic::StepTiming& timing) {
    const double now_s = static_cast<double>(timing.started_ns) * 1e-9;
    const double dt_s = last_s > 0 ? now_s - last_s : kStep;
    last_s = now_s;
    const double time_s = live.time_s();
    const haptic::StylusSample sample = device_->read(time_s);
    if (!sample.valid) {
      hand_.release();
    } else if (timing.index % kStepsOfAPeriod == 0) {
      hand_.follow(sample.position, sample.orientation, time_s);
    }
    const haptic::GuardedWrench out = guard.apply(
        {.force = sample.valid ? hand_.force(sample.position, sample.orientation, dt_s) : Eigen::Vector3d(0, 0, 0),
         .position = sample.position,
         .orientation = sample.orientation,
         .valid = sample.valid && !live.paused() && !live.finished(),
         .pose_age_s = sample.age_s,
         .patch_age_s = std::max(0.0, time_s - skin_.newest().time_s)},
        dt_s);
    device_->write(out.force, out.torque);
  };
  haptic::run_paced(clock, static_cast<std::int64_t>(1e9 * kStep), step, stop, statistics);
  device_->write(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
}

}  // namespace stylet::app
