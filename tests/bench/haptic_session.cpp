// What `stylet bench haptic` measures: a whole session with a mocked stylus. The real libhidapi-hidraw reads the pose
// reports of a stylus' firmware and writes the forces that the physics of the scenario answers with.
//   stylet_haptic_session SECONDS JSON [FOLDER]
#include "engine/readers/motion.h"
#include "engine/readers/scenario.h"
#include "engine/session/live_session.h"
#include "haptic/hid/hid_stylus.h"
#include "physics/tissue/blas.h"
#include "tests/support/hid/mock_hid_node.h"
#include "tests/support/hid/stylus_firmware.h"
#include "tests/support/temporary_folder.h"
#include "tools/bench/figure_files.h"
#include "tools/bench/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <memory>
#include <thread>

namespace stylet::bench {
namespace {

using namespace haptic::hid;
using support::FirmwareEvent;
using Clock = std::chrono::steady_clock;

constexpr double kOnTheirWay = 2;  // reports, where counting begins and ends
constexpr double kQuickS = 10;     // below it one stall will do
constexpr double kStallS = 0.3;
constexpr double kZeroForceMs = 25;
constexpr double kFirstS = 0.050;
constexpr double kMostFirstN = 3.3 * (kFirstS / 0.5 + 0.02);  // of the rise in 0.5 s, a late step at the most

/// The hand of the scenario's recorded motion, to and fro. It rests until begin().
class Hand {
public:
  explicit Hand(const std::vector<content::MotionSample>& track) : track_(track) {}

  void begin() { began_ns_ = Clock::now().time_since_epoch().count(); }

  ForceStylusPose operator()() const {
    const physics::StylusPose first = track_.front().pose;
    const physics::StylusPose now = readers::sample_motion(track_, time_s()).pose;
    const DeviceProfile profile;
    const Eigen::AngleAxisd turn(now.orientation * first.orientation.conjugate());
    return {.position = profile.device_from_report.transpose() * (now.position - first.position),
            .rotation_vector = profile.rotation_from_report.transpose() * turn.axis() * turn.angle()};
  }

private:
  double time_s() const {
    if (began_ns_ == 0) return track_.front().time_s;
    const double length_s = track_.back().time_s - track_.front().time_s;
    const double since_s = 1e-9 * static_cast<double>(Clock::now().time_since_epoch().count() - began_ns_);
    const double phase_s = std::fmod(since_s, 2 * length_s);
    return track_.front().time_s + std::min(phase_s, 2 * length_s - phase_s);
  }

