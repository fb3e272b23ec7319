#include "tools/stylet/interrupt.h"

#include "engine/app/observer.h"

#include <atomic>
#include <csignal>

namespace stylet::tools {

namespace {

constexpr int kPatience = 2;  // signals taken before one kills
std::atomic<int> received{0};
std::atomic<bool> pending{false};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

void remember(int signal) {
  pending = true;
  if (++received >= kPatience) std::signal(signal, SIG_DFL);
}

}  // namespace

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = remember;
  action.sa_flags = SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM}) sigaction(signal, &action, nullptr);
}

void let_interrupts_kill() {
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_DFL);
  if (interrupted()) throw app::Stopped();
}

bool interrupted() {
  return pending;
}

void clear_interrupt() {
  pending = false;
}

}  // namespace stylet::tools
