// The thread that writes forces: hid_write waits for the bus, and nothing else shall.
#pragma once

#include "haptic/hid/force_output.h"
#include "haptic/hid/hid_transport.h"
#include "haptic/hid/newest_value.h"
#include "haptic/latency_histogram.h"

#include <semaphore.h>

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
  ForceSlot();
  ~ForceSlot();
  ForceSlot(const ForceSlot&) = delete;
  ForceSlot& operator=(const ForceSlot&) = delete;

  /// Haptic thread. @realtime one atomic exchange, and a wake-up where the writer sleeps
  void put(const ForceOrder& order);
  /// Writer: waits for a newer one. @return false: none within the time
  bool wait(double seconds, ForceOrder& order);

private:
  NewestValue<ForceOrder> orders_;
  sem_t posted_{};
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
/// kSilence the force is zero: the loop that should give them is gone.
class ForceWriter {
public:
  static constexpr double kSilence = 0.020;  ///< s

  /// @param transport, output, slot, counters  outlive it; nobody else writes to the transport
  ForceWriter(HidTransport& transport, ForceOutput& output, ForceSlot& slot, ForceCounters& counters,
              int fifo_priority);
  ~ForceWriter();
  ForceWriter(const ForceWriter&) = delete;
  ForceWriter& operator=(const ForceWriter&) = delete;

private:
  void run(const std::stop_token& stop, int fifo_priority);
  bool write(const Eigen::Vector3d& force, const Eigen::Vector3d& torque);
  bool write(DeviceControl control);

  HidTransport& transport_;
  ForceOutput& output_;
  ForceSlot& slot_;
  ForceCounters& counters_;
  std::vector<std::uint8_t> report_;
  std::jthread thread_;
};

/// Puts the calling thread under SCHED_FIFO, at 0 back among the ordinary ones; where that is not allowed it stays as
/// it is.
void run_under_fifo(int priority);

}  // namespace stylet::haptic::hid
