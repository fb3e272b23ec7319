#include "haptic/host/hd_driver.h"

#include "haptic/hid/newest_value.h"
#include "haptic/host/vendor_library.h"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace stylet::haptic::host {
namespace {

// Names, types and numbers of the library's interface: facts of its documentation.
struct HdError {
  unsigned code;
  int internal;
  unsigned device;
};
static_assert(sizeof(HdError) == 12, "it is returned by value");

using HdCallback = unsigned (*)(void*);

struct Hd {
  unsigned (*init_device)(const char*);
  void (*disable_device)(unsigned);
  void (*make_current_device)(unsigned);
  void (*begin_frame)(unsigned);
  void (*end_frame)(unsigned);
  HdError (*get_error)();
  const char* (*get_error_string)(unsigned);
  void (*enable)(unsigned);
  void (*disable)(unsigned);
  unsigned char (*is_enabled)(unsigned);
  void (*get_integerv)(unsigned, int*);
  void (*get_doublev)(unsigned, double*);
  void (*set_doublev)(unsigned, const double*);
  const char* (*get_string)(unsigned);
  unsigned (*check_calibration)();
  void (*update_calibration)(unsigned);
  void (*start_scheduler)();
  void (*stop_scheduler)();
  unsigned long (*schedule_asynchronous)(HdCallback, void*, unsigned short);
  void (*unschedule)(unsigned long);
};

constexpr unsigned kInvalidHandle = 0xFFFFFFFF;
constexpr unsigned kButtons = 0x2000, kPosition = 0x2050, kTransform = 0x2052, kJointAngles = 0x2100;
constexpr unsigned kModelType = 0x2501, kSerialNumber = 0x2504, kCalibrationStyle = 0x2555, kNominalMaxForce = 0x2603;
constexpr unsigned kCurrentForce = 0x2700, kForceOutput = 0x4000;
constexpr unsigned kCalibrationNeedsUpdate = 0x5001, kCalibrationNeedsManual = 0x5002;
constexpr unsigned kEncoderStyle = 1, kAutoStyle = 2, kInkwellStyle = 4;
constexpr unsigned kCommError = 0x0302, kCommConfigError = 0x0303, kInvalidLicense = 0x0600;
constexpr unsigned kFirstForceError = 0x0200, kFirstDeviceError = 0x0300, kFirstUsageError = 0x0400;
constexpr unsigned kContinue = 1;
constexpr unsigned short kHighest = 65535;
constexpr int kErrorsATick = 8;                 // taken a tick: its stack may never empty
constexpr int kCalibrationEvery = 500;          // ticks, while it is not calibrated
constexpr int kQuietTicks = 20;                 // of zero force before the end
constexpr std::int64_t kSilence = 20'000'000;   // ns without an order
constexpr std::int64_t kStands = 500'000'000;   // ns without a tick: its scheduler is gone
constexpr std::int64_t kTripped = 500'000'000;  // ns after the library has cut a force
constexpr int kMostPauses = 100;                // at the end

/// X right, Y near, Z down from X right, Y up, Z near.
Eigen::Matrix3d reports_from_hd() {
  return (Eigen::Matrix3d() << 1, 0, 0, 0, 0, 1, 0, -1, 0).finished();
}

struct Order {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  // N, axes of the reports
  std::int64_t number = 0;
};

struct Tick {
  hid::AdaptedState state{};
  std::uint64_t number = 0;
  bool sound = false;
};

class HdDriver final : public Driver {
public:
  HdDriver(std::string library, HostClock clock) : chosen_(std::move(library)), clock_(clock) {}
  ~HdDriver() override { HdDriver::close(); }

