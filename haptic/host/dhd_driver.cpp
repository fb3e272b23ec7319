#include "haptic/host/dhd_driver.h"

#include "haptic/host/vendor_library.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <vector>

namespace stylet::haptic::host {
namespace {

// Names, types and numbers of the library's interface: facts of its documentation. Every function of a device takes
// its id last.
struct Dhd {
  void (*get_sdk_version)(int*, int*, int*, int*);
  int (*get_device_count)();
  int (*open)();
  int (*close)(char);
  const char* (*get_system_name)(char);
  int (*get_serial_number)(std::uint16_t*, char);
  bool (*has_wrist)(char);
  int (*get_status)(int*, char);
  unsigned (*get_button_mask)(char);
  int (*get_position_and_orientation_frame)(double*, double*, double*, double (*)[3], char);
  int (*enable_force)(unsigned char, char);
  int (*set_force)(double, double, double, char);
  int (*set_max_force)(double, char);
  double (*get_max_force)(char);
  int (*get_force)(double*, double*, double*, char);  // null: a library that has none
  int (*stop)(char);
  int (*enable_expert_mode)();
  int (*set_watchdog)(unsigned char, char);
  int (*get_watchdog)(unsigned char*, char);
  int (*error_get_last)();
  const char* (*error_get_last_str)();
};

constexpr unsigned char kWatchDog = 160;  // of 125 us: 20 ms
constexpr int kStatus = 64;               // its array has grown from version to version
constexpr int kStatusEvery = 10;          // turns
constexpr int kMostErrors = 20;           // in a row, until the device is gone
constexpr int kNoDeviceError = 5;
constexpr double kSlow = 0.1;                   // m/s
constexpr std::int64_t kSlowFor = 500'000'000;  // ns

constexpr int kTimeGuard = 1;  // a success: the pose as before
enum Cause { kButton = 1, kTooFast = 2, kBarked = 3 };

enum Status { kPower = 0, kConnected = 1, kReset = 3, kForce = 5, kError = 9, kForceOffCause = 14 };

/// X right, Y near, Z down from X near, Y right, Z up, and back.
Eigen::Matrix3d reports_from_dhd() {
  return (Eigen::Matrix3d() << 0, 1, 0, 1, 0, 0, 0, 0, -1).finished();
}

std::vector<std::string> names() {
  std::vector<std::string> paths;
  const auto add = [&](const std::string& folder) {
    for (const char* name : {"libdhd.so", "libdrd.so", "libdhd.so.3", "libdrd.so.3"}) paths.push_back(folder + name);
  };
  if (const char* sdk = std::getenv("FDSDK")) add(std::string(sdk) + "/lib/release/lin-x86_64-gcc/");
  if (const char* home = std::getenv("HOME")) add(std::string(home) + "/.local/lib/");
  add("/usr/local/lib/");
  add("");
  return paths;
}

class DhdDriver final : public Driver {
public:
  explicit DhdDriver(std::string library) : chosen_(std::move(library)) {}
  ~DhdDriver() override { DhdDriver::close(); }

  Device open() override {
    if (!loaded_) load();
    loaded_ = true;
    int major = 0, minor = 0, release = 0, revision = 0;
    dhd_.get_sdk_version(&major, &minor, &release, &revision);
    if (major < 3) {
      throw DriverError(
          fmt::format("the Force Dimension SDK is of version {}.{}; install 3.0 or newer", major, minor), true);
    }
    if (dhd_.get_device_count() <= 0) {
      throw DriverError("no Force Dimension device and no Falcon is connected; plug it in and switch it on", true);
    }
    const int id = dhd_.open();
    if (id < 0) throw DriverError(what_failed(), true);
    id_ = static_cast<char>(id);
    open_ = true;
    errors_ = 0;
    turns_ = 0;
    has_wrist_ = dhd_.has_wrist(id_);
    dhd_.enable_force(0, id_);
    unsigned char watch_dog = 0;
    guarded_ = ok(dhd_.enable_expert_mode()) && ok(dhd_.set_watchdog(kWatchDog, id_)) &&
               ok(dhd_.get_watchdog(&watch_dog, id_)) && watch_dog == kWatchDog;
    double most = dhd_.get_max_force(id_);
    if (!(most > 0)) most = kStrangeMost;
    most_ = most;
    dhd_.set_max_force(most, id_);
    std::uint16_t serial = 0;
    const char* name = dhd_.get_system_name(id_);
    const bool known = ok(dhd_.get_serial_number(&serial, id_));
    return {.name = name != nullptr ? name : "Force Dimension device", .serial = known ? std::to_string(serial) : ""};
  }

