// A library of our own with the names of the HD library that the device host calls: a Touch of nobody's. With a clock
// of the test's it has no thread: mock_hd_tick() is one turn of its servo loop.
#include "tests/support/vendor/mock_device.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <deque>
#include <limits>
#include <mutex>
#include <thread>

#define EXPORT extern "C" __attribute__((visibility("default")))

namespace {

using stylet::support::MockDevice;
using Callback = unsigned (*)(void*);

struct Error {
  unsigned code;
  int internal;
  unsigned device;
};

constexpr unsigned kHandle = 7;
constexpr unsigned kInvalid = 0xFFFFFFFF;

MockDevice& mock() {
  static MockDevice& device = *stylet::support::mock_device();
  return device;
}

struct Servo {
  std::mutex mutex;
  Callback callback = nullptr;
  void* self = nullptr;
  std::thread thread;
  std::atomic<bool> runs{false};
  bool in_frame = false;
  bool framed = false;  // this tick
  double force[3] = {};
  std::deque<unsigned> errors;
  bool calibrating = false;
};

Servo& servo() {
  static Servo one;
  return one;
}

void error(unsigned code) {
  if (servo().errors.size() < 100) servo().errors.push_front(code);
}

void tick() {
  Servo& s = servo();
  const std::scoped_lock lock(s.mutex);
  if (s.callback == nullptr || !s.runs || mock().fault == MockDevice::kHangs) return;
  s.framed = false;
  if (s.callback(s.self) == 0) s.callback = nullptr;
  if (s.in_frame) ++mock().broken;
}

void expect_frame() {
  if (!servo().in_frame) ++mock().broken;
}

void expect_open() {
  ++mock().calls;
  mock().process = getpid();
  if (mock().open == 0) ++mock().broken;
}

}  // namespace

EXPORT void mock_hd_tick() {
  tick();
}
/// As if the process had died.
EXPORT void mock_hd_forget() {
  servo().callback = nullptr;
  servo().runs = false;
  mock().open = 0;
}