  Device open() override {
    if (!loaded_) load();
    loaded_ = true;
    std::string tried;
    for (const char* name : {static_cast<const char*>(nullptr), "Default Device", "Default PHANToM"}) {
      device_ = hd_.init_device(name);
      const HdError error = hd_.get_error();
      if (device_ != kInvalidHandle && error.code == 0) break;
      if (device_ != kInvalidHandle) hd_.disable_device(device_);
      device_ = kInvalidHandle;
      if (error.code == kInvalidLicense) {
        throw DriverError("the library of OpenHaptics has no valid licence; install that of its maker", true);
      }
      if (tried.empty()) tried = why(error);
      empty_errors();
    }
    if (device_ == kInvalidHandle) {
      throw DriverError(
          fmt::format("no device of 3D Systems can be opened ({}); plug it in, set it up with its maker's "
                      "program, and end what else uses it",
                      tried),
          true);
    }
    hd_.make_current_device(device_);
    const char* model = hd_.get_string(kModelType);
    const char* serial = hd_.get_string(kSerialNumber);
    Device found{.name = model != nullptr ? model : "3D Systems device", .serial = serial != nullptr ? serial : ""};
    if (hd_.is_enabled(kForceOutput) != 0) hd_.disable(kForceOutput);
    empty_errors();
    want_on_ = false;
    on_ = false;
    fault_ = 0;
    trips_ = 0;
    ticks_ = 0;
    seen_ = 0;
    frozen_ = false;
    calibrated_ = false;
    manual_ = false;
    last_tick_ns_ = 0;
    order_ns_ = 0;
    running_ = true;
    callback_ = hd_.schedule_asynchronous(&HdDriver::tick_of, this, kHighest);
    hd_.start_scheduler();
    const HdError error = hd_.get_error();
    if (error.code != 0) {
      const std::string reason = why(error);
      close();
      throw DriverError(
          fmt::format("the scheduler of OpenHaptics does not start ({}); switch the device off and on", reason),
          true);
    }
    return found;
  }

  Read read(hid::AdaptedState& state, std::int64_t now_ns) override {
    if (!running_ || fault_ != 0) return Read::kGone;
    poses_.update();
    const Tick& tick = poses_.get();
    if (last_tick_ns_ == 0) last_tick_ns_ = now_ns;
    if (tick.number == seen_) return now_ns - last_tick_ns_ > kStands ? Read::kGone : Read::kNothing;
    seen_ = tick.number;
    last_tick_ns_ = now_ns;
    if (const std::uint32_t trips = trips_; trips != trips_seen_) {
      trips_seen_ = trips;
      tripped_until_ns_ = now_ns + kTripped;
    }
    tripped_ = now_ns < tripped_until_ns_;
    if (!tick.sound) return Read::kNothing;
    state = tick.state;
    state.in_range = calibrated_ && !frozen_ && !tripped_;
    state.enabled = !tripped_;
    state.power = true;
    return Read::kPose;
  }

  bool push(const Eigen::Vector3d& force) override {
    if (!running_) return false;
    orders_.put({.force = force, .number = ++order_});
    return fault_ == 0;
  }

  void enable(bool on) override { want_on_ = on; }

  std::string needs() const override {
    if (frozen_) {
      return "its joints stand at zero while it moves: its set-up file is misread; set it up anew with its maker's "
             "program";
    }
    if (manual_) return "it is not calibrated: put the stylus into its well";
    if (!calibrated_) return "it is being calibrated";
    if (tripped_)
      return fmt::format("its library has cut the force (error {:x}): it comes back in half a second", trip_.load());
    return {};
  }

  void close() override {
    if (device_ == kInvalidHandle) return;
    if (running_) {
      orders_.put({.number = ++order_});
      // It goes out with the next ticks, where there are any.
      const std::uint64_t until = ticks_ + kQuietTicks;
      for (int k = 0; k < kMostPauses && ticks_ < until && fault_ == 0; ++k) clock_.pause();
      hd_.stop_scheduler();
      hd_.unschedule(callback_);
      running_ = false;
    }
    hd_.disable_device(device_);
    device_ = kInvalidHandle;
  }

private:
  static unsigned tick_of(void* self) { return static_cast<HdDriver*>(self)->tick(); }

