// Progress of long work on the terminal.
#pragma once

#include <chrono>
#include <string>

namespace stylet::tools {

/// One line that is rewritten on a terminal; elsewhere (a log) a line at the end of each task that took its time.
class Progress {
public:
  explicit Progress(bool quiet = false);
  ~Progress() { done(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// @param task   what is being done; a new text starts a new line
  /// @param share  done so far, [0, 1]
  void show(const std::string& task, double share);
  /// Ends the line of the task in progress, with the time it took.
  void done();

private:
  using Clock = std::chrono::steady_clock;
  bool quiet_;
  bool terminal_;
  std::string task_;
  Clock::time_point started_;
  Clock::time_point drawn_;
};

}  // namespace stylet::tools
