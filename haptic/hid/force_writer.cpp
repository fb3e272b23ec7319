#include "haptic/hid/force_writer.h"

#include "haptic/paced_loop.h"

#include <pthread.h>
#include <sched.h>

#include <algorithm>

namespace stylet::haptic::hid {

void run_under_fifo(int priority) {
  const sched_param parameter{.sched_priority = std::max(priority, 0)};
  pthread_setschedparam(pthread_self(), priority > 0 ? SCHED_FIFO : SCHED_OTHER, &parameter);
}

bool ForceSlot::wait(double seconds, ForceOrder& order) {
  MonotonicClock clock;
  const std::int64_t until_ns = clock.now_ns() + static_cast<std::int64_t>(seconds * 1e9);
  const std::int64_t due_ns = taken_ns_ + period_ns_ / 8 * 7;
  while (!orders_.update()) {
    const std::int64_t now_ns = clock.now_ns();
    if (now_ns >= until_ns) return false;
    const std::int64_t look_ns = now_ns < due_ns ? due_ns : now_ns + (now_ns < due_ns + kLate ? kLook : kRareLook);
    clock.sleep_until_ns(std::min(look_ns, until_ns));
  }
  order = orders_.get();
  const std::int64_t now_ns = clock.now_ns();
  // One that came late is no new period.
  period_ns_ = std::clamp(now_ns - taken_ns_, kShortest, std::max(kShortest, period_ns_ / 16 * 17));
  taken_ns_ = now_ns;
  return true;
}

ForceWriter::ForceWriter(ReportTransport& transport, ForceOutput& output, ForceSlot& slot, ForceCounters& counters,
                         int fifo_priority)
    : transport_(transport),
      output_(output),
      slot_(slot),
      counters_(counters),
      report_(std::max<std::size_t>(output.max_report_bytes(), 64)),
      thread_([this, fifo_priority](const std::stop_token& stop) { run(stop, fifo_priority); }) {}

ForceWriter::~ForceWriter() = default;

bool ForceWriter::write(const Eigen::Vector3d& force, const Eigen::Vector3d& torque) {
  bool all = true;
  for (int k = 0; k < output_.report_count(); ++k) {
    const std::size_t size = output_.encode(k, force, torque, report_);
    all = size != 0 && transport_.write(std::span(report_).first(size)) && all;
  }
  if (output_.renewal_count() == 0) return all;
  const std::int64_t now_ns = MonotonicClock().now_ns();
  if (static_cast<double>(now_ns - renewed_ns_) * 1e-9 < output_.renew_s()) return all;
  renewed_ns_ = now_ns;
  for (int k = 0; k < output_.renewal_count(); ++k) all = transport_.write(output_.renewal(k)) && all;
  return all;
}

bool ForceWriter::write(DeviceControl control) {
  const std::size_t size = output_.encode(control, report_);
  return size == 0 || transport_.write(std::span(report_).first(size));
}

void ForceWriter::run(const std::stop_token& stop, int fifo_priority) {
  run_under_fifo(fifo_priority);
  MonotonicClock clock;
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  const auto count = [this](bool done) {
    if (!done) counters_.failed.fetch_add(1, std::memory_order_relaxed);
  };
  const std::string refused =
      output_.start({.write = [this](auto bytes) { return transport_.write(bytes); },
                     .set_feature = [this](auto bytes) { return transport_.set_feature(bytes); },
                     .get_feature = [this](auto bytes) { return transport_.get_feature(bytes); }});
  count(refused.empty());
  if (!refused.empty() && output_.way() == ForceOutput::Way::kConstantForce) return;  // it may be one without an end
  count(write(none, none));  // before the motors are on, what they will give
  bool enabled = write(DeviceControl::kEnableActuators);
  count(enabled);
  ForceOrder order;
  slot_.wait(0, order);  // one from before belongs to a session that was interrupted
  std::uint64_t last = order.number;
  bool resting = true;
  while (!stop.stop_requested()) {
    if (!slot_.wait(kSilence, order)) {
      if (!resting) {
        count(write(none, none));
        counters_.silences.fetch_add(1, std::memory_order_relaxed);
      }
      resting = true;
      continue;
    }
    resting = false;
    const std::int64_t begin_ns = clock.now_ns();
    const bool done = write(order.force, order.torque);
    if (done && !enabled) enabled = write(DeviceControl::kEnableActuators);
    const std::int64_t end_ns = clock.now_ns();
    count(done);
    counters_.superseded.fetch_add(order.number - last - 1, std::memory_order_relaxed);
    last = order.number;
    if (!done) continue;
    counters_.written.fetch_add(1, std::memory_order_relaxed);
    counters_.write_time.add(end_ns - begin_ns);
    if (order.made_ns != 0) counters_.pose_to_force.add(end_ns - order.made_ns);
  }
  count(write(none, none));
  count(write(DeviceControl::kDisableActuators));
}

}  // namespace stylet::haptic::hid