  /// The library's servo thread, each of its milliseconds: bounded, without locks and memory.
  unsigned tick() {
    Tick out{.number = ticks_ + 1};
    hd_.make_current_device(device_);
    if (const bool want = want_on_; want != on_) {
      if (want) {
        hd_.enable(kForceOutput);
      } else {
        hd_.disable(kForceOutput);
      }
      on_ = want;
    }
    hd_.begin_frame(device_);
    std::array<double, 3> position{}, joints{};
    std::array<double, 16> transform{};
    int buttons = 0;
    hd_.get_doublev(kPosition, position.data());
    hd_.get_doublev(kTransform, transform.data());
    hd_.get_doublev(kJointAngles, joints.data());
    hd_.get_integerv(kButtons, &buttons);
    if (ticks_ == 0) {
      double most = 0;
      hd_.get_doublev(kNominalMaxForce, &most);
      most_ = most > 0 ? most : kStrangeMost;
    }
    if (on_) {
      const Eigen::Vector3d force = reports_from_hd().transpose() * wanted();
      const std::array<double, 3> newtons{force.x(), force.y(), force.z()};
      hd_.set_doublev(kCurrentForce, newtons.data());
    }
    hd_.end_frame(device_);
    take_errors();
    if (!calibrated_ && ticks_ % kCalibrationEvery == 0) calibrate();
    read_pose(position, transform, out);
    frozen_ = joints[0] == 0 && joints[1] == 0 && joints[2] == 0;
    out.state.barrel = (buttons & 1) != 0;
    out.state.secondary_barrel = (buttons & 2) != 0;
    poses_.put(out);
    ticks_ = ticks_ + 1;
    return kContinue;
  }

  /// Of the newest order. The device host gives one each of its turns: without one it stands still.
  Eigen::Vector3d wanted() {
    const std::int64_t now_ns = clock_.now_ns();
    if (orders_.update()) order_ns_ = now_ns;
    if (now_ns - order_ns_ >= kSilence) return {0, 0, 0};
    Eigen::Vector3d force = orders_.get().force;
    if (!force.allFinite()) return {0, 0, 0};
    if (const double norm = force.norm(); norm > most_) force *= most_ / norm;
    return force;
  }

