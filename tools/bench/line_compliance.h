// `stylet bench line-compliance`: calibrates sub-grid compliance (physics/README.md eq. 19-21) against a needle
// resolved down to its radius, and shows what it makes of the dependence on the mesh.
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/report.h"

namespace stylet::bench {

/// @throws std::runtime_error if the experiment cannot be read or a file not be written
Report bench_line_compliance(const BenchOptions& options);

}  // namespace stylet::bench
