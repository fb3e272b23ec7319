// `stylet bench paper`: the tables and figures of Martin, Zeng and Courtecuisse (IROS 2023), measured here, beside
// the paper's own numbers.
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/report.h"

namespace stylet::bench {

/// Everything below, one after the other. Prints its progress to stderr.
/// @throws std::runtime_error if the experiment cannot be read or a file not be written
Report bench_paper(const BenchOptions& options);

/// Table I: time of the haptic step and its stages, with and without constraints; speed by rows; machine's limit.
Report paper_table1(const BenchOptions& options);

/// The same haptic problems by Gauss-Seidel on a frozen linearisation (Peterlik 2011) beside ours.
Report paper_peer(const BenchOptions& options);

}  // namespace stylet::bench
