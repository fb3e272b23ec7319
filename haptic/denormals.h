// Denormal numbers are flushed to zero in the loops: on x86 they cost a hundred times a normal operation.
#pragma once

#include <xmmintrin.h>

namespace stylet::haptic {

/// Within its life the calling thread flushes denormals (FTZ and DAZ). The result of a step depends on it, so a
/// thread that repeats haptic steps for replay must hold one as the real-time thread does.
class FlushDenormals {
public:
  FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | kFlushToZero | kDenormalsAreZero); }
  ~FlushDenormals() { _mm_setcsr(saved_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

private:
  static constexpr unsigned kFlushToZero = 0x8000;
  static constexpr unsigned kDenormalsAreZero = 0x0040;
  unsigned saved_;
};

}  // namespace stylet::haptic
