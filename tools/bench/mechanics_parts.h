// The parts of `stylet bench mechanics`.
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/report.h"

namespace stylet::bench {

/// Organs against organs at haptic rate: energy, overlap, settling, cost: organs.*
Report mechanics_organs(const BenchOptions& options);
/// A bevelled tip: side, curvature against theory, speed, tissue: bevel.*
Report mechanics_bevel(const BenchOptions& options);
/// No energy from a frictionless needle that pushes one block on another, and from one body: passivity.*
Report mechanics_passivity(const BenchOptions& options);
/// A needle that yields, tissue cut sideways, a shaft that is turned, and what that costs: limits.*
Report mechanics_limits(const BenchOptions& options);

/// The probe pressed 40 mm deep at up to 200 mm/s, rocked, tilted and lifted: probe.*
Report mechanics_probe(const BenchOptions& options);

/// Breathing while a needle goes in: breath.*
Report mechanics_breath(const BenchOptions& options);

/// Fast hands and stalls in every scenario: surfaces missed, against brute force: swept.*
Report mechanics_swept(const BenchOptions& options);
/// Late patches: what the force does that it does not without latency: latency.*
Report mechanics_latency(const BenchOptions& options);

}  // namespace stylet::bench
