// How the haptic loop is set up.
#pragma once

#include "physics/contact/bounded_solver.h"
#include "physics/contact/tissue_map.h"
#include "physics/contact/track_rows.h"
#include "physics/needle/needle.h"

#include <memory>

namespace stylet::physics {

/// How contacts follow the needle between two simulation steps. In the paper's couplings the simulation loop lays
/// them.
enum class Coupling {
  paper_frozen,  ///< locations on the needle and directions as the simulation step laid them (Peterlik 2011)
  /// Tissue points projected anew on the shaft every haptic step (the paper), directions normal to the needle's
  /// straight edge there: what IV-C explains the peaks of Fig. 3 by.
  paper_updated,
  /// The same, but directions normal to the needle's trajectory, the line of the contact points in the volume: III-C.
  paper_trajectory,
  stylet,  ///< smooth shaft; contacts laid, cut and broken through in the haptic loop, which owns the needle's track
};

struct HapticLoopSettings {
  NeedleProperties needle;
  NeedleBase base;
  Coupling coupling = Coupling::paper_updated;
  NeedleTrackSettings track{};                 ///< `stylet` only
  std::shared_ptr<const TissueMap> tissues{};  ///< what resists the needle, `stylet` only; null: nothing does
  /// Compliance of every row as a fraction of mean(diag W_v). Contacts that share a tetrahedron and an edge of the
  /// needle make rows of W nearly dependent (condition 1e19 at 5 mm spacing on a coarse mesh, and forces of hundreds
  /// of newtons from rounding); this bounds them at a cost of 0.1 % of softness. 0 is the paper's exact system.
  /// `stylet` has it only in rows without sub-grid compliance.
  double relative_compliance = 1e-3;
  BoundedSolveLimits solve_limits{};  ///< of the bounded solve, `stylet` only: what a step may cost at most
  double max_base_translation =
      1e-3;                          ///< m a step; more is spread over the next steps (one Newton step must suffice)
  double max_base_rotation = 20e-3;  ///< rad a step
  /// rad a step of any node; a longer Newton step is shortened to this. Less in `stylet`, where a needle that is bent
  /// far round few points would swing from step to step: its rows turn with it, which a Newton step leaves out.
  double max_node_rotation = 0.2;
  double max_node_rotation_stylet = 12e-3;
};

}  // namespace stylet::physics
