#include "engine/procedures/interface/course.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace stylet::procedures {

int nearest_target(const Situation& situation) {
  const auto& distances = situation.target_distances;
  const auto nearest = std::ranges::min_element(distances);
  return distances.empty() ? -1 : static_cast<int>(nearest - distances.begin());
}

std::string with_control(std::string_view what, const std::string& control) {
  return control.empty() ? std::string(what) : fmt::format("{} ({})", what, control);
}

std::string place_of_free_tip(const Situation& situation) {
  std::string place = situation.in_patient()
                          ? fmt::format("between two organs, {:.0f} mm of needle in", 1e3 * situation.depth)
                          : "outside the patient";
  const int target = nearest_target(situation);
  const double distance = target >= 0 ? situation.target_distances[target] : -1;
  if (std::isfinite(distance) && distance > 0) place += fmt::format(", {:.0f} mm from the target", 1e3 * distance);
  return place;
}

}  // namespace stylet::procedures
