// Whether a metric tells two groups apart: Mann and Whitney's test and the area under the ROC curve.
#pragma once

#include "engine/lab/statistics/proportion.h"

#include <cstdint>
#include <span>
#include <vector>

namespace stylet::lab::statistics {

struct MannWhitney {
  double u = 0;    ///< pairs in which the first group has the larger value, ties half
  double auc = 0;  ///< u / (n1 n2): P(first > second) + P(equal) / 2
  double p = 0;    ///< two-sided: exact where nothing is tied and groups are small, else the normal approximation
};
/// @param first, second  none empty
MannWhitney mann_whitney(std::span<const double> first, std::span<const double> second);

/// Standard error of an AUC (Hanley and McNeil, Radiology 143 (1982) 29).
double auc_standard_error(double auc, int first, int second);
/// Distance of two normals of one SD that have this AUC, in SDs: sqrt(2) PHI^-1(AUC).
double separation(double auc);

/// Values of one person.
using PersonValues = std::vector<double>;
/// 95 % interval of the AUC of people's means, by drawing people, not attempts, anew. Same seed, same interval.
Interval auc_interval(std::span<const PersonValues> first, std::span<const PersonValues> second, int draws = 2000,
                      std::uint64_t seed = 1);

}  // namespace stylet::lab::statistics
