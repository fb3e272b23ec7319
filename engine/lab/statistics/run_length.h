// When a chart of sequential.h signals, exactly: the sums that it can have are a few hundred, so their probabilities
// are carried from attempt to attempt, and no limit is taken from folklore. In the literature of LC-CUSUM the
// probability of a signal of who is acceptable is the "true discovery", of who is unacceptable the "false discovery"
// (not the rate of Benjamini and Hochberg).
#pragma once

#include "engine/lab/statistics/sequential.h"

#include <span>
#include <vector>

namespace stylet::lab::statistics {

/// An attempt as a chart meets it.
struct AttemptLaw {
  Weights weights;
  double failure_rate = 0;  ///< of the trainee in this attempt
};

/// P(signal at or before attempt t) for t = 1, 2, ...; attempts are independent.
std::vector<double> signal_by(std::span<const AttemptLaw> attempts, double limit);
/// The same of `attempts` that are alike; the last of them.
double signal_within(const AttemptLaw& law, int attempts, double limit);
/// Expected attempts to the signal, by summing the survival with a geometric tail. @param law  whose failure rate is
/// above 0 and below 1
double mean_run_length(const AttemptLaw& law, double limit);

/// Attempts of which none must fail until the first signal is possible.
int shortest_run(const Weights& learning, double limit);

/// Smallest limit of an LC-CUSUM, in hundredths, with P(signal within `horizon` | unacceptable) <= `false_discovery`.
double learning_limit(const FailureRates& rates, int horizon, double false_discovery);
/// Smallest limit of a CUSUM, in hundredths, with P(alarm within `horizon` | acceptable) <= `false_alarm`.
double monitoring_limit(const FailureRates& rates, int horizon, double false_alarm);

/// A gate as a course has it: its limit and what that means.
struct Gate {
  double limit = 0;
  int horizon = 0;       ///< attempts
  int shortest_run = 0;  ///< attempts
  double true_discovery = 0;
  double false_discovery = 0;
  double mean_attempts = 0;  ///< of who is acceptable
};
Gate learning_gate(const FailureRates& rates, int horizon, double false_discovery);

}  // namespace stylet::lab::statistics
