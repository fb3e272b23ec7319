#include "engine/debrief/skin_entry.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <limits>

namespace stylet::debrief {

namespace {

bool inside(const PathPoint& p) {
  return p.inserted > 0;
}

}  // namespace

std::optional<double> skin_entry_s(const std::vector<PathPoint>& path) {
  const auto first = std::ranges::find_if(path, inside);
  if (first == path.end()) return std::nullopt;
  return first == path.begin() ? first->time_s : std::prev(first)->time_s;
}

std::vector<double> depth_from_entry(const std::vector<PathPoint>& path) {
  std::vector<double> depth(path.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < path.size();) {
    if (inside(path[i])) {
      depth[i] = path[i].inserted;
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < path.size() && !inside(path[end])) ++end;
    for (std::size_t k = i; k < end; ++k) {
      double distance = std::numeric_limits<double>::infinity();
      if (end < path.size()) distance = std::min(distance, (path[k].tip - path[end - 1].tip).norm());
      if (i > 0) distance = std::min(distance, (path[k].tip - path[i].tip).norm());
      if (distance < std::numeric_limits<double>::infinity()) depth[k] = -distance;
    }
    i = end;
  }
  return depth;
}

}  // namespace stylet::debrief
