// What the needle's track brings to the contact system of a step, and how it is set up.
#pragma once

#include "physics/contact/active_contact.h"
#include "physics/contact/bounded_solver.h"
#include "physics/contact/lugre.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace stylet::physics {

/// Of the shaft in tissue: sticks until a bound is reached, or is held by bristles that bend and slip all the time.
enum class ShaftFriction : std::uint8_t { coulomb, lugre };

struct NeedleTrackSettings {
  double spacing = 0.010;          ///< between contact points along the shaft, m
  bool straight_edges = false;     ///< of the shaft, as the paper has them: to show what the cubic one is worth
  bool subgrid_compliance = true;  ///< of shaft and tip, README eq. 19-21
  double bevel_ratio = 0;   ///< lateral over axial force on the tip that cuts; pushes away from the bevel's face
  double tip_friction = 1;  ///< Coulomb, sideways, of a tip that presses on something
  /// Of the area that a tip presses on in tissue that does not stiffen, m: more than the needle's own, since nothing
  /// else spreads the load there.
  double tip_radius = 5e-3;
  double side_length = 2e-3;       ///< over which a tip that cuts loses what presses it sideways, m
  double reentry_distance = 2e-3;  ///< a tip that touches a body this close to its old hole goes in there, m
  double tear_distance = 5e-3;     ///< a shaft cut so far out of a body sideways is held by nothing any more, m
  ShaftFriction friction = ShaftFriction::coulomb;
  LugreConstants lugre{};
};

/// The contact system of a step, filled by NeedleTrack::place(). All memory is taken in the constructor.
struct TrackRows {
  TrackRows();
  int contact_count = 0;
  int row_count = 0;
  std::vector<ActiveContact> contacts;  ///< [contact_count] hub to tip, the tip's own last
  std::vector<ContactRow> laws;         ///< [row_count]
  Eigen::VectorXd slip;                 ///< [row_count] how far needle material has slid past the point so far, m
};

}  // namespace stylet::physics
