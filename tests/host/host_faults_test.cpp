// Random sequences of faults of a vendor's library, the device host and Stylet: each ends without force.
#include "tests/host/mocked_host.h"
#include "tests/support/sanitized.h"
#include "tests/support/session_side.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace stylet::haptic::host {
namespace {

using Eigen::Vector3d;
using support::MockDevice;

enum Fault {
  kErrors,
  kHangs,
  kNotFiniteFrom,
  kSkewed,
  kFar,
  kPulledOut,
  kBrake,
  kNoPower,
  kHostKilled,
  kStyletStopped,
  kLoopStops,
  kNotFinite,
  kReaderStarved,
  kGarbage,
  kCached,
  kFaults,
  kLasting = kGarbage
};
constexpr std::array<const char*, kFaults> kNames{
    "library fails",  "library hangs",       "NaN from device", "skewed matrix",
    "9 m away",       "pulled out",          "brake",           "no power",
    "host killed",    "Stylet stopped",      "loop stops",      "NaN from physics",
    "reader starved", "garbage to the host", "cached poses"};
constexpr int kNone = -1;

int mocked(int fault) {
  switch (fault) {
    case kErrors:
      return MockDevice::kErrors;
    case kHangs:
      return MockDevice::kHangs;
    case kNotFiniteFrom:
      return MockDevice::kNotFinite;
    case kSkewed:
      return MockDevice::kSkewed;
    case kFar:
      return MockDevice::kFar;
    case kPulledOut:
      return MockDevice::kPulledOut;
    case kBrake:
      return MockDevice::kBrake;
    case kNoPower:
      return MockDevice::kNoPower;
    case kCached:
      return MockDevice::kCached;
    default:
      return kNone;
  }
}

/// The library is the same all the time; the device host comes and goes.
class Rig {
public:
  Rig(const Mocked& mocked, std::uint64_t seed) : mocked_(mocked), random_(seed) {
    mock().reset();
    now_ = 1'000'000 * kMs;
    mock().now_ns = now_;
    connect();
  }

  std::array<bool, kFaults> active{};

  void step() {
    now_ += kMs;
    mock().now_ns = now_;
    const double t = 1e-9 * static_cast<double>(now_ % (1000 * 1000 * kMs));
    mock().x = 0.002 * std::sin(7 * t), mock().y = 0.001 * std::sin(11 * t), mock().z = -0.003 * std::sin(5 * t);
    mock().fault = MockDevice::kNone;
    for (int f = 0; f < kFaults; ++f) {
      if (active[f] && mocked(f) != kNone) mock().fault = mocked(f);
    }
    const double before = mock().applied();
    session_.starved = active[kReaderStarved];
    session_.loop_stops = active[kLoopStops] || active[kStyletStopped];
    session_.not_finite = active[kNotFinite];
    if (active[kHostKilled] && host_) {           // without a word; the bus is closed by the kernel
      dead_.push_back(std::move(host_->driver));  // it says no last word
      host_.reset();
      mock().open = 0;
      call(mocked_, mocked_.forget);
      session_.disconnect();
    }
    // A library with a thread of its own stands still in that one.
    const bool hangs = mock().fault == MockDevice::kHangs && mocked_.tick == nullptr;
    if (!host_ && !active[kHostKilled] && mock().fault != MockDevice::kHangs) connect();
    call(mocked_, mocked_.tick);
    if (host_ && !hangs) run_host();
    if (!active[kStyletStopped]) {
      const auto send = [this](std::span<const std::uint8_t> bytes) {
        if (host_) host_->channel->orders.put(bytes);
      };
      session_.step(now_, send);
      if (active[kGarbage]) {
        std::vector<std::uint8_t> bytes(1 + random_() % 20);
        for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random_());
        if (bytes[0] != hid::kForceReport && bytes[0] != hid::kControlReport && bytes[0] != hid::kGainReport)
          send(bytes);
      }
    }
    if (before == 0 && mock().applied() > kFirst) broken_ = "a force comes on at once";
    if (mock().not_finite > 0) broken_ = "a force is not finite";
    if (mock().largest > session_.limits().max_force_n + 1e-3) broken_ = "a force is above the peak";
    if (mock().broken > 0) broken_ = "a call that is not allowed";
  }

