// `stylet bench mechanics`: the physics outside the case it was built on, one number a claim.
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/report.h"

namespace stylet::bench {

/// All parts, one after the other (mechanics_parts.h). Prints its progress to stderr.
/// @throws std::runtime_error if content cannot be read or a file not be written
Report bench_mechanics(const BenchOptions& options);

}  // namespace stylet::bench
