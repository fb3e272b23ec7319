#include "engine/procedures/ablation/electrode.h"

#include "engine/content/segment.h"

#include <algorithm>
#include <cmath>

namespace stylet::procedures::ablation {
namespace {

/// Equation (1) of the header.
double field_squared(const Eigen::Vector3d& x, const Electrode& electrode) {
  const Eigen::Vector3d r1 = x - electrode.tip;
  const Eigen::Vector3d r2 = x - electrode.base;
  const double d1 = r1.norm();
  const double d2 = r2.norm();
  const double length = (electrode.base - electrode.tip).norm();
  const double s = d1 + d2;
  const double focal = (s - length) * (s + length);
  return (1 + r1.dot(r2) / (d1 * d2)) / (focal * focal);
}

}  // namespace

std::vector<double> power_density(const CellGrid& grid, const Electrode& electrode) {
  std::vector<double> share(grid.count(), 0.0);
  double sum = 0;
  for (int k = 0; k < grid.size.z(); ++k) {
    for (int j = 0; j < grid.size.y(); ++j) {
      for (int i = 0; i < grid.size.x(); ++i) {
        const Eigen::Vector3d centre = grid.centre(i, j, k);
        // The field varies most over the cells at the electrode: their mean needs more points.
        const double cells_off = content::distance_to_segment(centre, electrode.tip, electrode.base) / grid.spacing;
        const int points = cells_off < 2 ? 8 : cells_off < 5 ? 3 : 1;
        double mean = 0;
        for (int p = 0; p < points * points * points; ++p) {
          const Eigen::Array3d at(p % points, p / points % points, p / (points * points));
          const Eigen::Vector3d x = centre + grid.spacing * ((at + 0.5) / points - 0.5).matrix();
          if (content::distance_to_segment(x, electrode.tip, electrode.base) < electrode.radius) continue;
          mean += field_squared(x, electrode) / (points * points * points);
        }
        share[grid.index(i, j, k)] = mean;
        sum += mean;
      }
    }
  }
  for (double& value : share) value /= sum * grid.volume();
  return share;
}

}  // namespace stylet::procedures::ablation
