// The standard normal distribution.
#pragma once

namespace stylet::lab::statistics {

double normal_density(double z);
/// P(Z <= z)
double normal_cdf(double z);
/// z with P(Z <= z) = p. @param p  within (0, 1)
double normal_quantile(double p);

}  // namespace stylet::lab::statistics
