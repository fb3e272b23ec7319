// Another program, run as a child of this process.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace stylet::files {

/// What a child may use that is trusted with nothing.
struct ChildLimits {
  std::size_t memory_bytes = 0;  ///< not where sanitizers map terabytes
  int cpu_seconds = 0;
};

struct ChildSettings {
  std::vector<std::string> command{};  ///< the program, looked for in PATH unless it has a slash, and its arguments
  // File descriptors that become its standard streams; -1: it reads nothing, what it writes is lost.
  int input = -1;
  int output = -1;
  int messages = -1;
  std::optional<ChildLimits>
      limits{};  ///< with limits no environment, no file written, no core; messages -1 is closed
};

/// A child inherits its standard streams and no other open file.
class ChildProcess {
public:
  /// @throws std::system_error  why it cannot be started
  explicit ChildProcess(const ChildSettings& settings);
  /// Ends it where it still runs.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Waits for its end. Both: @return its exit status, 128 + signal where one ended it
  int wait();
  /// The same without waiting; nothing: it still runs.
  std::optional<int> ended();
  /// Ends it now, and waits for that.
  void kill();

private:
  pid_t id_ = -1;
  int status_ = 0;  // when id_ is -1
};

}  // namespace stylet::files