  Read read(hid::AdaptedState& state, std::int64_t now_ns) override {
    if (!open_) return Read::kGone;
    if (turns_++ % kStatusEvery == 0) ask_status();
    Eigen::Vector3d at;
    double frame[3][3] = {};
    const int result = dhd_.get_position_and_orientation_frame(&at.x(), &at.y(), &at.z(), frame, id_);
    if (!ok(result)) return ++errors_ > kMostErrors ? Read::kGone : Read::kNothing;
    if (status_[kConnected] == 0) return Read::kGone;
    errors_ = 0;
    if (result == kTimeGuard) return Read::kNothing;  // asked too soon, or a device that says nothing new
    const Eigen::Vector3d position = reports_from_dhd() * at;
    watch_speed(position, now_ns);
    state.position = position;
    if (has_wrist_) {
      Eigen::Matrix3d rotation;
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) rotation(row, column) = frame[row][column];
      }
      // One that is none is no pose.
      const bool is_rotation = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < 0.02 &&
                               std::abs(rotation.determinant() - 1) < 0.02;
      if (!is_rotation) return Read::kNothing;
      state.orientation =
          Eigen::Quaterniond(reports_from_dhd() * rotation * reports_from_dhd().transpose()).normalized();
    }
    const unsigned buttons = dhd_.get_button_mask(id_);
    state.barrel = (buttons & 1) != 0;
    state.secondary_barrel = (buttons & 2) != 0;
    const bool tripped = on_ && status_[kForce] == 0;
    state.in_range = status_[kReset] != 0 && !tripped;
    state.enabled = status_[kForce] != 0 || !on_;
    state.power = status_[kPower] != 0;
    if (Eigen::Vector3d told;
        dhd_.get_force != nullptr && ok(dhd_.get_force(&told.x(), &told.y(), &told.z(), id_)) && told.allFinite()) {
      state.told_force = reports_from_dhd() * told;
    }
    return Read::kPose;
  }

  bool push(const Eigen::Vector3d& force) override {
    if (!open_) return false;
    const double norm = force.norm();
    const Eigen::Vector3d theirs =
        reports_from_dhd().transpose() * (norm > most_ ? (force * (most_ / norm)).eval() : force);
    return theirs.allFinite() && ok(dhd_.set_force(theirs.x(), theirs.y(), theirs.z(), id_));
  }

  void enable(bool on) override {
    if (!open_) return;
    on_ = on;
    dhd_.set_force(0, 0, 0, id_);
    dhd_.enable_force(on ? 1 : 0, id_);
    ask_status();
  }

  std::string needs() const override {
    if (status_[kPower] == 0) return "it has no power: switch it on";
    if (status_[kReset] == 0)
      return "it does not know where it is: home it as its manual says (a Falcon: push the grip in and pull it out)";
    if (on_ && status_[kForce] == 0) {
      switch (status_[kForceOffCause]) {
        case kButton:
          return "its force was switched off by its own button";
        case kTooFast:
          return "it was moved too fast: its force comes back when the hand is slow";
        case kBarked:
          return "its watch-dog has switched the force off";
        default:
          return "its force is off: switch it on by its own button";
      }
    }
    if (!guarded_) return "its firmware takes no watch-dog of 20 ms; this program's own still counts";
    return {};
  }

  void close() override {
    if (!open_) return;
    open_ = false;
    dhd_.set_force(0, 0, 0, id_);
    dhd_.stop(id_);
    dhd_.close(id_);
  }

private:
  static bool ok(int result) { return result >= 0; }  // 1: cached, 2: saturated

