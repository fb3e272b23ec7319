// What a command says on the terminal, and Ctrl-C as the wish that its work ends.
#pragma once

#include "engine/app/run_session.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <string>
#include <utility>

namespace stylet::tools {

/// As fmt::print, but nothing is thrown where the terminal has been closed: the work goes on to its end.
template <typename... Args>
void say(std::FILE* to, fmt::format_string<Args...> format, Args&&... args) {
  std::fputs(fmt::format(format, std::forward<Args>(args)...).c_str(), to);
}

/// Progress is one line of stderr that is rewritten on a terminal; elsewhere (a log) a line at the end of each task
/// that took its time. Notes: what was asked for on stdout, everything else on stderr.
class Terminal final : public app::SessionObserver {
public:
  Terminal();
  ~Terminal() override { task_done(); }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  void progress(const std::string& task, double share) override;
  void task_done() override;
  void note(app::Note kind, const std::string& text) override;
  bool stop_requested() override;
  void stop_answered() override;
  /// The numbers of a session.
  void measured(const app::SessionResult& result) override;
  void left(const app::SessionResult& result) override;

private:
  using Clock = std::chrono::steady_clock;
  bool is_terminal_;
  std::string task_;
  std::string shown_;  // of the task, fit for a terminal
  Clock::time_point started_;
  Clock::time_point drawn_;
};

}  // namespace stylet::tools
