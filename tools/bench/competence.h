// `stylet bench competence`: the statistics of the skills lab, against exact values, published tables and simulated
// trainees.
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/report.h"

namespace stylet::bench {

/// Simulated run lengths beside the exact chain's; published tables; 10,000 simulated trainees: how early and how
/// wrongly competence is declared, by an LC-CUSUM, by passes in a row and after a fixed number of attempts; and
/// what the records of 10,000 attempts cost. No device, no scenario. (quick: 2,000 trainees, 500 attempts)
Report bench_competence(const BenchOptions& options);

}  // namespace stylet::bench
