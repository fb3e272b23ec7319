// The devices of the Haply Inverse Service as styluses that send reports.
#pragma once

#include "haptic/haply/haply_client.h"
#include "haptic/haply/haply_socket.h"
#include "haptic/hid/report_transport.h"

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace stylet::haptic::haply {

/// One connection. A thread of its own sends a message a millisecond and reads the answers; it drops the force 20 ms
/// after the last report 2, whoever was to send it. The thread is an ordinary one until somebody enables the motors.
class HaplyTransport final : public hid::ReportTransport {
public:
  /// @throws hid::HidError
  HaplyTransport(const Endpoint& endpoint, const Pair& pair);
  /// Zero force, answered if the service answers, and good-bye.
  ~HaplyTransport() override;
  HaplyTransport(const HaplyTransport&) = delete;
  HaplyTransport& operator=(const HaplyTransport&) = delete;

  int read(std::span<std::uint8_t> bytes, int timeout_ms) override;
  bool write(std::span<const std::uint8_t> bytes) override;
  bool set_feature(std::span<const std::uint8_t> bytes) override;
  int get_feature(std::span<std::uint8_t> bytes) override;
  std::string needs() const override;
  std::optional<Eigen::Vector3d> told_force() const override;

  /// Why it was given up; empty: it was not.
  std::string failed() const;

private:
  void run(const std::stop_token& stop);
  void take(std::string_view text);
  void say_good_bye();

  HaplySocket socket_;  // its thread's
  mutable std::mutex mutex_;
  std::condition_variable came_;
  HaplyClient client_;
  std::deque<HaplyClient::Report> reports_;
  bool gone_ = false;
  std::jthread thread_;
};

/// All pairs of an arm and a grip that the service knows. Paths: haply:ARM/GRIP, or haply:ARM where there is no grip.
class HaplySource final : public hid::DeviceSource {
public:
  explicit HaplySource(Endpoint endpoint) : endpoint_(std::move(endpoint)) {}

  /// Nothing where there is no service.
  std::vector<hid::HidDeviceSummary> list() const override;
  std::string missing() const override;
  std::string complaint() const override;
  std::vector<std::uint8_t> descriptor(const std::string& path) const override;
  std::unique_ptr<hid::ReportTransport> open(const std::string& path) const override;

private:
  std::string knows_none() const;

  Endpoint endpoint_;
};

/// STYLET_HAPLY=HOST:PORT, else where the service listens by its documentation.
const HaplySource& haply_source();

}  // namespace stylet::haptic::haply
