// Timings of something done many times, and what is quoted of them.
#pragma once

#include "tools/bench/report.h"

#include <chrono>
#include <string>
#include <vector>

namespace stylet::bench {

using Clock = std::chrono::steady_clock;

inline double microseconds(Clock::duration d) {
  return std::chrono::duration<double, std::micro>(d).count();
}

/// Durations in microseconds.
class Samples {
public:
  /// @param expected  how many, so that adding one takes no memory while the clock runs
  explicit Samples(std::size_t expected = 0) { values_.reserve(expected); }

  void add(double us) { values_.push_back(us); }
  void add(Clock::duration d) { values_.push_back(microseconds(d)); }
  /// Times one call.
  template <typename Function>
  void time(Function&& function) {
    const auto start = Clock::now();
    function();
    add(Clock::now() - start);
  }

  std::size_t count() const { return values_.size(); }
  const std::vector<double>& values() const { return values_; }
  // All 0 without samples.
  double average() const;
  double max() const;
  double median() const { return quantile(0.5); }
  double p99() const { return quantile(0.99); }
  /// Smallest sample that at least this fraction of all do not exceed.
  double quantile(double fraction) const;

private:
  std::vector<double> values_;
};

/// Adds name.average, name.max, name.median and name.p99, in us.
void add_quantiles(Report& report, const std::string& name, const Samples& samples,
                   std::optional<double> average_reference = {}, std::optional<double> max_reference = {});

}  // namespace stylet::bench
