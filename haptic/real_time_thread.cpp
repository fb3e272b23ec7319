#include "haptic/real_time_thread.h"

#include "haptic/denormals.h"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <future>
#include <stdexcept>
#include <utility>

namespace stylet::haptic {
namespace {

/// Touches the stack that the steps will use, so that no page fault happens in them.
void touch_stack() {
  constexpr std::size_t bytes = 256 * 1024;
  unsigned char pages[bytes];
  for (std::size_t i = 0; i < bytes; i += 4096) {
    *const_cast<volatile unsigned char*>(&pages[i]) = 1;
  }
}

void append(std::string& text, const std::string& more) {
  text += (text.empty() ? "" : "; ") + more;
}

/// Configures the calling thread. @return what was refused, one line, empty when nothing
std::string configure_thread(const RealTimeSettings& settings) {
  std::string warning;
  if (settings.fifo_priority > 0) {
    const sched_param priority{.sched_priority = settings.fifo_priority};
    if (const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority); error != 0) {
      append(warning, std::string("no SCHED_FIFO (") + std::strerror(error) +
                          "): steps may start late; allow it with 'ulimit -r 90' or CAP_SYS_NICE");
    }
  }
  if (settings.lock_memory && mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) != 0) {
    append(warning, std::string("memory not locked (") + std::strerror(errno) +
                        "): a step may wait for a page; allow it with 'ulimit -l unlimited'");
  }
  if (settings.cpu >= 0) {
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    CPU_SET(static_cast<unsigned>(settings.cpu), &cpus);
    if (const int error = pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus); error != 0) {
      append(warning, "not bound to processor " + std::to_string(settings.cpu) + " (" + std::strerror(error) + ")");
    }
  }
  // Under the ordinary scheduler the kernel may delay a wake-up by 50 us to save power; ask for 1 ns instead.
  prctl(PR_SET_TIMERSLACK, 1UL);
  touch_stack();
  return warning;
}

}  // namespace

RealTimeThread::RealTimeThread(const RealTimeSettings& settings, std::function<void(const StepTiming&)> step) {
  if (!(settings.rate_hz >= 1 && settings.rate_hz <= 20000)) {
    throw std::invalid_argument("rate of a real-time thread: " + std::to_string(settings.rate_hz) +
                                " Hz is outside 1 to 20000");
  }
  const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 / settings.rate_hz));
  std::promise<std::string> configured;
  std::future<std::string> refused = configured.get_future();
  thread_ = std::jthread([this, settings, period_ns, step = std::move(step),
                          configured = std::move(configured)](const std::stop_token& stop) mutable {
    const FlushDenormals flush;
    configured.set_value(configure_thread(settings));
    MonotonicClock clock;
    run_paced(clock, period_ns, step, stop, statistics_, settings.most_behind);
  });
  warning_ = refused.get();
}

RealTimeThread::~RealTimeThread() {
  stop();
}

void RealTimeThread::stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

}  // namespace stylet::haptic
