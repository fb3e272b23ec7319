// mock_stylus [--rate HZ] COMMAND...: runs a command that finds a force stylus plugged in, and says what it did.
#include "tests/support/hid/mock_hid_node.h"
#include "tests/support/hid/preload.h"
#include "tests/support/hid/stylus_firmware.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string_view>

namespace {

using namespace stylet::support;

/// The hand goes down 50 mm and up again every 8 s, along the axes of the reports.
stylet::haptic::hid::ForceStylusPose up_and_down(double time_s) {
  stylet::haptic::hid::ForceStylusPose pose;
  pose.position.z() = 0.025 * (1 - std::cos(2 * std::numbers::pi * time_s / 8));
  return pose;
}

int run(char** command) {
  const pid_t child = fork();
  if (child < 0) return 1;
  if (child == 0) {
    preload_mock();
    execvp(command[0], command);
    std::perror(command[0]);
    _exit(127);
  }
  std::signal(SIGINT, SIG_IGN);  // it is the command's to answer
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

int main(int argc, char** argv) {
  char** command = argv + 1;
  double rate_hz = 1000;
  if (argc > 2 && std::string_view(argv[1]) == "--rate") rate_hz = std::atof(argv[2]), command += 2;
  if (*command == nullptr || !(rate_hz >= 1 && rate_hz <= 8000)) {
    std::fputs("usage: mock_stylus [--rate HZ] COMMAND...   (1 to 8000 Hz)\n", stderr);
    return 2;
  }
  MockHidBus bus;
  StylusFirmware firmware(up_and_down);
  MockHidNode node(bus, firmware, {.rate_hz = rate_hz, .fifo_priority = 85});
  const int status = run(command);
  const std::uint64_t sent = node.sent();
  const std::uint64_t dropped = node.dropped();
  node.with_device([&] {
    double peak = 0;
    for (const FirmwareEvent& event : firmware.events()) peak = std::max(peak, event.force.norm());
    fmt::print(
        "mock_stylus: {} reports made, {} sent, {} dropped; {} forces received, peak {:.3f} N; enabled {} times, "
        "disabled {}, timed out {}; force now {:.3f} N\n",
        firmware.reports(), sent, dropped, firmware.count(FirmwareEvent::kForce), peak,
        firmware.count(FirmwareEvent::kEnabled), firmware.count(FirmwareEvent::kDisabled),
        firmware.count(FirmwareEvent::kTimeOut), firmware.applied_force().norm());
  });
  return status;
}
