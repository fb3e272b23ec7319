// The length constants of sub-grid compliance, fitted to a resolved needle, beside those built in.
#pragma once

#include "tools/bench/report.h"
#include "tools/reference/resolved_needle.h"

namespace stylet::bench {

/// Name of a motion within a measurement's.
const char* name_of(reference::NeedleMotion motion);

/// ln alpha of lateral and axial rows at one Poisson's ratio: what every line through every mesh would need to be as
/// stiff as the resolved needle, and its least-squares line over the points' sum of squared weights. The cube's walls
/// are held, so that the far field of the coarse meshes does not spoil the constants.
/// @param quick  one mesh size and a coarse resolved needle
Report calibrate_subgrid(reference::ResolvedCube cube, double nu, bool quick);

}  // namespace stylet::bench
