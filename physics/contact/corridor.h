// The nodes of a body that the haptic loop will need before the next patch.
#pragma once

#include "physics/messages/messages.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace stylet::physics {

/// Nodes around the needle's track in a body and around the line that its tip goes on along: of the tetrahedra there
/// and of their neighbours, so that a needle that bends, in tissue that gives way, stays within. Most needed first,
/// distinct, at most `most`.
/// @param positions  of the body [3 x nodes], m
/// @param needle     at least two nodes, finite
/// @param range      ahead of the tip, m
std::vector<int> corridor_nodes(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                                const NeedleState& needle, int body, double range, std::size_t most);

/// The nodes around some, of all tetrahedra that have one of them, in their order; distinct, at most `most`.
std::vector<int> nodes_around(const TissueModel& model, std::span<const int> nodes, std::size_t most);

/// How deep a tip that presses on a body has dented it, m; 0 where it does not. When the surface breaks, that much
/// tissue comes back over the tip.
double dent(const TissueModel& model, const NeedleState& needle, int body);

}  // namespace stylet::physics