  const std::vector<content::MotionSample>& track_;
  std::atomic<std::int64_t> began_ns_{0};
};

template <typename Condition>
bool wait_until(const Condition& condition, double seconds) {
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  while (!condition()) {
    if (Clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

double as_double(std::uint64_t count) {
  return static_cast<double>(count);
}

/// A count that has to be zero.
Measurement none_of(std::string name, double count, std::string note) {
  return noted(at_most(std::move(name), count, "1", 0), std::move(note));
}

/// The stylus, its firmware and the session between them.
class HapticSession {
public:
  HapticSession(const content::Scene& scene, double seconds) : scene_(scene), seconds_(seconds) {
    const auto devices = haptic::hid::list_hid_devices();
    if (devices.empty()) throw std::runtime_error("the mocked stylus is not listed; umockdev-preload is not loaded");
    const physics::StylusPose first = scene.motion.stylus.front().pose;
    stylus_ = std::make_unique<HidStylus>(HidStylusSettings{
        .device = devices[0], .workspace = {.start = first.position, .start_orientation = first.orientation}});
    if (!wait_until([this] { return stylus_->read(0).valid; }, 10)) throw std::runtime_error("the stylus is silent");
    live_ = std::make_unique<session::LiveSession>(
        scene, *stylus_,
        session::LiveSettings{.coupling = session::coupling_from_name(scene.coupling),
                              .duration_s = std::numeric_limits<double>::infinity(),
                              .recording = folder_.path() / "session.rec"});
  }

  Report run(const std::filesystem::path& folder) {
    live_->start();
    hand_.begin();
    const auto& stream = stylus_->counters().stream;
    const std::uint64_t made_before = made();
    const std::uint64_t read_before = stream.reports;
    const std::uint64_t missing_before = stream.missing, gaps_before = stream.gaps,
                        discarded_before = stream.discarded;
    const auto begin = Clock::now();
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds_));
    const double wall_s = std::chrono::duration<double>(Clock::now() - begin).count();
    const std::uint64_t read = stream.reports - read_before;
    const std::uint64_t made_in = made() - made_before;
    const std::uint64_t written = stylus_->counters().force.written;
    report_.add({"session.duration", wall_s, "s", {}, {}, {}});
    report_.add({"reports.in.rate", as_double(read) / wall_s, "Hz", 1000, {}, {}});
    report_.add({"reports.in.made", as_double(made_in), "1", {}, {}, {}, "by the firmware"});
    report_.add({"reports.in.read", as_double(read), "1", {}, {}, {}, "through libhidapi-hidraw"});
    report_.add(none_of("reports.in.lost", std::max(0.0, as_double(made_in) - as_double(read) - kOnTheirWay),
                        "but for two on their way"));
    report_.add({"reports.in.missing",
                 as_double(stream.missing - missing_before),
                 "1",
                 {},
                 {},
                 {},
                 "by their Scan Time; a mock that is kept from its processor makes none"});
    report_.add(
        none_of("reports.in.discarded", as_double(stream.discarded - discarded_before), "had waited too long"));
    report_.add(none_of("reports.in.gaps", as_double(stream.gaps - gaps_before), "the hand was taken up anew"));
    add_latency(folder);
    add_forces(written);
    add_stalls();
    add_unplugging();
    add_force();
    finish();
    return report_;
  }

private:
  std::uint64_t made() const {
    return node_.with_device([this] { return firmware_.reports(); });
  }

  void add_latency(const std::filesystem::path& folder) {
    const haptic::LatencyHistogram& latency = stylus_->counters().force.pose_to_force;
    const haptic::LatencyQuantiles q = latency.quantiles();
    report_.add(noted(at_most("latency.median", 1e6 * q.median_s, "us", 2000),
                      "from when the device made the pose until its answer is written"));
    report_.add({"latency.p99", 1e6 * q.p99_s, "us", {}, {}, {}});
    report_.add({"latency.max", 1e6 * q.max_s, "us", {}, {}, {}});
    const haptic::LatencyHistogram& writing = stylus_->counters().force.write_time;
    report_.add({"write.median", 1e6 * writing.quantile(0.5), "us", {}, {}, {}, "hid_write"});
    report_.add({"write.p99", 1e6 * writing.quantile(0.99), "us", {}, {}, {}});
    if (!folder.empty()) draw(latency, folder);
  }

  /// The share of forces in each 50 us of latency.
  static void draw(const haptic::LatencyHistogram& latency, const std::filesystem::path& folder) {
    constexpr double kBinUs = 50;
    constexpr int kShares = 2000;
    std::vector<double> from_us, share;
    const double last_us = 1e6 * latency.quantile(0.999);
    for (double us = 0; us <= last_us + kBinUs; us += kBinUs) {
      from_us.push_back(us);
      share.push_back(0);
    }
    for (int k = 1; k <= kShares; ++k) {
      const double us = 1e6 * latency.quantile(static_cast<double>(k) / kShares);
      const auto bin = static_cast<std::size_t>(us / kBinUs);
      if (bin < share.size()) share[bin] += 100.0 / kShares;
    }
    figures::PlotSeries steps{
        .label = "", .x = {}, .y = {}, .colour = figures::plot_colour(0, figures::PlotTheme::light)};
    for (std::size_t i = 0; i < share.size(); ++i) {
      for (const double x : {from_us[i], from_us[i] + kBinUs}) {
        steps.x.push_back(x);
        steps.y.push_back(share[i]);
      }
    }
    const std::vector<figures::PlotPanel> panels{
        {.title = "From pose report to force report",
         .x = {.label = "latency (us)"},
         .y = {.label = "share of the forces (%)", .min = 0},
         .series = {steps},
         .markers = {{1e6 * latency.quantile(0.5), "median"}, {1e6 * latency.quantile(0.99), "99 %"}},
         .dots = {}}};
    const std::vector<std::string> caption{
        fmt::format("{} forces; the slowest took {:.1f} ms", latency.count(), 1e3 * latency.quantiles().max_s)};
    const std::vector<FigureColumn> columns{{"from_us", from_us}, {"share_percent", share}};
    write_figure(folder, "haptic_latency", panels, caption, columns);
  }

  void add_forces(std::uint64_t written) {
    // The device has what was written before: hid_write waits for it.
    node_.with_device([&] {
      const std::size_t received = firmware_.count(FirmwareEvent::kForce);
      report_.add({"forces.out.written", as_double(written), "1", {}, {}, {}, "through libhidapi-hidraw"});
      report_.add({"forces.out.received",
                   as_double(received),
                   "1",
                   {},
                   {},
                   {},
                   "by the firmware, zeros of start and end too"});
      report_.add(none_of("forces.out.lost", std::max(0.0, as_double(written) - as_double(received)), ""));
      report_.add(none_of("forces.out.refused", as_double(firmware_.count(FirmwareEvent::kRefused)),
                          "undeclared or misshapen"));
      report_.add(none_of("forces.out.failed", as_double(stylus_->counters().force.failed), "hid_write"));
      report_.add({"forces.out.superseded",
                   as_double(stylus_->counters().force.superseded),
                   "1",
                   {},
                   {},
                   {},
                   "overtaken by a newer one before they were written"});
      report_.add(none_of("force.time_outs", as_double(firmware_.count(FirmwareEvent::kTimeOut)),
                          "the device had to drop the force itself"));
    });
  }

  /// Of the whole session.
  void add_force() {
    node_.with_device([this] {
      double peak = 0;
      double not_finite = 0;
      for (const FirmwareEvent& event : firmware_.events()) {
        if (!event.force.allFinite()) ++not_finite;
        peak = std::max(peak, event.force.norm());
      }
      // A step of the report may round up.
      report_.add(
          noted(at_most("force.peak", peak, "N", stylus_->limits().max_force_n + 1e-3), "as the device got it"));
      report_.add(noted(at_least("force.felt", peak, "N", 0.1), "the same: the needle met something"));
      report_.add(none_of("force.not_finite", not_finite, ""));
    });
  }

  /// The device falls silent while it pushes: how long the last force lasts.
  void add_stalls() {
    double longest_s = 0;
    const int most = seconds_ < kQuickS ? 1 : 5;
    int stalls = 0;
    for (; stalls < most && wait_until([this] { return pushes(); }, 20); ++stalls) {
      node_.stall(kStallS);
      std::this_thread::sleep_for(std::chrono::duration<double>(kStallS / 2));
      node_.with_device([&] {
        const std::int64_t last_pose_ns = firmware_.last_report_ns();
        double zero_s = std::numeric_limits<double>::infinity();
        for (const FirmwareEvent& event : firmware_.events()) {
          const bool zero = event.kind == FirmwareEvent::kTimeOut || event.kind == FirmwareEvent::kDisabled ||
                            (event.kind == FirmwareEvent::kForce && event.force.isZero(0));
          if (event.time_ns > last_pose_ns && zero)
            zero_s = std::min(zero_s, 1e-9 * static_cast<double>(event.time_ns - last_pose_ns));
        }
        longest_s = std::max(longest_s, zero_s);
      });
      std::this_thread::sleep_for(std::chrono::duration<double>(kStallS / 2 + 0.5));
    }
    report_.add({"stall.count", static_cast<double>(stalls), "1", {}, {}, {}, "of 300 ms, while the device pushes"});
    report_.add(
        noted(at_most("stall.zero_force", 1e3 * longest_s, "ms", kZeroForceMs),
              "after the last pose, the longest: 20 ms, the next step, its report; the machine's own delays"));
  }

  /// The device is pulled out while it pushes, and put back in a second later.
  void add_unplugging() {
    const int most = seconds_ < kQuickS ? 1 : 3;
    int times = 0;
    double longest_seen_s = 0, longest_back_s = 0, most_at_once = 0;
    for (; times < most && wait_until([this] { return pushes(); }, 20); ++times) {
      const auto out = Clock::now();
      node_.unplug();
      if (!wait_until([this] { return !stylus_->connected(); }, 5)) break;
      longest_seen_s = std::max(longest_seen_s, seconds_since(out));
      std::this_thread::sleep_for(std::chrono::seconds(1));
      const auto in = Clock::now();
      node_.plug(times + 1);
      if (!wait_until([this] { return pushes(); }, 20)) break;
      longest_back_s = std::max(longest_back_s, seconds_since(in));
      std::this_thread::sleep_for(std::chrono::duration<double>(kFirstS));
      most_at_once = std::max(most_at_once, first_force(in.time_since_epoch().count()));
    }
    report_.add(noted(at_least("unplug.count", times, "1", most), "pulled out while it pushes, and put back"));
    report_.add({"unplug.seen", 1e3 * longest_seen_s, "ms", {}, {}, {}, "until the session knows, the longest"});
    report_.add({"unplug.back",
                 1e3 * longest_back_s,
                 "ms",
                 {},
                 {},
                 {},
                 "from the return until it pushes again, the longest"});
    report_.add(noted(at_most("unplug.first_force", most_at_once, "N", kMostFirstN),
                      "the most in the first 50 ms with a force: it rises anew"));
  }

  bool pushes() const {
    return node_.with_device([this] { return firmware_.applied_force().norm() > 0.05; });
  }
  static double seconds_since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
  }
  /// The most that was asked for within kFirstS of the first force after a time.
  double first_force(std::int64_t after_ns) const {
    return node_.with_device([&] {
      std::int64_t first_ns = 0;
      double most = 0;
      for (const FirmwareEvent& event : firmware_.events()) {
        if (event.kind != FirmwareEvent::kForce || event.time_ns < after_ns || event.force.isZero(0)) continue;
        if (first_ns == 0) first_ns = event.time_ns;
        if (event.time_ns - first_ns < static_cast<std::int64_t>(1e9 * kFirstS))
          most = std::max(most, event.force.norm());
      }
      return most;
    });
  }

  void finish() {
    const session::RunStatistics run = live_->stop();
    live_.reset();
    stylus_.reset();
    const bool off =
        node_.with_device([this] { return !firmware_.enabled() && firmware_.applied_force().isZero(0); });
    report_.add({"haptic.rate", run.haptic.rate_hz, "Hz", scene_.rates.haptic_hz, {}, {}});
    report_.add({"haptic.step.median", 1e6 * run.haptic.step_time.median_s, "us", {}, {}, {}});
    report_.add({"haptic.step.p99", 1e6 * run.haptic.step_time.p99_s, "us", {}, {}, {}});
    report_.add({"haptic.missed_deadlines",
                 as_double(run.haptic.missed_deadlines),
                 "1",
                 {},
                 {},
                 {},
                 fmt::format("of {}", run.haptic.steps)});
    report_.add({"simulation.rate", run.simulation.rate_hz, "Hz", scene_.rates.simulation_hz, {}, {}});
    report_.add({"simulation.missed_deadlines",
                 as_double(run.simulation.missed_deadlines),
                 "1",
                 {},
                 {},
                 {},
                 fmt::format("of {}", run.simulation.steps)});
    report_.add(noted(at_least("end.motors_off", off ? 1 : 0, "1", 1), "zero force, then actuators disabled"));
    if (!run.warning.empty()) fmt::print(stderr, "{}\n", run.warning);
  }

  const content::Scene& scene_;
  double seconds_;
  support::TemporaryFolder folder_;
  Hand hand_{scene_.motion.stylus};
  support::MockHidBus bus_;
  support::StylusFirmware firmware_{[this](double) { return hand_(); }};
  support::MockHidNode node_{bus_, firmware_, {.fifo_priority = 85}};
  std::unique_ptr<HidStylus> stylus_;
  std::unique_ptr<session::LiveSession> live_;
  Report report_;
};

}  // namespace
}  // namespace stylet::bench

int main(int argc, char** argv) try {
  using namespace stylet;
  if (argc < 3) throw std::runtime_error("usage: stylet_haptic_session SECONDS JSON [FOLDER]");
  physics::single_threaded_blas();
  const content::Scene scene = readers::load_scene(readers::find_scenario("liver_biopsy"));
  bench::HapticSession session(scene, std::stod(argv[1]));
  const bench::Report report = session.run(argc > 3 ? argv[3] : "");
  std::ofstream(argv[2]) << bench::to_json(report);
} catch (const std::exception& error) {
  fmt::print(stderr, "stylet_haptic_session: {}\n", error.what());
  return 2;
}
