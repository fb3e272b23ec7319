// The low-rate loop by mesh size. The paper gives no figures for it.
#pragma once

#include "tools/bench/report.h"
#include "tools/bench/tissue_timing.h"

#include <span>

namespace stylet::bench {

/// Medians of SimulationLoop::step() with 16 rows. lowrate.<nodes>.step, ms, and .rate, 1/s: the factorisation worker
/// running in a thread of its own, as in a session; .step.p99, ms. .step.alone, ms, and .rate.alone, 1/s: no other
/// thread. .factorisation, ms: assembly, factorisation and first columns in the worker. References: SOFA with the
/// needle-insertion plugins, asynchronous LDL, 15 constraint lines, one thread of a 2-core cloud machine of 2025.
Report paper_lowrate(std::span<const TissueTiming> meshes);

}  // namespace stylet::bench
