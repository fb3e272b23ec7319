// What `stylet bench haptic --device-kind` measures for devices that know no HID: a whole session with the product's
// own way to a mocked service or a mocked vendor's library.
//   stylet_adapted_session KIND SECONDS JSON
#include "engine/readers/device_profile_file.h"
#include "engine/readers/motion.h"
#include "engine/readers/scenario.h"
#include "engine/session/live_session.h"
#include "haptic/haply/haply_transport.h"
#include "haptic/hid/hid_stylus.h"
#include "haptic/host/host_transport.h"
#include "physics/tissue/blas.h"
#include "tests/support/haply/haply_server.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/vendor/mock_device.h"
#include "tools/bench/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

namespace stylet::bench {
namespace {

using Clock = std::chrono::steady_clock;
using Eigen::Vector3d;

constexpr double kPush = 0.05;       // N, that counts as one
constexpr double kQuickS = 10;       // below it one stall will do
constexpr double kZeroForceMs = 25;  // the machine's own delays in it

double since_s(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

bool wait_until(const std::function<bool()>& done, double seconds) {
  const auto begin = Clock::now();
  while (!done()) {
    if (since_s(begin) > seconds) return false;
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  return true;
}

/// The hand of the scenario's recorded motion, to and fro, from its place at first: right, up, near.
class Hand {
public:
  explicit Hand(const std::vector<content::MotionSample>& track) : track_(track) {}
  void begin() { began_ns_ = Clock::now().time_since_epoch().count(); }
  Vector3d operator()() const {
    const Vector3d first = track_.front().pose.position;
    if (began_ns_ == 0) return Vector3d::Zero();
    const double length_s = track_.back().time_s - track_.front().time_s;
    const double since = 1e-9 * static_cast<double>(Clock::now().time_since_epoch().count() - began_ns_);
    const double phase_s = std::fmod(since, 2 * length_s);
    const double at_s = track_.front().time_s + std::min(phase_s, 2 * length_s - phase_s);
    return readers::sample_motion(track_, at_s).pose.position - first;
  }

private:
  const std::vector<content::MotionSample>& track_;
  std::atomic<std::int64_t> began_ns_{0};
};

/// What is mocked.
class Mocked {
public:
  virtual ~Mocked() = default;
  virtual const haptic::hid::DeviceSource& source() const = 0;
  virtual double applied() = 0;  ///< N
  virtual double largest() = 0;  ///< N
  virtual double wrong() = 0;    ///< messages or calls that are not allowed
  virtual void stall(bool on) = 0;
  virtual const char* stall_words() const = 0;
};

class MockedHaply final : public Mocked {
public:
  explicit MockedHaply(const Hand& hand) {
    server_.with_service([&hand](support::HaplyService& service) {
      // It drops a force 20 ms after the last message; the true one's time is not documented.
      service.idle_ns = 20'000'000;
      service.motion = [&hand](double) {
        const Vector3d at = hand();
        return support::HaplyHand{.position = {at.x(), -at.z(), at.y()}};
      };
    });
  }
  const haptic::hid::DeviceSource& source() const override { return source_; }
  double applied() override {
    return server_.with_service(
        [](support::HaplyService& s) { return s.applied(support::HaplyServer::now_ns()).norm(); });
  }
  double largest() override {
    return server_.with_service([](support::HaplyService& s) { return s.largest(); });
  }
  double wrong() override {
    return server_.with_service([](support::HaplyService& s) { return static_cast<double>(s.nonsense()); });
  }
  void stall(bool on) override {
    server_.set(on ? support::HaplyServer::Trouble::kStall : support::HaplyServer::Trouble::kNone);
  }
  const char* stall_words() const override { return "the service does not answer; it drops a force after 20 ms"; }

private:
  support::HaplyServer server_;
  haptic::haply::HaplySource source_{{.host = "127.0.0.1", .port = server_.port()}};
};

class MockedLibrary final : public Mocked {
public:
  MockedLibrary(const Hand& hand, const std::string& kind) {
    setenv("STYLET_MOCK_DEVICE", (folder_.path() / "device").c_str(), 1);
    mock_ = support::mock_device();
    mock_->reset();
    const bool dhd = kind == "force_dimension";
    source_ = std::make_unique<haptic::host::HostSource>(
        haptic::host::Vendor{.kind = kind,
                             .name = kind,
                             .usb_id = static_cast<std::uint16_t>(dhd ? 0x1451 : 0x2988),
                             .library = dhd ? STYLET_MOCK_DHD : STYLET_MOCK_HD,
                             .program = haptic::host::host_program()});
    mover_ = std::jthread([this, &hand, dhd](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        const Vector3d at = hand();
        mock_->x = dhd ? at.z() : at.x();
        mock_->y = dhd ? at.x() : at.y();
        mock_->z = dhd ? at.y() : at.z();
        std::this_thread::sleep_for(std::chrono::microseconds(500));
      }
    });
  }
  const haptic::hid::DeviceSource& source() const override { return *source_; }
  double applied() override { return mock_->applied(); }
  double largest() override { return mock_->largest; }
  double wrong() override { return static_cast<double>(mock_->broken + mock_->not_finite); }
  void stall(bool on) override { mock_->fault = on ? support::MockDevice::kHangs : support::MockDevice::kNone; }
  const char* stall_words() const override {
    return "the library hangs; the mocked firmware drops a force after 20 ms";
  }

private:
  support::TemporaryFolder folder_;
  support::MockDevice* mock_ = nullptr;
  std::unique_ptr<haptic::host::HostSource> source_;
  std::jthread mover_;
};

Measurement none_of(std::string name, double count, std::string note) {
  return noted(at_most(std::move(name), count, "1", 0), std::move(note));
}

Report measure(const content::Scene& scene, const std::string& kind, double seconds) {
  Hand hand(scene.motion.stylus);
  std::unique_ptr<Mocked> mocked;
  if (kind == "haply") {
    mocked = std::make_unique<MockedHaply>(hand);
  } else {
    mocked = std::make_unique<MockedLibrary>(hand, kind);
  }
  const auto devices = mocked->source().list();
  if (devices.empty()) throw std::runtime_error(mocked->source().missing());
  const physics::StylusPose first = scene.motion.stylus.front().pose;
  haptic::hid::HidStylus stylus(
      {.device = devices[0],
       .source = &mocked->source(),
       .profile = readers::choose_profile(readers::load_device_profiles(),
                                          {devices[0].vendor_id, devices[0].product_id, devices[0].product},
                                          haptic::hid::DeviceKind::kStylus),
       .workspace = {.start = first.position, .start_orientation = first.orientation}});
  if (!wait_until([&] { return stylus.read(0).valid; }, 10)) throw std::runtime_error("the device is silent");
  const support::TemporaryFolder folder;
  session::LiveSession live(scene, stylus,
                            {.coupling = session::coupling_from_name(scene.coupling),
                             .duration_s = std::numeric_limits<double>::infinity(),
                             .recording = folder.path() / "session.rec"});
  live.start();
  hand.begin();
  const auto& stream = stylus.counters().stream;
  const auto& force = stylus.counters().force;
  const std::uint64_t reports_before = stream.reports, gaps_before = stream.gaps;
  const auto begin = Clock::now();
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  const double wall_s = since_s(begin);

  Report report;
  const auto counted = [&](const char* name, std::uint64_t value, const char* note) {
    report.add({name, static_cast<double>(value), "1", {}, {}, {}, note});
  };
  report.add({"session.duration", wall_s, "s", {}, {}, {}});
  report.add({"reports.in.rate", static_cast<double>(stream.reports - reports_before) / wall_s, "Hz", 1000, {}, {}});
  counted("reports.in.gaps", stream.gaps - gaps_before, "the hand was taken up anew");
  const haptic::LatencyQuantiles latency = force.pose_to_force.quantiles();
  report.add(noted(at_most("latency.median", 1e6 * latency.median_s, "us", 2000),
                   "from the pose until its answer is handed to the thread that drives the device"));
  report.add({"latency.p99", 1e6 * latency.p99_s, "us", {}, {}, {}});
  report.add({"latency.max", 1e6 * latency.max_s, "us", {}, {}, {}});
  counted("forces.out.written", force.written, "");
  report.add(none_of("forces.out.lost", static_cast<double>(force.failed), "refused by that thread"));
  counted("forces.out.superseded", force.superseded, "overtaken by a newer one before they were written");

  double longest_s = 0;
  int stalls = 0;
  for (const int most = seconds < kQuickS ? 1 : 5; stalls < most; ++stalls) {
    if (!wait_until([&] { return mocked->applied() > kPush; }, 20)) break;
    mocked->stall(true);
    const auto stalled = Clock::now();
    wait_until([&] { return mocked->applied() == 0; }, 5);
    longest_s = std::max(longest_s, since_s(stalled));
    mocked->stall(false);
    std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  }
  counted("stall.count", static_cast<std::uint64_t>(stalls), mocked->stall_words());
  report.add(noted(at_most("stall.zero_force", 1e3 * longest_s, "ms", kZeroForceMs), "the longest"));
  wait_until([&] { return mocked->largest() > 0.1; }, 20);  // a quick run may have stalled before the needle met much
  report.add(at_most("force.peak", mocked->largest(), "N", stylus.limits().max_force_n + 1e-3));
  report.add(noted(at_least("force.felt", mocked->largest(), "N", 0.1), "the same: the needle met something"));
  report.add(none_of("device.wrong", mocked->wrong(), "what its interface does not allow"));
  const session::RunStatistics run = live.stop();
  report.add({"haptic.rate", run.haptic.rate_hz, "Hz", scene.rates.haptic_hz, {}, {}});
  report.add({"haptic.missed_deadlines",
              static_cast<double>(run.haptic.missed_deadlines),
              "1",
              {},
              {},
              {},
              fmt::format("of {}", run.haptic.steps)});
  const bool off = wait_until([&] { return mocked->applied() == 0; }, 5);
  report.add(noted(at_least("end.no_force", off ? 1 : 0, "1", 1), "when the session has ended"));
  return report;
}

}  // namespace
}  // namespace stylet::bench

int main(int argc, char** argv) try {
  using namespace stylet;
  if (argc < 4) throw std::runtime_error("usage: stylet_adapted_session KIND SECONDS JSON");
  physics::single_threaded_blas();
  const content::Scene scene = readers::load_scene(readers::find_scenario("liver_biopsy"));
  std::ofstream(argv[3]) << bench::to_json(bench::measure(scene, argv[1], std::stod(argv[2])));
} catch (const std::exception& error) {
  fmt::print(stderr, "stylet_adapted_session: {}\n", error.what());
  return 2;
}
