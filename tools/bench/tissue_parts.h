// The sections of `stylet bench tissue`, a file each.
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/report.h"

namespace stylet::bench {

/// Compliance of wall and liver of the shipped patient where needle and probe load them, by element, over that of
/// quadratic elements twice refined; nodes, factor and step of each: compliance.*
Report tissue_compliance(const BenchOptions& options);

/// A needle at 3 mm/s into a block of bovine liver, beside what is published of it: okamura.*
Report tissue_okamura(const BenchOptions& options);

/// Step and factorisation of cubes of 5,832 and 19,683 nodes beside the way before, and their bytes: speed.*
Report tissue_speed(const BenchOptions& options);

}  // namespace stylet::bench
