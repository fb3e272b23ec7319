// Where two ways of a needle can be laid on each other: the moment it enters the skin.
#pragma once

#include "engine/debrief/debrief_data.h"

#include <optional>
#include <vector>

namespace stylet::debrief {

/// The last moment before the needle is in tissue for the first time; none: it never is.
std::optional<double> skin_entry_s(const std::vector<PathPoint>& path);

/// Of each moment the depth of the tip from the entry, m: in tissue the needle behind the skin; outside, negative,
/// how far the tip is from where it goes in next or came out last, whichever is nearer, so that the force with which
/// it dents the skin lies before 0 and the puncture at 0. NaN: never in tissue.
std::vector<double> depth_from_entry(const std::vector<PathPoint>& path);

}  // namespace stylet::debrief
