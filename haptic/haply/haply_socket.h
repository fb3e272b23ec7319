// A WebSocket to the Haply Inverse Service.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace stylet::haptic::haply {

/// Where the service listens; its documentation has 127.0.0.1:10001.
struct Endpoint {
  std::string host = "127.0.0.1";
  std::string port = "10001";
};

/// Of one thread. Messages are text of at most 64 KiB; TCP_NODELAY, no compression, no time-out of its own.
class HaplySocket {
public:
  /// Connects and shakes hands. @throws hid::HidError  it cannot within the time
  HaplySocket(const Endpoint& endpoint, double seconds);
  /// As it is: without a word.
  ~HaplySocket();
  HaplySocket(const HaplySocket&) = delete;
  HaplySocket& operator=(const HaplySocket&) = delete;

  /// Goes out with the next run_until(), in order.
  void send(std::string text);
  /// Reads and writes until then, by the monotonic clock, or until `enough` after a message. What is no text comes as
  /// an empty message. @return false: it is closed
  bool run_until(std::int64_t until_ns, const std::function<void(std::string_view)>& on_message,
                 const std::function<bool()>& enough = {});
  /// Says that it closes; waits for the answer, at most so long.
  void close(double seconds);

private:
  struct Io;
  std::unique_ptr<Io> io_;
};

}  // namespace stylet::haptic::haply
