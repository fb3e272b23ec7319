// `stylet bench tissue`: how right the tissue is, and what that costs.
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/report.h"

namespace stylet::bench {

/// All sections, one after the other (tissue_parts.h). Prints its progress to stderr.
/// @throws std::runtime_error if content cannot be read or a body not be factorized
Report bench_tissue(const BenchOptions& options);

}  // namespace stylet::bench
