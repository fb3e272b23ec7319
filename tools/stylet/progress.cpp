#include "tools/stylet/progress.h"

#include <unistd.h>

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

namespace stylet::tools {

namespace {
constexpr double kWorthALine = 0.5;  // s
}

Progress::Progress(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0) {}

void Progress::show(const std::string& task, double share) {
  if (quiet_) return;
  const Clock::time_point now = Clock::now();
  if (task != task_) {
    done();
    task_ = task;
    started_ = now;
  } else if (now - drawn_ < std::chrono::milliseconds(100)) {
    return;
  }
  drawn_ = now;
  if (!terminal_) return;
  const int filled = static_cast<int>(std::clamp(share, 0.0, 1.0) * 30);
  fmt::print(stderr, "\r{:<34} [{:<30}] {:3.0f} %", task_, std::string(static_cast<std::size_t>(filled), '='),
             std::clamp(share, 0.0, 1.0) * 100);
  std::fflush(stderr);
}

void Progress::done() {
  if (quiet_ || task_.empty()) return;
  const double seconds = std::chrono::duration<double>(Clock::now() - started_).count();
  if (terminal_) {
    fmt::print(stderr, "\r{:<34} {:5.1f} s{:>35}\n", task_, seconds, "");
  } else if (seconds >= kWorthALine) {
    fmt::print(stderr, "{:<34} {:5.1f} s\n", task_, seconds);
  }
  task_.clear();
}

}  // namespace stylet::tools
