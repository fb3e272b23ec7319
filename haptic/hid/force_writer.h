// The thread that writes forces: hid_write waits for the bus, and nothing else shall.
#pragma once

#include "haptic/hid/force_output.h"
#include "haptic/hid/newest_value.h"
#include "haptic/hid/report_transport.h"
#include "haptic/latency_histogram.h"

#include <atomic>
#include <string>
#include <thread>

namespace stylet::haptic::hid {

/// A force on its way, device frame.
struct ForceOrder {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< N
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  ///< N m
  std::int64_t made_ns = 0;                          ///< of the pose that it answers; 0: none
  std::uint64_t number = 0;                          ///< counts the orders
};

/// Where the haptic thread puts its newest force.
class ForceSlot {
public:
  /// Haptic thread. @realtime one atomic exchange: waking a thread would be a system call
  void put(const ForceOrder& order) { orders_.put(order); }
  /// Writer: sleeps until the next one is due by the time between the last ones, and then looks every kLook.
  /// @return false: none within the time
  bool wait(double seconds, ForceOrder& order);

private:
  // ns
  static constexpr std::int64_t kLook = 50'000;
  static constexpr std::int64_t kRareLook = 1'000'000;  // where the loop has stopped
  static constexpr std::int64_t kLate = 2'000'000;      // after which it has
  static constexpr std::int64_t kShortest = 100'000;    // between two orders

  NewestValue<ForceOrder> orders_;
  std::int64_t taken_ns_ = 0;   // writer's: when the last one was taken
  std::int64_t period_ns_ = 0;  // writer's: between two, the shortest of late
};

/// Any thread may read them.
struct ForceCounters {
  std::atomic<std::uint64_t> written{0};     ///< orders that went out
  std::atomic<std::uint64_t> superseded{0};  ///< orders that a newer one overtook
  std::atomic<std::uint64_t> failed{0};      ///< writes that the device refused
  std::atomic<std::uint64_t> silences{0};    ///< times that no order came and zero was written
  LatencyHistogram write_time;               ///< of the reports of one force
  LatencyHistogram pose_to_force;            ///< from when the device made the pose until its answer is written
};

/// From construction to destruction the motors are on; zero and off is the last that goes out. Without an order for
/// kSilence the force is zero: the loop that should give them is gone. Effects of a device without a time-out of its
/// own are started again while orders come, and run out when this process does not.
class ForceWriter {
public:
  static constexpr double kSilence = 0.020;  ///< s

  /// @param transport, output, slot, counters  outlive it; nobody else writes to the transport
  ForceWriter(ReportTransport& transport, ForceOutput& output, ForceSlot& slot, ForceCounters& counters,
              int fifo_priority);
  ~ForceWriter();
  ForceWriter(const ForceWriter&) = delete;
  ForceWriter& operator=(const ForceWriter&) = delete;

private:
  void run(const std::stop_token& stop, int fifo_priority);
  bool write(const Eigen::Vector3d& force, const Eigen::Vector3d& torque);
  bool write(DeviceControl control);

  ReportTransport& transport_;
  ForceOutput& output_;
  ForceSlot& slot_;
  ForceCounters& counters_;
  std::vector<std::uint8_t> report_;
  std::int64_t renewed_ns_ = 0;
  std::jthread thread_;
};

/// Puts the calling thread under SCHED_FIFO, at 0 back among the ordinary ones; where that is not allowed it stays as
/// it is.
void run_under_fifo(int priority);

}  // namespace stylet::haptic::hid
