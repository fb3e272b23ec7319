#include "engine/lab/statistics/run_length.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace stylet::lab::statistics {

namespace {

/// A sum that the chart can have, and how probable it is, no signal before.
struct State {
  double sum;
  double probability;
};

/// The states of a chart that has not signaled, ascending; sums within kSumTolerance are one.
class Chain {
public:
  explicit Chain(double limit) : limit_(limit) {}

  /// Goes on by an attempt. @return probability of a signal with it
  double step(const AttemptLaw& law) {
    next_.clear();
    double signaled = 0;
    // Each of the two ways keeps the order: the next states are merged from both.
    std::size_t pass = 0;
    std::size_t fail = 0;
    const auto sum_at = [&](std::size_t i, double weight) { return std::max(0.0, states_[i].sum + weight); };
    while (pass < states_.size() || fail < states_.size()) {
      const bool passed = fail == states_.size() ||
                          (pass < states_.size() && sum_at(pass, law.weights.pass) <= sum_at(fail, law.weights.fail));
      std::size_t& from = passed ? pass : fail;
      const double sum = sum_at(from, passed ? law.weights.pass : law.weights.fail);
      const double probability = states_[from].probability * (passed ? 1 - law.failure_rate : law.failure_rate);
      ++from;
      if (probability < kNegligible) continue;
      if (sum >= limit_ - kSumTolerance) {
        signaled += probability;
      } else if (!next_.empty() && sum - next_.back().sum < kSumTolerance) {
        next_.back().probability += probability;
      } else {
        next_.push_back({sum, probability});
      }
    }
    std::swap(states_, next_);
    return signaled;
  }

  double surviving() const {
    double sum = 0;
    for (const State& state : states_) sum += state.probability;
    return sum;
  }

private:
  static constexpr double kNegligible = 1e-18;
  double limit_;
  std::vector<State> states_{{0, 1}};
  std::vector<State> next_;
};

/// Smallest number of hundredths for which `holds`, which no larger one breaks.
template <typename Holds>
double smallest_limit(const Holds& holds) {
  int low = 0;  // does not hold: every sum is a signal
  int high = 100;
  while (!holds(high / 100.0)) {
    low = high;
    high *= 2;
  }
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (holds(middle / 100.0) ? high : low) = middle;
  }
  return high / 100.0;
}

}  // namespace

std::vector<double> signal_by(std::span<const AttemptLaw> attempts, double limit) {
  Chain chain(limit);
  std::vector<double> signaled;
  signaled.reserve(attempts.size());
  double sum = 0;
  for (const AttemptLaw& law : attempts) signaled.push_back(sum += chain.step(law));
  return signaled;
}

double signal_within(const AttemptLaw& law, int attempts, double limit) {
  Chain chain(limit);
  double sum = 0;
  for (int t = 0; t < attempts; ++t) sum += chain.step(law);
  return sum;
}

double mean_run_length(const AttemptLaw& law, double limit) {
  constexpr int kLongest = 100000;
  Chain chain(limit);
  double mean = 0;
  double before = 1;
  double ratio_before = 0;
  int steady = 0;  // attempts since the ratio moved
  for (int t = 0; t < kLongest; ++t) {
    mean += before;
    chain.step(law);
    const double survival = chain.surviving();
    if (survival <= 0) return mean;
    const double ratio = survival / before;
    steady = ratio < 1 && std::abs(ratio - ratio_before) < 1e-11 ? steady + 1 : 0;
    if (steady == 50) return mean + survival / (1 - ratio);
    ratio_before = ratio;
    before = survival;
  }
  return mean;
}

int shortest_run(const Weights& learning, double limit) {
  return static_cast<int>(std::ceil((limit - kSumTolerance) / learning.pass));
}

double learning_limit(const FailureRates& rates, int horizon, double false_discovery) {
  const AttemptLaw law{learning_weights(rates), rates.unacceptable};
  return smallest_limit([&](double limit) { return signal_within(law, horizon, limit) <= false_discovery; });
}

double monitoring_limit(const FailureRates& rates, int horizon, double false_alarm) {
  const AttemptLaw law{monitoring_weights(rates), rates.acceptable};
  return smallest_limit([&](double limit) { return signal_within(law, horizon, limit) <= false_alarm; });
}

Gate learning_gate(const FailureRates& rates, int horizon, double false_discovery) {
  const Weights weights = learning_weights(rates);
  const double limit = learning_limit(rates, horizon, false_discovery);
  return {.limit = limit,
          .horizon = horizon,
          .shortest_run = shortest_run(weights, limit),
          .true_discovery = signal_within({weights, rates.acceptable}, horizon, limit),
          .false_discovery = signal_within({weights, rates.unacceptable}, horizon, limit),
          .mean_attempts = mean_run_length({weights, rates.acceptable}, limit)};
}

}  // namespace stylet::lab::statistics
