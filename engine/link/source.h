// The connection to a server that transforms come from: it may start later than Stylet, go, and come back.
#pragma once

#include "engine/link/connection.h"
#include "engine/link/tcp.h"

#include <optional>
#include <string>

namespace stylet::link {

class Source {
public:
  /// @throws LinkError  there is no such host
  explicit Source(const Endpoint& endpoint);

  /// Begins to connect where the time for it has come, gives up an attempt that takes too long.
  void attend(Clock::time_point now);
  /// What poll(2) said of descriptor(): connected at last, or bytes are there.
  void serve(std::vector<ReceivedTransform>& transforms, Clock::time_point now);
  /// Takes leave of a connection that has ended. @return its line for the report; empty: it left in order
  std::string take_leave(Clock::time_point now);

  /// -1: none now.
  int descriptor() const;
  bool is_connecting() const { return connecting_.is_open(); }
  std::optional<Connection>& connection() { return connection_; }
  std::uint64_t connections() const { return connections_; }

  static constexpr Clock::duration kFirstRetry = std::chrono::milliseconds(250);
  static constexpr Clock::duration kLastRetry = std::chrono::seconds(4);
  static constexpr Clock::duration kConnectTimeout = std::chrono::seconds(4);

private:
  void retry_later(Clock::time_point now);

  std::string name_;
  Remote remote_;
  Socket connecting_;
  std::optional<Connection> connection_;
  Clock::time_point next_try_{};
  Clock::time_point began_{};
  Clock::duration wait_ = kFirstRetry;  ///< doubled after every failure
  std::uint64_t connections_ = 0;
};

}  // namespace stylet::link
