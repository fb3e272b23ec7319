// The service on a socket of its own, with what a network does to it.
#pragma once

#include "tests/support/haply/haply_service.h"

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace stylet::support {

/// One client at a time; a thread of its own.
class HaplyServer {
public:
  /// What becomes of the next message.
  enum class Trouble {
    kNone,
    kStall,    ///< no answer until it is over
    kReset,    ///< the connection is cut
    kClose,    ///< a close frame
    kGarbage,  ///< no JSON
    kBinary,
    kHuge,  ///< 1 MiB
    kBadUtf8,
    kTwice,        ///< two answers
    kMany,         ///< twenty
    kFragments,    ///< the answer in several frames
    kPings,        ///< many pings before the answer
    kNoInventory,  ///< of the next connection: it waits to be asked
    kRefuse,       ///< of the next connection: 503
  };

  HaplyServer();
  ~HaplyServer();

  std::string port() const { return port_; }
  /// The service, while nothing else touches it.
  template <typename Work>
  auto with_service(const Work& work) {
    const std::scoped_lock lock(mutex_);
    return work(service_);
  }
  void set(Trouble trouble) { trouble_ = trouble; }
  Trouble trouble() const { return trouble_; }
  int connections() const { return connections_; }
  static std::int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

private:
  struct Io;
  struct Client;
  void run();
  void serve(Client& client);

  std::mutex mutex_;
  HaplyService service_;
  std::atomic<Trouble> trouble_{Trouble::kNone};
  std::atomic<int> connections_{0};
  std::atomic<bool> stop_{false};
  std::string port_;
  std::unique_ptr<Io> io_;
  std::thread thread_;
};

}  // namespace stylet::support
