// Compiled for the oldest x86-64, and run before any other constructor: says in words what would otherwise be an
// illegal instruction.
#include <unistd.h>
#include <cstdlib>
#include <cstring>

namespace {

#ifdef STYLET_NEEDS_X86_64_V3
__attribute__((constructor(101))) void check_cpu() {
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2")) return;
  static const char message[] =
      "stylet: this build needs a CPU of the x86-64-v3 level (AVX2, FMA, BMI2; Intel Haswell or AMD Zen and later); "
      "build it for this machine with `cmake --preset native`\n";
  if (write(STDERR_FILENO, message, sizeof message - 1) < 0) std::_Exit(3);
  std::_Exit(2);
}
#endif

}  // namespace
