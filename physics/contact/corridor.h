// The nodes of a body that the haptic loop will need before the next patch.
#pragma once

#include "physics/messages/messages.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <vector>

namespace stylet::physics {

/// A tip that has passed a surface by less than this is still found there: the needle goes on while a patch is made.
/// m
inline constexpr double kPassed = 8e-3;

/// Nodes around the needle's track in a body and around the line that its tip goes on along: of the tetrahedra there
/// and of their neighbours, so that a needle that bends, in tissue that gives way, stays within. Most needed first,
/// distinct, at most `most`.
/// @param positions  of the body [3 x nodes], m
/// @param needle     at least two nodes, finite
/// @param range      ahead of the tip, m
std::vector<int> corridor_nodes(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                                const NeedleState& needle, int body, double range, std::size_t most);

}  // namespace stylet::physics
