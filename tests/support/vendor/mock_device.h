// What a test and a mocked vendor's library share, in a file that STYLET_MOCK_DEVICE names: the hand, what is wrong,
// and what the motors were told.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <string>

namespace stylet::support {

/// Zeros at first, but for what MockDevice::reset() sets. Atomics: several processes look at it.
struct MockDevice {
  enum Fault : int {
    kNone,
    kErrors,  ///< every call fails, and may go well again
    kHangs,   ///< a call takes as long as this lasts
    kNotFinite,
    kSkewed,  ///< its rotation is none
    kFar,     ///< it says that it is 9 m away
    kPulledOut,
    kBrake,  ///< moved too fast: motors short-circuited
    kNotHomed,
    kNoPower,
    kCached,  ///< success of another kind: TIMEGUARD
    kSaturated,
    kFrozen,  ///< its joints stand at zero
    kUncalibrated,
  };

  // By the test.
  std::atomic<std::int64_t> now_ns;  ///< of its clock; 0: CLOCK_MONOTONIC
  std::atomic<int> fault;
  std::atomic<int> devices;      ///< that are plugged in
  std::atomic<int> open_error;   ///< of the library; 0: it opens
  std::atomic<int> major;        ///< of its version
  std::atomic<int> deaf;         ///< its firmware has no watch-dog
  std::atomic<int> status_size;  ///< entries that it knows
  std::atomic<double> x, y, z;   ///< as the library gives it
  std::atomic<double> turn_x;    ///< rad about its own first axis
  std::atomic<int> buttons;
  std::atomic<int> styles;    ///< of calibration, a mask
  std::atomic<double> gives;  ///< what it says that its motors give, over what they were told

  // By the library.
  std::atomic<double> fx, fy, fz;  ///< as it was told
  std::atomic<std::int64_t> force_ns;
  std::atomic<int> on;  ///< motors
  std::atomic<int> cause;
  std::atomic<int> open;
  std::atomic<int> closed;  ///< times
  std::atomic<int> watch_dog;
  std::atomic<int> calibrated_by;         ///< the style it was asked for
  std::atomic<std::uint64_t> forces;      ///< that were not zero
  std::atomic<std::uint64_t> not_finite;  ///< forces
  std::atomic<std::uint64_t> broken;      ///< calls that its documentation does not allow
  std::atomic<double> largest;
  std::atomic<std::uint64_t> calls;
  std::atomic<std::int64_t> process;  ///< that has loaded it

  void reset() {
    now_ns = 0, fault = kNone, devices = 1, open_error = 0, major = 3, deaf = 0, status_size = 17;
    x = y = z = turn_x = 0;
    buttons = 0, styles = 2, calibrated_by = 0;
    fx = fy = fz = 0;
    force_ns = 0, on = 0, cause = 0, open = 0, closed = 0, watch_dog = 0;
    forces = not_finite = broken = calls = 0;
    largest = 0;
    gives = 1;
    process = 0;
  }
  std::int64_t clock_ns() const {
    if (now_ns != 0) return now_ns;
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1'000'000'000LL + now.tv_nsec;
  }
  bool barks() const { return watch_dog > 0 && clock_ns() - force_ns >= watch_dog * 125'000LL; }
  /// N, what the motors give.
  double applied() const {
    if (on == 0 || fault == kPulledOut || fault == kNoPower || fault == kBrake || barks()) return 0;
    return __builtin_sqrt(fx * fx + fy * fy + fz * fz);
  }
};

/// The file of STYLET_MOCK_DEVICE, made where it is not there.
inline MockDevice* mock_device() {
  const char* name = std::getenv("STYLET_MOCK_DEVICE");
  const int file = open(name != nullptr ? name : "/dev/null", O_RDWR | O_CREAT, 0600);
  if (file < 0 || ftruncate(file, sizeof(MockDevice)) != 0) std::abort();
  void* memory = mmap(nullptr, sizeof(MockDevice), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  if (memory == MAP_FAILED) std::abort();
  return static_cast<MockDevice*>(memory);
}

}  // namespace stylet::support
