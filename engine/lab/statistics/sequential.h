// Sequential tests of a trainee's passes and failures: sums that each attempt raises or lowers, and a limit at which
// they signal. Which limit: run_length.h.
//
//   LC-CUSUM   Biau and Porcher, Stat Med 29 (2010) 1880: the hypothesis is incompetence, a signal declares
//   competence CUSUM      Page, Biometrika 41 (1954) 100: the hypothesis is competence, a signal is an alarm by risk
//   Steiner, Cook, Farewell, Treasure, Biostatistics 1 (2000) 441: attempts of unequal difficulty
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace stylet::lab::statistics {

enum class Outcome : std::uint8_t { pass, fail };

/// p0 and p1 of the literature (where some exchange the names), both within (0, 1), acceptable < unacceptable.
struct FailureRates {
  double acceptable = 0.10;
  double unacceptable = 0.30;
};

/// What an attempt adds to the sum of a chart.
struct Weights {
  double pass = 0;
  double fail = 0;
  double of(Outcome outcome) const { return outcome == Outcome::pass ? pass : fail; }
};

/// LC-CUSUM: ln((1 - p0)/(1 - p1)) of a pass, ln(p0/p1) of a failure.
Weights learning_weights(const FailureRates& rates);
/// CUSUM: the same with the signs turned.
Weights monitoring_weights(const FailureRates& rates);

/// (p1/(1 - p1)) / (p0/(1 - p0))
double odds_ratio(const FailureRates& rates);
/// Failure probability whose odds are `ratio` times those of `p`.
double with_odds(double p, double ratio);
/// Risk-adjusted CUSUM, W = y ln R - ln(1 - p + R p); R < 1 watches for improvement.
/// @param p      failure probability of this attempt where the trainee is acceptable
/// @param ratio  R, of the odds, that makes it unacceptable
Weights monitoring_weights_by_risk(double p, double ratio);
/// Risk-adjusted LC-CUSUM: the same with the signs turned.
Weights learning_weights_by_risk(double p, double ratio);

struct ChartPoint {
  double sum = 0;
  bool signal = false;  ///< the sum has reached the limit with this attempt
};

enum class AfterSignal : std::uint8_t {
  go_on,    ///< LC-CUSUM
  restart,  ///< CUSUM after an alarm: the next sum begins at 0
};

/// Sums lie on a lattice, so that many equal a limit: they are compared with this much to spare.
inline constexpr double kSumTolerance = 1e-9;

/// S_t = max(0, S_{t-1} + W_t), S_0 = 0; a signal where S_t >= limit.
/// @param weights  W_t, of the attempts in order
std::vector<ChartPoint> run_chart(std::span<const double> weights, double limit, AfterSignal after);
std::vector<ChartPoint> run_chart(const Weights& weights, std::span<const Outcome> outcomes, double limit,
                                  AfterSignal after);
/// Number of the attempt, from 1; nothing: none.
std::optional<int> first_signal(std::span<const ChartPoint> chart);

/// Wald's sequential test as anaesthetists draw it (Bolsin and Colson 2000; Kestin 1995): the sum of y - slope, y 1
/// for a failure, with lines h0 below and h1 above. "Any two lines crossed" has no error rate: to be shown, no gate.
struct WaldLines {
  double slope = 0;
  double upper = 0;  ///< h1
  double lower = 0;  ///< h0
};
/// @param alpha, beta  wanted error rates
WaldLines wald_lines(const FailureRates& rates, double alpha, double beta);

/// Bounds of the sum of log likelihood ratios without the barrier (Spiegelhalter et al., Int J Qual Health Care 15
/// (2003) 7): accept the alternative at or above the first, the hypothesis at or below the second.
struct SprtBounds {
  double accept = 0;
  double reject = 0;
};
SprtBounds sprt_bounds(double alpha, double beta);

/// Exponentially weighted share of passes, z_t = w y_t + (1 - w) z_{t-1}, z_1 = y_1: a line for trainees, no test.
std::vector<double> smoothed_pass_rate(std::span<const Outcome> outcomes, double weight = 0.2);

}  // namespace stylet::lab::statistics
