// Figures 2, 3 and 4 of the paper: their numbers, and with a folder their plots (PNG) and data (CSV).
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/report.h"
#include "tools/reference/reference_insertion.h"

namespace stylet::bench {

/// Fig. 2, change of the contact directions over a simulation step. For a straight and a curved insertion, over all
/// simulation steps with 8 contacts: fig2.<shape>.change (median), .change.max, and .ratio: the median over the
/// needle's edge length, 1/m; fig2.by_motion: that ratio by the way aside and the rate of the simulation.
/// Fig. 3, force across the insertion (Y), R1, coupling frozen, updated and trajectory: fig3.roughness.<coupling>,
/// fig3.jump.<coupling>, N, the same with one simulation step of latency, and fig3.along_shaft.<coupling>: largest
/// component of the constraint forces along the shaft, N.
Report paper_figures_2_and_3(const reference::ReferenceInsertion& insertion, const BenchOptions& options);

/// Fig. 4, the same at 1728 and 5832 nodes: fig4.<nodes>.roughness.<coupling>, fig4.<nodes>.jump.<coupling>.
Report paper_figure_4(const reference::ReferenceInsertion& insertion, const BenchOptions& options);

}  // namespace stylet::bench