  void load() {
    const VendorLibrary library("Force Dimension", chosen_, names());
    library.find(dhd_.get_sdk_version, "dhdGetSDKVersion");
    library.find(dhd_.get_device_count, "dhdGetDeviceCount");
    library.find(dhd_.open, "dhdOpen");
    library.find(dhd_.close, "dhdClose");
    library.find(dhd_.get_system_name, "dhdGetSystemName");
    library.find(dhd_.get_serial_number, "dhdGetSerialNumber");
    library.find(dhd_.has_wrist, "dhdHasWrist");
    library.find(dhd_.get_status, "dhdGetStatus");
    library.find(dhd_.get_button_mask, "dhdGetButtonMask");
    library.find(dhd_.get_position_and_orientation_frame, "dhdGetPositionAndOrientationFrame");
    library.find(dhd_.enable_force, "dhdEnableForce");
    library.find(dhd_.set_force, "dhdSetForce");
    library.find(dhd_.set_max_force, "dhdSetMaxForce");
    library.find(dhd_.get_max_force, "dhdGetMaxForce");
    library.find_if_there(dhd_.get_force, "dhdGetForce");
    library.find(dhd_.stop, "dhdStop");
    library.find(dhd_.enable_expert_mode, "dhdEnableExpertMode");
    library.find(dhd_.set_watchdog, "dhdSetWatchdog");
    library.find(dhd_.get_watchdog, "dhdGetWatchdog");
    library.find(dhd_.error_get_last, "dhdErrorGetLast");
    library.find(dhd_.error_get_last_str, "dhdErrorGetLastStr");
  }

  std::string what_failed() const {
    const int error = dhd_.error_get_last();
    const char* words = dhd_.error_get_last_str();
    const char* advice = error == 20 || error == 3 ? "another program uses it: end that"
                         : error == 4              ? "its driver is missing: install the vendor's udev rule"
                         : error == kNoDeviceError ? "plug it in and switch it on"
                         : error == 12             ? "home it as its manual says"
                                                   : "switch it off and on";
    return fmt::format("the Force Dimension device cannot be opened ({}, error {}); {}",
                       words != nullptr ? words : "?", error, advice);
  }

  void ask_status() {
    std::array<int, kStatus> status{};
    if (ok(dhd_.get_status(status.data(), id_))) status_ = status;
  }

  /// A trip ends when the hand has been slow for a while. What somebody or something else has switched off, such as a
  /// dead man's switch, or nobody says why, is not ours to switch on.
  void watch_speed(const Eigen::Vector3d& position, std::int64_t now_ns) {
    const int cause = status_[kForceOffCause];
    if (!on_ || status_[kForce] != 0 || (cause != kTooFast && cause != kBarked)) {
      slow_since_ns_ = 0;
    } else {
      const double dt_s = 1e-9 * static_cast<double>(now_ns - last_ns_);
      const bool slow = last_ && dt_s > 0 && (position - *last_).norm() < kSlow * dt_s;
      if (!slow) slow_since_ns_ = 0;
      if (slow && slow_since_ns_ == 0) slow_since_ns_ = now_ns;
      if (slow_since_ns_ != 0 && now_ns - slow_since_ns_ > kSlowFor) {
        enable(true);
        slow_since_ns_ = 0;
      }
    }
    last_ = position;
    last_ns_ = now_ns;
  }

  std::string chosen_;
  Dhd dhd_{};
  bool loaded_ = false;
  bool open_ = false;
  bool on_ = false;
  bool has_wrist_ = false;
  bool guarded_ = false;
  char id_ = 0;
  double most_ = 0;  // N
  int errors_ = 0;
  int turns_ = 0;
  std::array<int, kStatus> status_{};
  std::optional<Eigen::Vector3d> last_{};
  std::int64_t last_ns_ = 0;
  std::int64_t slow_since_ns_ = 0;
};

}  // namespace

std::unique_ptr<Driver> make_dhd_driver(const std::string& library) {
  return std::make_unique<DhdDriver>(library);
}

}  // namespace stylet::haptic::host
