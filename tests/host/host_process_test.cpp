// The device host as the process that it is, and what becomes of the force when it, its library or Stylet stands
// still or dies. What is asserted happens, however long the machine takes.
#include "haptic/hid/hid_stylus.h"
#include "haptic/host/host_transport.h"
#include "tests/support/shell.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/vendor/mock_device.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <system_error>
#include <thread>

namespace stylet::haptic::host {
namespace {

using Eigen::Vector3d;
using support::MockDevice;
using ::testing::HasSubstr;
using ::testing::Not;

bool wait_until(const std::function<bool()>& done) {
  for (int k = 0; k < 60'000; ++k) {
    if (done()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

struct Mocked {
  const char* kind;
  const char* library;
  const char* path;
  const char* product;
  const char* home;  ///< what has to be done first
  std::atomic<double> MockDevice::*right;
  std::atomic<double> MockDevice::*force_up;
};

class HostProcess : public testing::TestWithParam<Mocked> {
protected:
  HostProcess() {
    setenv("STYLET_MOCK_DEVICE", (folder.path() / "device").c_str(), 1);
    mock = support::mock_device();
    mock->reset();
  }
  ~HostProcess() override {
    stylus.reset();
    munmap(mock, sizeof(MockDevice));
  }
  void open() {
    const auto devices = source.list();
    ASSERT_EQ(devices.size(), 1u) << source.missing();
    stylus = std::make_unique<hid::HidStylus>(
        hid::HidStylusSettings{.device = devices[0], .source = &source, .fifo_priority = 0, .retry_s = 0.02});
  }
  bool step_until(const std::function<bool()>& done) {
    return wait_until([&] {
      sample = stylus->read(0);
      stylus->write(sample.valid ? Vector3d(0, 1, 0) : Vector3d::Zero(), Vector3d::Zero());
      return done();
    });
  }
  bool pushes() const { return mock->applied() > 0.9; }
  /// Another process that pushes until it is stopped or killed.
  pid_t session() {
    const pid_t process = fork();
    if (process != 0) return process;
    open();
    if (stylus) step_until([] { return false; });
    _exit(0);
  }

  support::TemporaryFolder folder;
  MockDevice* mock = nullptr;
  Vendor vendor{.kind = GetParam().kind,
                .name = "its maker",
                .usb_id = 0x1451,
                .library = GetParam().library,
                .program = STYLET_DEVICE_HOST_PROGRAM};
  HostSource source{vendor};
  StylusSample sample;
  std::unique_ptr<hid::HidStylus> stylus;
};

TEST_P(HostProcess, LinksNothingButOurOwn) {
  const auto [code, said] = support::run_in_shell(fmt::format("ldd '{}'", STYLET_DEVICE_HOST_PROGRAM));
  ASSERT_EQ(code, 0) << said;
  EXPECT_THAT(said, HasSubstr("libstdc++"));
  for (const char* other : {"cholmod", "hidapi", "openblas", "metis", "vulkan", "dhd"}) {
    EXPECT_THAT(said, Not(HasSubstr(other)));
  }
}

TEST_P(HostProcess, IsListedWithItsState) {
  const auto devices = source.list();
  ASSERT_EQ(devices.size(), 1u) << source.missing();
  EXPECT_EQ(devices[0].path, GetParam().path);
  EXPECT_EQ(devices[0].product, GetParam().product);
  EXPECT_EQ(devices[0].state, "ready");
  EXPECT_NE(mock->process, getpid()) << "the library is never in this process";
  EXPECT_EQ(mock->closed, 1);
  mock->fault = MockDevice::kNotHomed;
  EXPECT_THAT(source.list().at(0).state, HasSubstr(GetParam().home));
}

TEST_P(HostProcess, PosesComeInAndForcesGoOut) {
  open();
  EXPECT_EQ(stylus->kind(), hid::DeviceKind::kStylus);
  ASSERT_TRUE(step_until([&] { return sample.valid; }));
  const Vector3d start = sample.position;
  mock->*GetParam().right = 0.002;
  ASSERT_TRUE(step_until([&] { return sample.valid && (sample.position - start).x() > 0.0019; }));
  ASSERT_TRUE(step_until([&] { return std::abs(mock->*GetParam().force_up - 1) < 1e-3; })) << "up";
  stylus.reset();
  EXPECT_EQ(mock->applied(), 0);
  EXPECT_EQ(mock->open, 0);
  EXPECT_EQ(mock->broken, 0u);
}

TEST_P(HostProcess, ALoopThatStopsLeavesNoForce) {
  open();
  ASSERT_TRUE(step_until([&] { return pushes(); }));
  EXPECT_TRUE(wait_until([&] { return mock->applied() == 0; }));
  EXPECT_TRUE(stylus->connected());
}

TEST_P(HostProcess, AStyletThatIsStoppedLeavesNoForce) {
  mock->deaf = 1;  // so that it can only be the device host
  const pid_t process = session();
  ASSERT_TRUE(wait_until([&] { return pushes(); }));
  kill(process, SIGSTOP);
  int status = 0;
  ASSERT_EQ(waitpid(process, &status, WUNTRACED), process);
  ASSERT_TRUE(WIFSTOPPED(status));
  EXPECT_TRUE(wait_until([&] { return mock->fx == 0 && mock->fy == 0 && mock->fz == 0; }))
      << "told so by the device host, which lives";
  kill(process, SIGCONT);
  EXPECT_TRUE(wait_until([&] { return pushes(); })) << "taken up again";
  kill(process, SIGKILL);
  waitpid(process, nullptr, 0);
  EXPECT_TRUE(wait_until([&] { return mock->open == 0; }));
}

TEST_P(HostProcess, AStyletThatIsKilledLeavesNoForceAndNoProcess) {
  mock->deaf = 1;
  const pid_t process = session();
  ASSERT_TRUE(wait_until([&] { return pushes(); }));
  kill(process, SIGKILL);
  waitpid(process, nullptr, 0);
  EXPECT_TRUE(wait_until([&] { return mock->applied() == 0 && mock->open == 0; })) << "closed by the device host";
}

TEST_P(HostProcess, AHostThatIsKilledIsStartedAnew) {
  open();
  ASSERT_TRUE(step_until([&] { return pushes(); }));
  const auto process = static_cast<pid_t>(mock->process);
  kill(process, SIGKILL);
  ASSERT_TRUE(step_until([&] { return !stylus->connected() || mock->process != process; }));
  EXPECT_TRUE(step_until([&] { return mock->process != process && pushes(); }));
}

TEST_P(HostProcess, NoTerminalAndNoDescriptorOfStyletIsItsOwn) {
  const int inherited = dup2(STDIN_FILENO, 77);  // without FD_CLOEXEC
  ASSERT_EQ(inherited, 77);
  const HostTransport host(vendor);
  ::close(inherited);
  EXPECT_EQ(getsid(host.process()), host.process());
  const auto file = std::filesystem::path("/proc") / std::to_string(host.process()) / "fd" / "77";
  std::error_code error;
  EXPECT_FALSE(std::filesystem::exists(std::filesystem::symlink_status(file, error)));
}

TEST_P(HostProcess, AHostThatIsAskedToEndSwitchesTheForceOff) {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {
    mock->reset();
    const HostTransport host(vendor);
    kill(host.process(), signal);
    EXPECT_TRUE(wait_until([&] { return mock->closed == 1; })) << signal;
  }
}

TEST_P(HostProcess, WhereChildrenAreNotKeptItsEndIsSeen) {
  const auto before = std::signal(SIGCHLD, SIG_IGN);
  {
    HostTransport host(vendor);
    const pid_t process = host.process();
    kill(process, SIGKILL);
    ASSERT_TRUE(wait_until([&] { return kill(process, 0) != 0; }));
    std::array<std::uint8_t, 31> bytes{};
    while (host.read(bytes, 0) > 0) continue;
    EXPECT_LT(host.read(bytes, 0), 0);
    EXPECT_LT(host.process(), 0) << "its number may be another's by now";
  }
  std::signal(SIGCHLD, before);
}

TEST_P(HostProcess, ALibraryThatHangsIsLeftAndLoadedAnew) {
  open();
  ASSERT_TRUE(step_until([&] { return pushes(); }));
  mock->fault = MockDevice::kHangs;
  ASSERT_TRUE(step_until([&] { return !sample.valid; }));
  ASSERT_TRUE(step_until([&] { return !stylus->connected(); }));
  mock->fault = MockDevice::kNone;
  EXPECT_TRUE(step_until([&] { return pushes(); }));
}

TEST_P(HostProcess, ADeviceThatIsPulledOutComesBack) {
  open();
  ASSERT_TRUE(step_until([&] { return pushes(); }));
  mock->fault = MockDevice::kPulledOut;
  ASSERT_TRUE(step_until([&] { return !stylus->connected(); }));
  mock->fault = MockDevice::kNone;
  EXPECT_TRUE(step_until([&] { return pushes(); }));
}

TEST_P(HostProcess, WhatCannotBeUsedIsSaid) {
  vendor.library = "/nowhere/lib.so";
  EXPECT_TRUE(HostSource(vendor).list().empty());
  EXPECT_THAT(HostSource(vendor).missing(), HasSubstr("not installed"));
  vendor.library = GetParam().library;
  vendor.program = "/nowhere/stylet_device_host";
  EXPECT_THAT(HostSource(vendor).missing(), HasSubstr("cannot be started"));
  EXPECT_EQ(source.complaint(), "") << "it can be used";
  mock->devices = 0;
  EXPECT_THAT(source.missing(), HasSubstr("plug it in"));
  EXPECT_THAT(source.complaint(), HasSubstr("plug it in")) << "installed, it is listed";
}

INSTANTIATE_TEST_SUITE_P(, HostProcess,
                         testing::Values(Mocked{"force_dimension", STYLET_MOCK_DHD, "force_dimension:4711", "omega.6",
                                                "home it", &MockDevice::y, &MockDevice::fz},
                                         Mocked{"openhaptics", STYLET_MOCK_HD, "openhaptics:0815", "Touch",
                                                "into its well", &MockDevice::x, &MockDevice::fy}),
                         [](const auto& named) { return std::string(named.param.kind); });

}  // namespace
}  // namespace stylet::haptic::host