  void read_pose(const std::array<double, 3>& position, const std::array<double, 16>& transform, Tick& out) const {
    const Eigen::Vector3d at(position[0], position[1], position[2]);
    out.state.position = reports_from_hd() * at * 1e-3;  // mm
    Eigen::Matrix3d rotation;
    for (int column = 0; column < 3; ++column) {
      for (int row = 0; row < 3; ++row) rotation(row, column) = transform[static_cast<std::size_t>(4 * column + row)];
    }
    // Not exactly one by the library either.
    out.sound = at.allFinite() && (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < 0.1 &&
                rotation.determinant() > 0.8;
    if (out.sound)
      out.state.orientation =
          Eigen::Quaterniond(reports_from_hd() * rotation * reports_from_hd().transpose()).normalized();
  }

  void take_errors() {
    for (int k = 0; k < kErrorsATick; ++k) {
      const HdError error = hd_.get_error();
      if (error.code == 0) return;
      if (error.code >= kFirstDeviceError && error.code < kFirstUsageError) {
        fault_ = error.code;
      } else if (error.code >= kFirstForceError && error.code < kFirstDeviceError) {
        trip_ = error.code;
        trips_ = trips_ + 1;
      }
    }
  }

  void calibrate() {
    const unsigned state = hd_.check_calibration();
    manual_ = state == kCalibrationNeedsManual;
    calibrated_ = state != kCalibrationNeedsManual && state != kCalibrationNeedsUpdate;
    if (state != kCalibrationNeedsUpdate) return;
    int mask = 0;
    hd_.get_integerv(kCalibrationStyle, &mask);
    const auto styles = static_cast<unsigned>(mask);
    const unsigned style = (styles & kAutoStyle) != 0      ? kAutoStyle
                           : (styles & kInkwellStyle) != 0 ? kInkwellStyle
                                                           : kEncoderStyle;
    if (style == kInkwellStyle) manual_ = true;
    hd_.update_calibration(style);
  }

  std::string why(const HdError& error) const {
    const char* words = hd_.get_error_string(error.code);
    const char* advice = error.code == kCommError || error.code == kCommConfigError
                             ? "; its port may belong to another user, or it is behind Ethernet or a hub"
                             : "";
    return fmt::format("error {:x}, {}{}", error.code, words != nullptr ? words : "?", advice);
  }

  void empty_errors() {
    for (int k = 0; k < kErrorsATick && hd_.get_error().code != 0; ++k) {
    }
  }

  void load() {
    static const std::array<std::string, 3> kNames{"libHD.so", "libHD.so.3.4", "libHD.so.3.0"};
    const VendorLibrary library("OpenHaptics", chosen_, kNames);
    library.find(hd_.init_device, "hdInitDevice");
    library.find(hd_.disable_device, "hdDisableDevice");
    library.find(hd_.make_current_device, "hdMakeCurrentDevice");
    library.find(hd_.begin_frame, "hdBeginFrame");
    library.find(hd_.end_frame, "hdEndFrame");
    library.find(hd_.get_error, "hdGetError");
    library.find(hd_.get_error_string, "hdGetErrorString");
    library.find(hd_.enable, "hdEnable");
    library.find(hd_.disable, "hdDisable");
    library.find(hd_.is_enabled, "hdIsEnabled");
    library.find(hd_.get_integerv, "hdGetIntegerv");
    library.find(hd_.get_doublev, "hdGetDoublev");
    library.find(hd_.set_doublev, "hdSetDoublev");
    library.find(hd_.get_string, "hdGetString");
    library.find(hd_.check_calibration, "hdCheckCalibration");
    library.find(hd_.update_calibration, "hdUpdateCalibration");
    library.find(hd_.start_scheduler, "hdStartScheduler");
    library.find(hd_.stop_scheduler, "hdStopScheduler");
    library.find(hd_.schedule_asynchronous, "hdScheduleAsynchronous");
    library.find(hd_.unschedule, "hdUnschedule");
  }

  std::string chosen_;
  HostClock clock_;
  Hd hd_{};
  bool loaded_ = false;
  std::atomic<bool> running_{false};
  unsigned device_ = kInvalidHandle;
  unsigned long callback_ = 0;
  // To the servo thread.
  hid::NewestValue<Order> orders_;
  std::int64_t order_ = 0;
  std::atomic<bool> want_on_{false};
  // Of the servo thread.
  bool on_ = false;
  double most_ = kStrangeMost;  // N
  std::int64_t order_ns_ = 0;   // when the last order was found
  // From it.
  hid::NewestValue<Tick> poses_;
  std::atomic<std::uint64_t> ticks_{0};
  std::atomic<unsigned> fault_{0};
  std::atomic<unsigned> trip_{0};
  std::atomic<std::uint32_t> trips_{0};
  std::atomic<bool> calibrated_{false};
  std::atomic<bool> manual_{false};
  std::atomic<bool> frozen_{false};
  // Of the host's thread.
  std::uint64_t seen_ = 0;
  std::uint32_t trips_seen_ = 0;
  bool tripped_ = false;
  std::int64_t tripped_until_ns_ = 0;
  std::int64_t last_tick_ns_ = 0;
};

}  // namespace

std::unique_ptr<Driver> make_hd_driver(const std::string& library, HostClock clock) {
  return std::make_unique<HdDriver>(library, clock);
}

}  // namespace stylet::haptic::host
