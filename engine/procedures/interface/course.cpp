#include "engine/procedures/interface/course.h"

#include <algorithm>

namespace stylet::procedures {

int nearest_target(const Situation& situation) {
  const auto& distances = situation.target_distances;
  const auto nearest = std::ranges::min_element(distances);
  return distances.empty() ? -1 : static_cast<int>(nearest - distances.begin());
}

}  // namespace stylet::procedures
