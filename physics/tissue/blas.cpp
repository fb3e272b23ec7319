#include "physics/tissue/blas.h"

#include <dlfcn.h>

namespace stylet::physics {
namespace {

template <typename Function>
Function find(const char* symbol) {
  return reinterpret_cast<Function>(dlsym(RTLD_DEFAULT, symbol));
}

BlasLibrary set_to_one_thread() {
  // Found at run time: BLAS is chosen by the system's alternatives, not when we link.
  if (const auto set_threads = find<void (*)(int)>("openblas_set_num_threads")) {
    set_threads(1);
    const auto config = find<const char* (*)()>("openblas_get_config");
    BlasLibrary blas{.name = config != nullptr ? config() : "OpenBLAS"};
    blas.outdated_kernels = blas.name.find(" Prescott ") != std::string::npos && __builtin_cpu_supports("avx2") != 0;
    return blas;
  }
  if (const auto set_threads = find<void (*)(int)>("MKL_Set_Num_Threads")) {
    set_threads(1);
    return {.name = "MKL"};
  }
  if (const auto set_threads = find<void (*)(long)>("bli_thread_set_num_threads")) {
    set_threads(1);
    return {.name = "BLIS"};
  }
  if (find<void (*)()>("ATL_buildinfo") != nullptr) return {.name = "ATLAS"};
  return {.name = "reference BLAS", .slow_reference = true};
}

}  // namespace

const BlasLibrary& single_threaded_blas() {
  static const BlasLibrary blas = set_to_one_thread();
  return blas;
}

void disable_openmp_teams() {
  static const auto set_max_active_levels = find<void (*)(int)>("omp_set_max_active_levels");
  if (set_max_active_levels != nullptr) set_max_active_levels(0);
}

}  // namespace stylet::physics
