#include "tools/stylet/terminal.h"

#include "engine/files/json_scan.h"
#include "tools/stylet/interrupt.h"

#include <unistd.h>

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

namespace stylet::tools {

namespace {
constexpr double kWorthALine = 0.5;  // s
}

Terminal::Terminal() : is_terminal_(isatty(STDERR_FILENO) != 0) {}

void Terminal::progress(const std::string& task, double share) {
  const Clock::time_point now = Clock::now();
  if (task != task_) {
    task_done();
    task_ = task;
    shown_ = files::one_line(task);
    started_ = now;
  } else if (now - drawn_ < std::chrono::milliseconds(100)) {
    return;
  }
  drawn_ = now;
  if (!is_terminal_) return;
  const int filled = static_cast<int>(std::clamp(share, 0.0, 1.0) * 30);
  say(stderr, "\r{:<34} [{:<30}] {:3.0f} %", shown_, std::string(static_cast<std::size_t>(filled), '='),
      std::clamp(share, 0.0, 1.0) * 100);
  std::fflush(stderr);
}

void Terminal::task_done() {
  if (task_.empty()) return;
  const double seconds = std::chrono::duration<double>(Clock::now() - started_).count();
  if (is_terminal_) {
    say(stderr, "\r{:<34} {:5.1f} s{:>35}\n", shown_, seconds, "");
  } else if (seconds >= kWorthALine) {
    say(stderr, "{:<34} {:5.1f} s\n", shown_, seconds);
  }
  task_.clear();
}

void Terminal::note(app::Note kind, const std::string& raw) {
  const std::string text = files::one_line(raw);          // names in it are of files of others
  if (is_terminal_ && !task_.empty()) say(stderr, "\n");  // the line of the task stays
  if (kind == app::Note::info) {
    say(stdout, "{}\n", text);
    std::fflush(stdout);
    return;
  }
  say(stderr, "stylet: {}{}\n", kind == app::Note::warning ? "warning: " : "", text);
}

bool Terminal::stop_requested() {
  return interrupted();
}

void Terminal::stop_answered() {
  clear_interrupt();
}

void Terminal::measured(const app::SessionResult& result) {
  say(stdout, "\n{}\n{}{}{}\n", result.title, session::main_figures(result.report), result.account,
      training::in_words(result.training));
  std::fflush(stdout);
}

void Terminal::left(const app::SessionResult& result) {
  say(stdout, "{} holds the session{}\n", result.folder.string(),
      result.page_written ? "; debrief.html tells how it went" : "");
  std::fflush(stdout);
}

}  // namespace stylet::tools
