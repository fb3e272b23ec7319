#include "haptic/hid/hid_stylus.h"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <exception>
#include <utility>
#include <vector>

namespace stylet::haptic::hid {
namespace {

constexpr int kMostRetries = 8;                  // of retry_s: looking may start a process, or a connection
constexpr std::int64_t kAskAgain = 500'000'000;  // ns, between two questions what the device needs
constexpr int kReadTimeout = 5;                  // ms; a stop is seen so late
constexpr int kMostQueued = 256;                 // of any backend; a device that floods is not drained for ever

std::string title(const HidDeviceSummary& device) {
  return fmt::format("{} ({:04x}:{:04x})", device.product.empty() ? "HID device" : device.product, device.vendor_id,
                     device.product_id);
}

/// How long a device that renders force may be silent before its pose is none.
double stale_s(const ForceOutput& output) {
  return output.way() == ForceOutput::Way::kNone ? 0 : output.limits().stale_pose_zero_s;
}

}  // namespace

struct HidStylus::Link {
  Link(std::unique_ptr<ReportTransport> open, std::vector<std::uint8_t> bytes, const ReportDescriptor& descriptor,
       const DeviceProfile& profile)
      : report_descriptor(std::move(bytes)),
        map(descriptor, profile),
        output(descriptor, profile),
        transport(std::move(open)) {}

