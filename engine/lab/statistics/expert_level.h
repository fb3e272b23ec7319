// Where the bar lies: from what recorded experts do, or between two groups.
#pragma once

#include <optional>
#include <span>

namespace stylet::lab::statistics {

struct GroupLevel {
  double mean = 0;
  double sd = 0;  ///< with n - 1
  int people = 0;
};

/// Of one value a person (the mean of the attempts). @param means  two people and more
GroupLevel group_level(std::span<const double> means);
/// The same without those further than two SDs from the mean of all.
GroupLevel trimmed_level(std::span<const double> means);

/// Standard error of mean -+ two SDs, in SDs: sqrt(1/n + 4/(2 (n - 1))).
double lenient_bar_error(int people);

/// k such that mean - k SD of n experts is below a `share` of all experts with `confidence`: normal tolerance bound,
/// by the noncentral t distribution.
double tolerance_factor(int people, double share = 0.90, double confidence = 0.95);

/// Contrasting groups: the score at which both groups' normal densities are equal, between their means.
struct ContrastingGroups {
  double cut = 0;
  double false_pass = 0;  ///< share of the lower group above the cut
  double false_fail = 0;  ///< share of the higher group below it
};
/// @return nothing: no cut lies between the means
std::optional<ContrastingGroups> contrasting_groups(const GroupLevel& lower, const GroupLevel& higher);

}  // namespace stylet::lab::statistics
