// The parts of `stylet bench coupling`, each with its rows and, where there is a folder, its figure.
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/figure_files.h"
#include "tools/bench/report.h"
#include "tools/reference/reference_insertion.h"

#include <memory>
#include <string>
#include <vector>

namespace stylet::bench {

inline constexpr double kPercent = 100;

/// R1 with straight edges (paper_updated) and with the cubic shaft, sub-grid compliance and friction off: shaft.*
Report coupling_shaft(const reference::ReferenceInsertion& insertion, const BenchOptions& options);
/// R1 at 25 Hz, one step late, everything on but friction: sync.*
Report coupling_synchronisation(const reference::ReferenceInsertion& insertion, const BenchOptions& options);
/// R1 over meshes and contact spacings with and without sub-grid compliance, condition of the contact system, and the
/// indentation at puncture: subgrid.*
Report coupling_subgrid(const reference::ReferenceInsertion& insertion, const BenchOptions& options);
/// W_bar from the trailing block of the factor: time, error against full solves: w_bar.*
Report coupling_w_bar(const reference::ReferenceInsertion& insertion, const BenchOptions& options);
/// Force over depth with puncture, cutting and friction, the work done, LuGre beside Coulomb friction, other haptic
/// rates, and the classical models on the same motion: resistance.*
Report coupling_resistance(const reference::ReferenceInsertion& insertion, const BenchOptions& options);
/// Time of the haptic step and of the solver: speed.*
Report coupling_speed(const reference::ReferenceInsertion& insertion, const BenchOptions& options);

/// A tissue map of one tissue.
std::shared_ptr<const physics::TissueMap> one_tissue(const physics::InsertionResistance& resistance);
/// Liver and its capsule: 1.8 N at puncture, 0.94 N cutting, 18 N/m friction (Okamura et al. 2004).
physics::InsertionResistance liver_resistance();
/// (max - min) / mean.
double relative_spread(const std::vector<double>& values);
/// A line in the index-th colour of a light figure.
figures::PlotSeries plot_line(std::string label, std::vector<double> x, std::vector<double> y, int index);

}  // namespace stylet::bench