  std::vector<std::uint8_t> report_descriptor;
  StylusMap map;
  ForceOutput output;
  std::unique_ptr<ReportTransport> transport;
};

std::unique_ptr<HidStylus::Link> HidStylus::open(const std::string& path) const {
  std::vector<std::uint8_t> bytes = settings_.source->descriptor(path);
  const ReportDescriptor descriptor = with_vendor_reports(parse_report_descriptor(bytes), settings_.profile);
  auto link = std::make_unique<Link>(settings_.source->open(path), std::move(bytes), descriptor, settings_.profile);
  if (!link->map.usable()) throw HidError(fmt::format("{}: {}", path, link->map.reason()));
  return link;
}

HidStylus::HidStylus(const HidStylusSettings& settings) : settings_(settings), name_(title(settings.device)) {
  std::unique_ptr<Link> link = open(settings.device.path);
  descriptor_ = link->report_descriptor;
  kind_ = link->map.kind();
  lets_go_ = link->output.lets_go();
  free_button_ = link->map.free_button(settings.clutch);
  limits_ = limits_in_patient_frame(link->output.limits(), settings.workspace.scale);
  follower_ = std::make_unique<HandFollower>(FollowSettings{.kind = kind_,
                                                            .workspace = settings.workspace,
                                                            .rate = settings.rate,
                                                            .pen = settings.pen,
                                                            .clutch = settings.clutch,
                                                            .stale_s = stale_s(link->output)});
  reader_ = std::jthread(
      [this, link = std::move(link)](const std::stop_token& stop) mutable { run(stop, std::move(link)); });
}

HidStylus::~HidStylus() = default;

StylusSample HidStylus::read(double now_s) {
  poses_.update();
  StylusSample sample = follower_->follow(poses_.get(), clock_.now_ns());
  sample.time_s = now_s;
  waits_for_rest_.store(follower_->waits_for_rest(), std::memory_order_relaxed);
  answered_ns_ = sample.valid ? poses_.get().made_ns : 0;
  return sample;
}

void HidStylus::write(const Eigen::Vector3d& force, const Eigen::Vector3d& torque) {
  forces_.put({.force = follower_->map().to_device(force),
               .torque = follower_->map().to_device(torque),
               .made_ns = answered_ns_,
               .number = ++orders_});
}

std::optional<Eigen::Vector3d> HidStylus::told_force() {
  told_.update();
  if (!told_.get()) return {};
  return settings_.workspace.patient_from_device * *told_.get();
}

DeviceStatus HidStylus::status() const {
  const std::scoped_lock lock(saying_);
  return {.connected = connected(), .waits_for_rest = waits_for_rest(), .needs = needs_};
}

void HidStylus::say(std::string needs) {
  const std::unique_lock lock(saying_, std::try_to_lock);  // whoever reads it may not hold up the poses
  if (lock) needs_ = std::move(needs);
}

void HidStylus::run(const std::stop_token& stop, std::unique_ptr<Link> link) {
  double patience_s = settings_.retry_s;
  while (true) {
    if (link) {
      run_under_fifo(settings_.fifo_priority);
      connected_.store(true, std::memory_order_release);
      counters_.connections.fetch_add(1, std::memory_order_relaxed);
      serve(*link, stop);
      link.reset();
      connected_.store(false, std::memory_order_release);
      say({});
      poses_.put({.gaps = ++gaps_});
      run_under_fifo(0);  // looking for it takes milliseconds, which the haptic thread is not to wait for
    }
    if (stop.stop_requested()) return;
    std::unique_lock lock(waiting_);
    stopped_.wait_for(lock, stop, std::chrono::duration<double>(patience_s), [] { return false; });
    if (stop.stop_requested()) return;
    link = look_for_device();
    patience_s = link ? settings_.retry_s : std::min(2 * patience_s, kMostRetries * settings_.retry_s);
  }
}

/// Until it is pulled out or the stop is asked for.
void HidStylus::serve(Link& link, const std::stop_token& stop) {
  std::unique_ptr<ForceWriter> writer;
  if (link.output.way() != ForceOutput::Way::kNone) {
    writer = std::make_unique<ForceWriter>(*link.transport, link.output, forces_, counters_.force,
                                           settings_.fifo_priority);
  }
  PoseStream stream(link.map, counters_.stream, stale_s(link.output), gaps_);
  std::array<std::uint8_t, kReadBuffer> report;
  std::int64_t asked_ns = 0;
  while (!stop.stop_requested()) {
    if (const std::int64_t now_ns = clock_.now_ns(); now_ns - asked_ns > kAskAgain) {
      asked_ns = now_ns;
      say(link.transport->needs());
    }
    int size = link.transport->read(report, kReadTimeout);
    std::int64_t looked_ns = clock_.now_ns();
    if (size == 0) size = link.transport->read(report, 0);  // the wait itself does not tell when it was empty
    for (int k = 0; size > 0 && k < kMostQueued; ++k) {
      const auto bytes = std::span(report).first(size);
      stream.add(bytes, looked_ns);
      if (settings_.log != nullptr) settings_.log->add(looked_ns, bytes);
      looked_ns = clock_.now_ns();
      size = link.transport->read(report, 0);
    }
    if (size < 0) return;
    if (size > 0 || !stream.end(looked_ns)) continue;  // one that floods has no end
    poses_.put(stream.latest());
    if (const auto told = link.transport->told_force())
      told_.put(settings_.profile.force_sign * (settings_.profile.device_from_report * *told));
    gaps_ = stream.latest().gaps;
  }
}

std::unique_ptr<HidStylus::Link> HidStylus::look_for_device() const {
  const HidDeviceSummary& lost = settings_.device;
  std::vector<HidDeviceSummary> devices;
  try {
    devices = settings_.source->list();
  } catch (const std::exception&) {
    return nullptr;  // no memory, no descriptor: the next look may have them
  }
  for (const HidDeviceSummary& device : devices) {
    if (device.vendor_id != lost.vendor_id || device.product_id != lost.product_id ||
        device.serial_number != lost.serial_number) {
      continue;
    }
    try {
      std::unique_ptr<Link> link = open(device.path);
      if (link->map.kind() == kind_) return link;
    } catch (const std::exception&) {
      // Its node is there before udev has given the permission for it: the next look will tell.
    }
  }
  return nullptr;
}

std::string HidStylus::statistics() const {
  const StreamCounters& stream = counters_.stream;
  const ForceCounters& force = counters_.force;
  return fmt::format(
      "{}: {} reports, {} missing, {} discarded, {} gaps; {} forces written, {} superseded, {} failed; pose to force "
      "{:.0f} us median, {:.0f} us p99",
      name_, stream.reports.load(), stream.missing.load(), stream.discarded.load(), stream.gaps.load(),
      force.written.load(), force.superseded.load(), force.failed.load(), 1e6 * force.pose_to_force.quantile(0.5),
      1e6 * force.pose_to_force.quantile(0.99));
}

}  // namespace stylet::haptic::hid
