#include "haptic/hid/force_writer.h"

#include "haptic/paced_loop.h"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <cerrno>
#include <ctime>

namespace stylet::haptic::hid {
namespace {

timespec deadline(double seconds) {
  const std::int64_t ns = MonotonicClock().now_ns() + static_cast<std::int64_t>(seconds * 1e9);
  return {.tv_sec = ns / 1'000'000'000, .tv_nsec = ns % 1'000'000'000};
}

}  // namespace

void run_under_fifo(int priority) {
  const sched_param parameter{.sched_priority = std::max(priority, 0)};
  pthread_setschedparam(pthread_self(), priority > 0 ? SCHED_FIFO : SCHED_OTHER, &parameter);
}

ForceSlot::ForceSlot() {
  sem_init(&posted_, 0, 0);
}

ForceSlot::~ForceSlot() {
  sem_destroy(&posted_);
}

void ForceSlot::put(const ForceOrder& order) {
  orders_.put(order);
  sem_post(&posted_);
}

bool ForceSlot::wait(double seconds, ForceOrder& order) {
  const timespec until = deadline(seconds);
  while (!orders_.update()) {
    if (sem_clockwait(&posted_, CLOCK_MONOTONIC, &until) != 0 && errno == ETIMEDOUT) return false;
  }
  while (sem_trywait(&posted_) == 0) {  // one wake-up is enough for all that were put meanwhile
  }
  order = orders_.get();
  return true;
}

ForceWriter::ForceWriter(HidTransport& transport, ForceOutput& output, ForceSlot& slot, ForceCounters& counters,
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
  count(output_
            .start({.write = [this](auto bytes) { return transport_.write(bytes); },
                    .set_feature = [this](auto bytes) { return transport_.set_feature(bytes); },
                    .get_feature = [this](auto bytes) { return transport_.get_feature(bytes); }})
            .empty());
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
