// Runs a command that finds a device plugged in, and says what it did: see kUsage.
#include "tests/support/hid/mock_hid_node.h"
#include "tests/support/hid/pid_stick.h"
#include "tests/support/hid/preload.h"
#include "tests/support/hid/stylus_firmware.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string_view>

namespace {

using namespace stylet::support;
using Eigen::Vector3d;

constexpr const char* kUsage =
    "usage: mock_stylus [OPTION...] COMMAND...\n"
    "  --rate HZ     of the pose reports, 1 to 8000; default 1000\n"
    "  --corners     the hand waits at its rest place until somebody opens the device, and then goes to the corners\n"
    "                that `stylet devices --calibrate` asks for; else it goes down 50 mm and up again\n"
    "  --refuse      nobody may open the device\n"
    "  --vendor      a device of the vendor's own reports instead of a stylus\n"
    "  --stick       a joystick with PID constant forces instead\n"
    "  --endless     the same, and its effects have no end\n";

struct Options {
  double rate_hz = 1000;
  bool corners = false;
  bool refuse = false;
  bool vendor = false;
  bool stick = false;
  bool endless = false;
};

/// Every 8 s, along the axes of the reports.
stylet::haptic::hid::ForceStylusPose up_and_down(double time_s) {
  stylet::haptic::hid::ForceStylusPose pose;
  pose.position.z() = 0.025 * (1 - std::cos(2 * std::numbers::pi * time_s / 8));
  return pose;
}

/// 100 mm wide and 80 mm deep, for a device that stands turned by 30 degrees on its desk. A place takes 0.8 s.
stylet::haptic::hid::ForceStylusPose to_the_corners(double time_s) {
  constexpr double kPlace = 0.8, kWay = 0.2;  // s
  constexpr double kTurn = std::numbers::pi / 6;
  // Right, near and down from the rest place; the last one lasts.
  static const std::array<Vector3d, 5> kPlaces{Vector3d(0, 0, -0.04), Vector3d(-0.05, 0.04, 0),
                                               Vector3d(0.05, 0.04, 0), Vector3d(0.05, -0.04, 0),
                                               Vector3d(-0.05, -0.04, 0)};
  const auto at = std::min(kPlaces.size() - 1, static_cast<std::size_t>(time_s / kPlace));
  const double since = time_s - static_cast<double>(at) * kPlace;
  const Vector3d from = kPlaces[at == 0 ? 0 : at - 1];
  const Vector3d place = from + std::min(1.0, since / kWay) * (kPlaces[at] - from);
  stylet::haptic::hid::ForceStylusPose pose;
  pose.position = {std::cos(kTurn) * place.x() + std::sin(kTurn) * place.y(),
                   -std::sin(kTurn) * place.x() + std::cos(kTurn) * place.y(), place.z()};
  pose.rotation_vector = {0.1 * std::min(time_s, 4.0), 0, 0};
  return pose;
}

/// Bytes without a meaning.
class VendorFirmware final : public MockFirmware {
public:
  std::vector<std::uint8_t> descriptor() const override {
    return {0x06, 0x00, 0xFF, 0x09, 0x01, 0xA1, 0x01, 0x09, 0x01, 0x75, 0x08, 0x95, 0x08, 0x81, 0x02, 0xC0};
  }
  std::size_t input(std::int64_t, std::span<std::uint8_t>) override { return 8; }
};

int run(char** command) {
  const pid_t child = fork();
  if (child < 0) return 1;
  if (child == 0) {
    preload_mock();
    execvp(command[0], command);
    std::perror(command[0]);
    _exit(127);
  }
  for (const int signal : {SIGINT, SIGHUP}) std::signal(signal, SIG_IGN);  // they are the command's to answer
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/// @return what is left of the arguments, the command; null: they are wrong
char** parse(char** arguments, Options& options) {
  for (; *arguments != nullptr && std::string_view(*arguments).starts_with("--"); ++arguments) {
    const std::string_view name = *arguments;
    if (name == "--corners") {
      options.corners = true;
    } else if (name == "--refuse") {
      options.refuse = true;
    } else if (name == "--vendor") {
      options.vendor = true;
    } else if (name == "--stick" || name == "--endless") {
      options.stick = true;
      options.endless = name == "--endless";
    } else if (name == "--rate" && arguments[1] != nullptr) {
      options.rate_hz = std::atof(*++arguments);
    } else {
      return nullptr;
    }
  }
  return *arguments != nullptr && options.rate_hz >= 1 && options.rate_hz <= 8000 ? arguments : nullptr;
}

}  // namespace

int main(int, char** argv) {
  Options options;
  char** command = parse(argv + 1, options);
  if (command == nullptr) {
    std::fputs(kUsage, stderr);
    return 2;
  }
  MockHidBus bus;
  VendorFirmware vendor;
  std::atomic<bool> opened{false};
  StylusFirmware firmware([&, begin_s = 0.0](double time_s) mutable {
    if (!options.corners) return up_and_down(time_s);
    if (!opened) begin_s = time_s;
    return to_the_corners(time_s - begin_s);
  });
  PidStick stick(options.endless);
  MockFirmware& device = options.vendor  ? static_cast<MockFirmware&>(vendor)
                         : options.stick ? static_cast<MockFirmware&>(stick)
                                         : firmware;
  MockHidNode node(bus, device, {.rate_hz = options.rate_hz, .fifo_priority = 85});
  if (options.refuse) node.refuse_open(EACCES);
  const std::jthread watch([&](const std::stop_token& stop) {
    while (!stop.stop_requested() && node.open_files() == 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    opened = true;
  });
  const int status = run(command);
  const std::uint64_t sent = node.sent();
  const std::uint64_t dropped = node.dropped();
  if (options.stick) {
    node.with_device([&] {
      fmt::print("mock_stylus: effects started {} times, ran out {} times; motors {}; force now {:.3f}\n",
                 stick.starts(), stick.times_run_out(), stick.enabled() ? "on" : "off",
                 std::hypot(stick.applied(0), stick.applied(1)));
    });
    return status;
  }
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
