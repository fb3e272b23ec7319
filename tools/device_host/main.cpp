// The device host: a process of its own for a library that is its maker's, so that what that does, or what becomes of
// Stylet, leaves no force.
//   stylet_device_host KIND [LIBRARY]   started by Stylet, with shared memory as descriptor 3 and a pipe as 4
#include "haptic/host/channel.h"
#include "haptic/host/driver.h"
#include "haptic/host/host_loop.h"

#include <poll.h>
#include <sched.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <memory>
#include <string>
#include <thread>

namespace {

using namespace stylet::haptic::host;

constexpr int kChannel = 3, kLife = 4;
constexpr std::int64_t kPeriod = 1'000'000;  // ns
constexpr int kNeedsEvery = 50;              // turns
constexpr int kPatience = 500;               // turns, for the first pose
constexpr int kFifoPriority = 82;

volatile std::sig_atomic_t asked_to_end = 0;

std::int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1'000'000'000LL + now.tv_nsec;
}

/// The pipe ends with the process that holds its other end, whatever ends that.
bool orphaned() {
  pollfd life{.fd = kLife, .events = POLLIN, .revents = 0};
  return poll(&life, 1, 0) != 0;
}

void say(Channel& channel, HostState state, const std::string& message) {
  put_text(channel.message, message);
  channel.state.store(state, std::memory_order_release);
}

/// A library that hangs cannot be asked to end.
void end_if_orphaned() {
  for (int seen = 0; seen < 2;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    seen = orphaned() ? seen + 1 : 0;
  }
  std::_Exit(3);
}

void serve(Driver& driver, Channel& channel) {
  const sched_param priority{.sched_priority = kFifoPriority};
  sched_setscheduler(0, SCHED_FIFO, &priority);  // where it may
  mlockall(MCL_CURRENT | MCL_FUTURE);            // where it may
  HostLoop loop(driver, channel);
  std::int64_t due_ns = now_ns();
  for (int turn = 0; asked_to_end == 0 && channel.quit.load(std::memory_order_acquire) == 0 && !orphaned(); ++turn) {
    if (!loop.turn()) {
      say(channel, HostState::kGone, "the device was pulled out");
      return;
    }
    const bool ready = channel.state.load(std::memory_order_relaxed) == HostState::kReady;
    if (!ready && (channel.poses.written() > 0 || turn == kPatience)) say(channel, HostState::kReady, driver.needs());
    if (turn % kNeedsEvery == kNeedsEvery - 1) put_text(channel.message, driver.needs());
    due_ns = std::max(due_ns + kPeriod, now_ns());
    for (std::int64_t now = now_ns(); now < due_ns; now = now_ns()) {
      channel.orders.wait(loop.obeyed(), due_ns - now);
      loop.obey();
    }
  }
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 2) {
    std::fprintf(stderr, "stylet_device_host: is started by stylet\n");
    return 2;
  }
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) std::signal(signal, [](int) { asked_to_end = 1; });
  close_range(kLife + 1, ~0U, 0);  // what Stylet has open is not the library's
  SharedChannel shared(kChannel);
  std::thread(end_if_orphaned).detach();
  const std::unique_ptr<Driver> driver = make_driver(argv[1], argc > 2 ? argv[2] : "");
  if (driver == nullptr) {
    say(*shared, HostState::kFailed, std::string("there is no kind ") + argv[1]);
    return 2;
  }
  try {
    const Driver::Device device = driver->open();
    put_text(shared->name, device.name);
    put_text(shared->serial, device.serial);
  } catch (const DriverError& error) {
    say(*shared, error.installed() ? HostState::kFailed : HostState::kNotInstalled, error.what());
    return 1;
  }
  serve(*driver, *shared);
  driver->close();
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "stylet_device_host: %s\n", error.what());
  return 2;
}
