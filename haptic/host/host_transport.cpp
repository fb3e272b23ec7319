#include "haptic/host/host_transport.h"

#include "haptic/hid/stylus_adapter.h"
#include "haptic/paced_loop.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

extern char** environ;

namespace stylet::haptic::host {
namespace {

constexpr std::int64_t kLook = 1'000'000;  // ns

std::string from_environment(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nobody sets it
  return value != nullptr ? value : "";
}

/// With the channel as descriptor 3 and the pipe as 4, in a session of its own, so that no terminal can end or
/// stop it.
pid_t start(const Vendor& vendor, int channel, int life) {
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, 1, "/dev/null", O_WRONLY, 0);  // vendors' libraries print
  posix_spawn_file_actions_adddup2(&files, channel, 3);
  posix_spawn_file_actions_adddup2(&files, life, 4);
  posix_spawnattr_t how;
  posix_spawnattr_init(&how);
  sigset_t none;
  sigemptyset(&none);
  sigset_t all;
  sigfillset(&all);
  posix_spawnattr_setsigmask(&how, &none);
  posix_spawnattr_setsigdefault(&how, &all);
  posix_spawnattr_setflags(&how, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSID);
  std::string program = vendor.program, kind = vendor.kind, library = vendor.library;
  std::array<char*, 4> arguments{program.data(), kind.data(), library.data(), nullptr};
  pid_t process = -1;
  const int failed = posix_spawn(&process, program.c_str(), &files, &how, arguments.data(), environ);
  posix_spawnattr_destroy(&how);
  posix_spawn_file_actions_destroy(&files);
  if (failed != 0) {
    throw hid::HidError(
        fmt::format("{}: cannot be started ({}); install it beside stylet, or say where it is, "
                    "STYLET_DEVICE_HOST",
                    program, std::strerror(failed)));
  }
  return process;
}

}  // namespace

std::string host_program() {
  if (std::string said = from_environment("STYLET_DEVICE_HOST"); !said.empty()) return said;
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  return (self.parent_path() / "stylet_device_host").string();
}

HostTransport::HostTransport(const Vendor& vendor, bool must_open) {
  // Above the numbers that the child gets them under.
  std::array<int, 2> pipe{-1, -1};
  if (pipe2(pipe.data(), O_CLOEXEC) != 0) throw hid::HidError(fmt::format("no pipe: {}", std::strerror(errno)));
  const int channel = fcntl(channel_.file(), F_DUPFD_CLOEXEC, 10);
  const int life = fcntl(pipe[0], F_DUPFD_CLOEXEC, 10);
  close(pipe[0]);
  life_ = pipe[1];
  try {
    process_ = start(vendor, channel, life);
  } catch (...) {
    close(channel);
    close(life);
    close(life_);
    throw;
  }
  close(channel);
  close(life);
  MonotonicClock clock;
  const std::int64_t until_ns = clock.now_ns() + static_cast<std::int64_t>(kPatience * 1e9);
  while (state() == HostState::kStarting && clock.now_ns() < until_ns && !over()) {
    clock.sleep_until_ns(clock.now_ns() + kLook);
  }
  if (state() == HostState::kReady || (!must_open && state() != HostState::kStarting)) return;
  const std::string why =
      state() == HostState::kStarting
          ? fmt::format("the driver of {} does not answer; unplug the device and begin anew", vendor.name)
          : text_of(channel_->message);
  end(state() == HostState::kStarting ? 0 : kGrace);
  throw hid::HidError(why);
}

HostTransport::~HostTransport() {
  end(kGrace);
}

void HostTransport::end(double grace_s) {
  channel_->quit.store(1, std::memory_order_release);
  MonotonicClock clock;
  const std::int64_t until_ns = clock.now_ns() + static_cast<std::int64_t>(grace_s * 1e9);
  while (!over() && clock.now_ns() < until_ns) clock.sleep_until_ns(clock.now_ns() + kLook);
  if (!over()) {
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
    process_ = -1;
  }
  if (life_ >= 0) close(life_);
  life_ = -1;
}

