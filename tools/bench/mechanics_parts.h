// The parts of `stylet bench mechanics`.
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/report.h"

namespace stylet::bench {

/// A bevelled tip: side, curvature against theory, speed, tissue: bevel.*
Report mechanics_bevel(const BenchOptions& options);

}  // namespace stylet::bench
