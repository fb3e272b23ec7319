#include "tools/stylet/interrupt.h"

#include "engine/app/observer.h"

#include <array>
#include <atomic>
#include <csignal>

namespace stylet::tools {

namespace {

constexpr int kPatience = 2;  // signals taken before one kills
/// Ctrl-C, a polite kill, a terminal that was closed.
constexpr std::array kDeadly{SIGINT, SIGTERM, SIGHUP};
std::atomic<int> received{0};
std::atomic<bool> pending{false};
std::atomic_flag file_limit_met{};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

void remember(int signal) {
  pending = true;
  if (signal == SIGHUP) std::signal(SIGPIPE, SIG_IGN);  // nobody reads what it still says
  if (++received >= kPatience) std::signal(signal, SIG_DFL);
}

/// Each write beyond the limit raises one more, and fails: who writes hears of it, and none of them kills.
void remember_once(int /*signal*/) {
  if (!file_limit_met.test_and_set()) pending = true;
}

}  // namespace

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = remember;
  action.sa_flags = SA_RESTART;
  for (const int signal : kDeadly) {
    struct sigaction before {};
    sigaction(signal, nullptr, &before);
    // nohup: the terminal may be closed
    if (signal != SIGHUP || before.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);
  }
  action.sa_handler = remember_once;
  sigaction(SIGXFSZ, &action, nullptr);
}

void let_interrupts_kill() {
  for (const int signal : kDeadly) {
    struct sigaction now {};
    sigaction(signal, nullptr, &now);
    if (now.sa_handler == remember) std::signal(signal, SIG_DFL);
  }
  if (interrupted()) throw app::Stopped();
}

bool interrupted() {
  return pending;
}

void clear_interrupt() {
  pending = false;
}

}  // namespace stylet::tools