bool HostTransport::over() {
  if (process_ < 0) return true;
  const pid_t ended = waitpid(process_, nullptr, WNOHANG);
  // Where somebody ignores SIGCHLD no ended child is kept, and its number may be another's.
  if (ended == process_ || (ended < 0 && errno == ECHILD)) process_ = -1;
  return process_ < 0;
}

int HostTransport::read(std::span<std::uint8_t> bytes, int timeout_ms) {
  MonotonicClock clock;
  channel_->poses.wait(next_, timeout_ms * 1'000'000LL);
  if (const std::size_t size = channel_->poses.take(next_, bytes)) return static_cast<int>(size);
  const std::int64_t now_ns = clock.now_ns();
  const std::int64_t before_ns = std::exchange(looked_ns_, now_ns);
  if (state() == HostState::kGone || over()) return -1;
  // Of a process that was itself away the device host's silence says nothing.
  const bool here = now_ns - before_ns < kSilent / 4;
  return here && now_ns - channel_->alive_ns.load(std::memory_order_relaxed) > kSilent ? -1 : 0;
}

bool HostTransport::write(std::span<const std::uint8_t> bytes) {
  if (bytes.size() == hid::kGainReportBytes && bytes[0] == hid::kGainReport) gain_ = bytes[1];
  return state() == HostState::kReady && channel_->orders.put(bytes);
}

int HostTransport::get_feature(std::span<std::uint8_t> bytes) {
  if (bytes.size() < hid::kGainReportBytes || bytes[0] != hid::kGainReport) return -1;
  bytes[1] = gain_;
  return static_cast<int>(hid::kGainReportBytes);
}

std::optional<Eigen::Vector3d> HostTransport::told_force() const {
  if (channel_->tells.load(std::memory_order_acquire) == 0) return {};
  const auto& told = channel_->told_force;
  return Eigen::Vector3d(told[0].load(std::memory_order_relaxed), told[1].load(std::memory_order_relaxed),
                         told[2].load(std::memory_order_relaxed));
}

std::vector<hid::HidDeviceSummary> HostSource::list() const {
  try {
    const HostTransport host(vendor_);
    return {{.path = fmt::format("{}:{}", vendor_.kind, host.serial()),
             .vendor_id = vendor_.usb_id,
             .manufacturer = vendor_.name,
             .product = host.name(),
             .serial_number = host.serial(),
             .state = host.needs().empty() ? "ready" : host.needs()}};
  } catch (const hid::HidError&) {
    return {};
  }
}

std::string HostSource::complaint() const {
  try {
    const HostTransport host(vendor_, false);
    return host.state() == HostState::kFailed ? host.needs() : "";
  } catch (const hid::HidError& error) {
    return error.what();
  }
}

std::string HostSource::missing() const {
  try {
    const HostTransport host(vendor_, false);
    return host.state() == HostState::kReady ? "the device has just come back; begin anew" : host.needs();
  } catch (const hid::HidError& error) {
    return error.what();
  }
}

std::vector<std::uint8_t> HostSource::descriptor(const std::string& /*path*/) const {
  return hid::adapted_descriptor(kMostForce);
}

std::unique_ptr<hid::ReportTransport> HostSource::open(const std::string& /*path*/) const {
  return std::make_unique<HostTransport>(vendor_);
}

const HostSource& force_dimension_source() {
  static const HostSource source({.kind = "force_dimension",
                                  .name = "Force Dimension",
                                  .usb_id = 0x1451,
                                  .library = from_environment("STYLET_DHD_LIBRARY"),
                                  .program = host_program()});
  return source;
}

const HostSource& openhaptics_source() {
  static const HostSource source({.kind = "openhaptics",
                                  .name = "3D Systems",
                                  .usb_id = 0x2988,
                                  .library = from_environment("STYLET_HD_LIBRARY"),
                                  .program = host_program()});
  return source;
}

}  // namespace stylet::haptic::host
