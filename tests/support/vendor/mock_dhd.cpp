// A library of our own with the names of the DHD library that the device host calls: an omega.6 of nobody's.
#include "tests/support/vendor/mock_device.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#define EXPORT extern "C" __attribute__((visibility("default")))

namespace {

using stylet::support::MockDevice;

MockDevice& mock() {
  static MockDevice& device = *stylet::support::mock_device();
  return device;
}

thread_local int last_error = 0;

int fail(int error) {
  last_error = error;
  return -1;
}

/// Before each call to an open device. @return 0, 1 or 2: it goes well; -1
int call() {
  MockDevice& m = mock();
  ++m.calls;
  m.process = getpid();
  if (m.open == 0) {
    ++m.broken;
    return fail(20);
  }
  while (m.fault == MockDevice::kHangs && m.now_ns == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  // The firmware's watch-dog switches the force off until it is switched on again.
  if (m.on != 0 && m.barks()) m.on = 0, m.cause = 3;
  if (m.on != 0 && m.fault == MockDevice::kBrake) m.on = 0, m.cause = 2;
  if (m.fault == MockDevice::kErrors || m.fault == MockDevice::kPulledOut) return fail(2);
  if (m.fault == MockDevice::kCached) return 1;
  return m.fault == MockDevice::kSaturated ? 2 : 0;
}

}  // namespace

EXPORT void dhdGetSDKVersion(int* major, int* minor, int* release, int* revision) {
  *major = mock().major;
  *minor = 17, *release = 5, *revision = 0;
}
EXPORT int dhdGetDeviceCount() {
  return mock().fault == MockDevice::kPulledOut ? 0 : mock().devices.load();
}
EXPORT int dhdOpen() {
  if (mock().open_error != 0) return fail(mock().open_error);
  mock().open = 1;
  return 0;
}
EXPORT int dhdClose(char) {
  ++mock().closed;
  mock().open = 0;
  mock().on = 0;
  return 0;
}
EXPORT const char* dhdGetSystemName(char) {
  return "omega.6";
}
EXPORT int dhdGetSerialNumber(std::uint16_t* number, char) {
  *number = 4711;
  return 0;
}
EXPORT bool dhdHasWrist(char) {
  return true;
}
EXPORT int dhdGetStatus(int* status, char) {
  const int result = call();
  if (result < 0) return result;
  const MockDevice& m = mock();
  int all[32] = {};
  all[0] = m.fault != MockDevice::kNoPower;
  all[1] = 1;
  all[2] = 1;
  all[3] = m.fault != MockDevice::kNotHomed;
  all[5] = m.on;
  all[14] = m.cause;
  std::copy_n(all, std::min(32, m.status_size.load()), status);
  return result;
}
EXPORT unsigned dhdGetButtonMask(char) {
  return static_cast<unsigned>(mock().buttons.load());
}
EXPORT int dhdGetPositionAndOrientationFrame(double* x, double* y, double* z, double (*frame)[3], char) {
  const int result = call();
  if (result < 0) return result;
  const MockDevice& m = mock();
  *x = m.x, *y = m.y, *z = m.z;
  if (m.fault == MockDevice::kNotFinite) *y = std::numeric_limits<double>::quiet_NaN();
  if (m.fault == MockDevice::kFar) *x = 9;
  const double c = std::cos(m.turn_x), s = std::sin(m.turn_x);
  const double rows[3][3] = {{1, 0, 0}, {0, c, -s}, {0, s, c}};
  std::copy_n(&rows[0][0], 9, &frame[0][0]);
  if (m.fault == MockDevice::kSkewed) frame[0][1] = 0.7;
  return result;
}
EXPORT int dhdEnableForce(unsigned char value, char) {
  const int result = call();
  if (result < 0) return result;
  mock().on = value;
  if (value != 0) {
    mock().cause = 0;
    mock().force_ns = mock().clock_ns();
  }
  return result;
}
EXPORT int dhdSetForce(double x, double y, double z, char) {
  const int result = call();
  if (result < 0) return result;
  MockDevice& m = mock();
  if (!std::isfinite(x + y + z)) ++m.not_finite;
  m.fx = x, m.fy = y, m.fz = z;
  m.force_ns = m.clock_ns();
  const double norm = std::sqrt(x * x + y * y + z * z);
  m.forces += norm > 0 ? 1 : 0;
  m.largest = std::max(m.largest.load(), norm);
  return result;
}
EXPORT int dhdGetForce(double* x, double* y, double* z, char) {
  const MockDevice& m = mock();
  *x = m.gives * m.fx, *y = m.gives * m.fy, *z = m.gives * m.fz;
  return 0;
}
EXPORT int dhdSetMaxForce(double, char) {
  return 0;
}
EXPORT double dhdGetMaxForce(char) {
  return 12;
}
EXPORT int dhdStop(char) {
  mock().on = 0;
  return 0;
}
EXPORT int dhdEnableExpertMode() {
  return 0;
}
#ifndef STYLET_MOCK_OLD
EXPORT int dhdSetWatchdog(unsigned char value, char) {
  if (mock().deaf != 0) return fail(9);
  mock().watch_dog = value;
  return 0;
}
#endif
EXPORT int dhdGetWatchdog(unsigned char* value, char) {
  *value = static_cast<unsigned char>(mock().watch_dog.load());
  return 0;
}
EXPORT int dhdErrorGetLast() {
  return last_error;
}
EXPORT const char* dhdErrorGetLastStr() {
  return last_error == 20 ? "device already opened" : "communication error";
}