EXPORT unsigned hdInitDevice(const char* name) {
  MockDevice& m = mock();
  m.process = getpid();
  if (m.open_error == 1 && name == nullptr) {  // an installation that wants a name
    error(0x0302);
    return kInvalid;
  }
  if (m.open_error > 1 || m.devices == 0 || m.fault == MockDevice::kPulledOut) {
    error(m.open_error > 1 ? static_cast<unsigned>(m.open_error.load()) : 0x0302);
    return kInvalid;
  }
  servo().errors.clear();
  m.open = 1;
  m.on = 0;
  // How long a device keeps its last force is not documented: as long as the force stylus may.
  m.watch_dog = m.deaf != 0 ? 0 : 160;
  return kHandle;
}
EXPORT void hdDisableDevice(unsigned) {
  ++mock().closed;
  mock().open = 0;
  mock().on = 0;
}
EXPORT void hdMakeCurrentDevice(unsigned) {
  expect_open();
}
EXPORT void hdBeginFrame(unsigned) {
  expect_open();
  Servo& s = servo();
  if (s.in_frame || s.framed) ++mock().broken;
  s.in_frame = s.framed = true;
  std::fill_n(s.force, 3, 0.0);  // until it is set
  if (mock().fault == MockDevice::kErrors || mock().fault == MockDevice::kPulledOut) error(0x0302);
  if (mock().fault == MockDevice::kBrake && mock().on != 0) error(0x0203);
  if (mock().fault == MockDevice::kCached) error(0x0101);
}
EXPORT void hdEndFrame(unsigned) {
  expect_frame();
  Servo& s = servo();
  MockDevice& m = mock();
  s.in_frame = false;
  if (!std::isfinite(s.force[0] + s.force[1] + s.force[2])) ++m.not_finite;
  m.fx = s.force[0], m.fy = s.force[1], m.fz = s.force[2];
  m.force_ns = m.clock_ns();
  const double norm = std::sqrt(m.fx * m.fx + m.fy * m.fy + m.fz * m.fz);
  m.forces += norm > 0 ? 1 : 0;
  m.largest = std::max(m.largest.load(), norm);
}
EXPORT Error hdGetError() {
  Servo& s = servo();
  if (s.errors.empty()) return {0, 0, kHandle};
  const unsigned code = s.errors.front();
  s.errors.pop_front();
  if (mock().fault == MockDevice::kCached) s.errors.push_back(code);  // it never empties
  return {code, -28, kHandle};
}
EXPORT const char* hdGetErrorString(unsigned code) {
  return code == 0x0302 ? "communication error" : "some error";
}
EXPORT void hdEnable(unsigned what) {
  expect_open();
  if (what != 0x4000) return;
  mock().on = 1;
  mock().force_ns = mock().clock_ns();
  mock().fx = mock().fy = mock().fz = 0;
}
EXPORT void hdDisable(unsigned what) {
  expect_open();
  if (what == 0x4000) mock().on = 0;
}
EXPORT unsigned char hdIsEnabled(unsigned) {
  return static_cast<unsigned char>(mock().on.load());
}
EXPORT void hdGetIntegerv(unsigned what, int* value) {
  expect_open();
  *value = what == 0x2000 ? mock().buttons.load() : mock().styles.load();
}
EXPORT void hdGetDoublev(unsigned what, double* value) {
  expect_open();
  expect_frame();
  const MockDevice& m = mock();
  if (what == 0x2050) {
    value[0] = 1e3 * m.x, value[1] = 1e3 * m.y, value[2] = 1e3 * m.z;
    if (m.fault == MockDevice::kNotFinite) value[1] = std::numeric_limits<double>::quiet_NaN();
    if (m.fault == MockDevice::kFar) value[0] = 9e3;
  } else if (what == 0x2052) {
    const double c = std::cos(m.turn_x), s = std::sin(m.turn_x);
    const double columns[16] = {1, 0, 0, 0, 0, c, s, 0, 0, -s, c + 1e-4, 0, 0, 0, 0, 1};
    std::copy_n(columns, 16, value);
    if (m.fault == MockDevice::kSkewed) value[1] = 0.7;
  } else if (what == 0x2100) {
    for (int k = 0; k < 3; ++k) value[k] = m.fault == MockDevice::kFrozen ? 0 : 0.1 * (k + 1);
  } else if (what == 0x2603) {
    *value = 3.3;
  }
}
EXPORT void hdSetDoublev(unsigned what, const double* value) {
  expect_open();
  expect_frame();
  if (what != 0x2700) return;
  if (mock().on == 0) ++mock().broken;
  std::copy_n(value, 3, servo().force);
}
EXPORT const char* hdGetString(unsigned what) {
  return what == 0x2504 ? "0815" : "Touch";
}
EXPORT unsigned hdCheckCalibration() {
  if (mock().fault == MockDevice::kNotHomed) return 0x5002;
  return mock().fault == MockDevice::kUncalibrated ? 0x5001 : 0x5000;
}
EXPORT void hdUpdateCalibration(unsigned style) {
  mock().calibrated_by = static_cast<int>(style);
}
EXPORT void hdStartScheduler() {
  Servo& s = servo();
  s.runs = true;
  if (mock().now_ns != 0) return;
  s.thread = std::thread([&s] {
    auto due = std::chrono::steady_clock::now();
    while (s.runs) {
      tick();
      std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
    }
  });
}
EXPORT void hdStopScheduler() {
  Servo& s = servo();
  s.runs = false;
  if (s.thread.joinable()) s.thread.join();
}
EXPORT unsigned long hdScheduleAsynchronous(Callback callback, void* self, unsigned short) {
  const std::scoped_lock lock(servo().mutex);
  servo().callback = callback;
  servo().self = self;
  return 1;
}
#ifndef STYLET_MOCK_OLD
EXPORT void hdUnschedule(unsigned long) {
  const std::scoped_lock lock(servo().mutex);
  servo().callback = nullptr;
}
#endif
