// How a validation test shows what it measured: the residual beside its bound.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace stylet::validation {

/// Prints one line `name: value (bound ...)` and expects value <= bound. A value that is not a number fails.
inline void report_residual(const std::string& name, double value, double bound) {
  std::printf("  %s: %.3e (bound %.1e)\n", name.c_str(), value, bound);
  EXPECT_LE(value, bound) << name;
}

}  // namespace stylet::validation
