// A reference insertion in lockstep with an eye on every haptic step: what the paper's figures are drawn from.
#pragma once

#include "tools/reference/reference_insertion.h"

#include <Eigen/Core>

#include <vector>

namespace stylet::bench {

/// Change of the normal of each contact over one simulation step, between its first and its last haptic step, from
/// entry to tip: the greater of its two normals. Which of them comes first is a convention, and one across the plane
/// of bending does not change.
struct DirectionChanges {
  double time_s = 0;  ///< end of the step
  std::vector<double> norms;
};

/// Samples at every haptic step.
struct InsertionTrace {
  std::vector<double> time_s;
  std::vector<Eigen::Vector3d> forces;  ///< on the hand, N
  /// Sum over the contacts of the constraint force's component along the shaft where the contact now is, N. Bilateral
  /// rows are normal to the shaft, so this should be nothing (paper IV-B).
  std::vector<double> along_shaft;
  std::vector<DirectionChanges> direction_changes;  ///< one a simulation step
};

/// @param run  worker_period as in ReferenceRun
InsertionTrace trace_insertion(const reference::ReferenceInsertion& insertion, const reference::ReferenceRun& run);

}  // namespace stylet::bench
