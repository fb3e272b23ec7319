// `stylet bench coupling`: what the coupling `stylet` gains over the paper's, one number (and figure) a claim.
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/report.h"

namespace stylet::bench {

/// All parts, one after the other (coupling_parts.h). Prints its progress to stderr.
/// @throws std::runtime_error if the experiment cannot be read or a file not be written
Report bench_coupling(const BenchOptions& options);

}  // namespace stylet::bench