  const std::string& broken() const { return broken_; }
  std::uint64_t engagements() const { return session_.engagements(); }

private:
  static constexpr double kFirst = 3.3 * 0.005 / 0.05 + 1e-3;  // N, as in the campaign of HID

  void connect() {
    try {
      host_.emplace(mocked_);
    } catch (const DriverError&) {
      host_.reset();
      return;
    }
    next_ = 0;
    session_.connect();
    session_.enable([this](std::span<const std::uint8_t> bytes) { host_->channel->orders.put(bytes); });
  }

  void run_host() {
    if (!host_->loop->turn()) {
      host_->driver->close();
      host_.reset();
      session_.disconnect();
      return;
    }
    if (active[kStyletStopped]) return;
    std::array<std::uint8_t, 31> bytes{};
    while (const std::size_t size = host_->channel->poses.take(next_, bytes)) {
      session_.report(std::span(bytes).first(size));
    }
  }

  Mocked mocked_;
  std::mt19937_64 random_;
  support::SessionSide session_{hid::adapted_descriptor(kMostForce)};
  std::vector<std::unique_ptr<Driver>> dead_;
  std::optional<Host> host_;
  std::uint64_t next_ = 0;
  std::int64_t now_ = 0;
  std::string broken_;
};

void run_campaign(const Mocked& which) {
  std::array<int, kFaults> injected{}, ends{}, with_force{}, longest{};
  std::uint64_t engagements = 0;
  const int sequences = support::kSanitized ? 150 : 1000;
  for (int s = 0; s < sequences; ++s) {
    std::mt19937_64 random(static_cast<std::uint64_t>(s) + 1);
    const auto any = [&](int least, int most) { return std::uniform_int_distribution<int>(least, most)(random); };
    Rig rig(which, static_cast<std::uint64_t>(s) + 1);
    struct Planned {
      Fault fault;
      int from, to;
    };
    std::vector<Planned> plan(static_cast<std::size_t>(any(1, 4)));
    for (Planned& p : plan) {
      p.fault = static_cast<Fault>(any(0, kFaults - 1));
      p.from = 120 + any(0, 150);
      p.to = p.from + any(1, any(1, 100));
      ++injected[p.fault];
    }
    const auto last = static_cast<Fault>(any(0, kLasting - 1));
    const int onset = 1100 + any(0, 150);  // a trip takes half a second
    bool had_force = false;
    int zero_after = 0;
    for (int t = 0; t < onset + 120; ++t) {
      rig.active.fill(false);
      for (const Planned& p : plan) rig.active[p.fault] = rig.active[p.fault] || (t >= p.from && t < p.to);
      if (t == onset) had_force = mock().applied() > 0;
      if (t >= onset) rig.active[last] = true;
      rig.step();
      if (t >= onset && mock().applied() > 0) zero_after = t - onset + 1;
      ASSERT_EQ(rig.broken(), "") << "sequence " << s << ", step " << t;
    }
    ASSERT_LE(zero_after, 21) << kNames[last] << ", sequence " << s;
    ++ends[last];
    with_force[last] += had_force ? 1 : 0;
    longest[last] = std::max(longest[last], zero_after);
    engagements += rig.engagements();
  }
  std::printf("%d sequences, the force engaged %llu times\n", sequences,
              static_cast<unsigned long long>(engagements));
  for (int f = 0; f < kFaults; ++f) {
    std::printf("%-20s %5d in the middle", kNames[f], injected[f]);
    if (f < kLasting) {
      std::printf(", %4d at the end (%4d with force): zero after %2d ms", ends[f], with_force[f], longest[f]);
      EXPECT_GT(with_force[f], ends[f] / 2) << kNames[f] << ": there must be a force to lose";
    }
    std::printf("\n");
  }
}

TEST(DhdFaults, AThousandRandomSequencesEndWithoutForceWithin21Ms) {
  run_campaign(kDhd);
}

TEST(HdFaults, AThousandRandomSequencesEndWithoutForceWithin21Ms) {
  run_campaign(kHd);
}

}  // namespace
}  // namespace stylet::haptic::host
