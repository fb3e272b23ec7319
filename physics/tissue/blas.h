// Which BLAS the process runs on, and making it behave: CHOLMOD's speed hangs on it.
#pragma once

#include <string>

namespace stylet::physics {

struct BlasLibrary {
  std::string name{};           ///< such as "OpenBLAS 0.3.21 ... Haswell", for --version and logs
  bool slow_reference = false;  ///< not known to be an optimised BLAS: factorisation 15-20 times slower; warn
  /// OpenBLAS did not know the processor, newer than itself, and took its kernels for one without AVX.
  bool outdated_kernels = false;
};

/// The BLAS of this process, set to one thread at the first call (the same bits every run; the loops own the cores).
/// Every SolveWorkspace begins with it. Any thread.
const BlasLibrary& single_threaded_blas();

/// Keeps OpenMP regions entered by the calling thread to that thread. CHOLMOD opens some inside a factorisation:
/// their teams would spin on the cores of the haptic loop.
void disable_openmp_teams();

}  // namespace stylet::physics
