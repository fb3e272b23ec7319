// The sections of `stylet bench tissue`, a file each.
#pragma once

#include "tools/bench/bench_options.h"
#include "tools/bench/report.h"

namespace stylet::bench {

/// Nodes of the abdominal wall of linear tetrahedra that the scenarios had before their elements were quadratic.
inline constexpr int kLinearWallNodes = 1650;

/// A bar of 10 x 2 x 2 cells bent by its end, over Timoshenko's beam, by element and Poisson's ratio: cantilever.*
Report tissue_cantilever(const BenchOptions& options);

/// Eigenvalues of the quadratic element, and of a free cube of them: elements.*
Report tissue_elements(const BenchOptions& options);

/// Compliance of wall and liver of the shipped patient where needle and probe load them, by element, over that of a
/// mesh of many quadratic elements with the same tissues and holds in space; nodes, factor and step of each:
/// compliance.*
Report tissue_compliance(const BenchOptions& options);

/// The recorded motions of the shipped scenarios by element: how far tissue is compressed, how long a simulation step
/// takes: sessions.*
Report tissue_sessions(const BenchOptions& options);

/// A needle at 3 mm/s into a block of bovine liver, beside what is published of it: okamura.*
Report tissue_okamura(const BenchOptions& options);

/// The needles of shipped scenarios against their liver: force over dent until its capsule breaks, what of the force
/// fades and of the work is lost: capsule.*
Report tissue_capsule(const BenchOptions& options);

/// Step and factorisation of cubes of 5,832 and 19,683 nodes beside the way before, and their bytes: speed.*
Report tissue_speed(const BenchOptions& options);

/// `liver_biopsy_fine` in threads, led by its recorded hand: rates, missed deadlines and steps of its loops: fine.*
Report tissue_fine(const BenchOptions& options);

}  // namespace stylet::bench
