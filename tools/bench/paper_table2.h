// Table II and the gain of isolated degrees of freedom, by mesh size, beside the paper's figures.
#pragma once

#include "tools/bench/report.h"
#include "tools/bench/tissue_timing.h"

#include <span>

namespace stylet::bench {

/// table2.<nodes>.isodofs, .w_v, .x_iso, .synchronisation.simulation, .w_bar, .synchronisation.haptic, .haptic_step:
/// medians, us; table2.haptic_step.ratio: the largest mesh over the smallest. What the simulation loop does to hand a
/// step over is .synchronisation.simulation, with W_bar left out, and .w_bar, which writes it in place.
Report paper_table2(std::span<const TissueTiming> meshes);

/// isodofs.<nodes>.row_solves, .from_scratch, .incremental, .unchanged: medians, us; .gain: row_solves over
/// incremental; .residual: relative difference of the operators.
Report paper_isodofs_gain(std::span<const TissueTiming> meshes);

}  // namespace stylet::bench
