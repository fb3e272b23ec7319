// What a few passes say of a pass rate.
#pragma once

namespace stylet::lab::statistics {

struct Interval {
  double low = 0;
  double high = 0;
};

/// Wilson's score interval of a proportion (J Am Stat Assoc 22 (1927) 209). @param z  1.96: 95 %
Interval wilson(int passes, int attempts, double z = 1.959963984540054);

/// Upper bound of the failure rate after a run of passes alone: 1 - (1 - confidence)^(1/n).
double failure_bound(int passes, double confidence = 0.95);

/// P(some k attempts in a row pass within n): what "k in a row" is worth as a gate.
double in_a_row_within(int k, int attempts, double pass_rate);

}  // namespace stylet::lab::statistics
