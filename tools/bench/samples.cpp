#include "tools/bench/samples.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace stylet::bench {

double Samples::average() const {
  if (values_.empty()) return 0;
  return std::accumulate(values_.begin(), values_.end(), 0.0) / static_cast<double>(values_.size());
}

double Samples::max() const {
  return values_.empty() ? 0 : *std::max_element(values_.begin(), values_.end());
}

double Samples::quantile(double fraction) const {
  if (values_.empty()) return 0;
  std::vector<double> sorted = values_;
  const double rank = std::ceil(fraction * static_cast<double>(sorted.size())) - 1;
  const auto nth = static_cast<std::ptrdiff_t>(std::clamp(rank, 0.0, static_cast<double>(sorted.size() - 1)));
  std::nth_element(sorted.begin(), sorted.begin() + nth, sorted.end());
  return sorted[nth];
}

void add_quantiles(Report& report, const std::string& name, const Samples& samples,
                   std::optional<double> average_reference, std::optional<double> max_reference) {
  report.add({name + ".average", samples.average(), "us", average_reference, {}, {}});
  report.add({name + ".max", samples.max(), "us", max_reference, {}, {}});
  report.add({name + ".median", samples.median(), "us", {}, {}, {}});
  report.add({name + ".p99", samples.p99(), "us", {}, {}, {}});
}

}  // namespace stylet::bench
