#include "engine/lab/statistics/cell_chain.h"

#include "engine/lab/statistics/normal.h"

#include <Eigen/Core>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace stylet::lab::statistics {

double mean_run_length(const CellChain& chain) {
  const int m = chain.cells;
  // With a barrier the first cell is half as wide, its middle at the barrier.
  const double width = (chain.high - chain.low) / (chain.barrier ? m - 0.5 : m);
  const auto middle = [&](int i) { return chain.low + (chain.barrier ? i : i + 0.5) * width; };
  Eigen::MatrixXd stays(m, m);
  for (int i = 0; i < m; ++i) {
    const double from = middle(i);
    double below = chain.barrier ? 0 : chain.at_most(from, chain.low);
    for (int j = 0; j < m; ++j) {
      const double until = chain.at_most(from, middle(j) + width / 2);
      stays(i, j) = until - below;
      below = until;
    }
  }
  const Eigen::MatrixXd system = Eigen::MatrixXd::Identity(m, m) - stays;
  const Eigen::VectorXd lengths = system.partialPivLu().solve(Eigen::VectorXd::Ones(m));
  const double cell = (chain.start - chain.low) / width + (chain.barrier ? 0.5 : 0);
  return lengths[std::clamp(static_cast<int>(std::floor(cell)), 0, m - 1)];
}

double normal_cusum_run_length(double reference, double limit, double shift, int cells) {
  return mean_run_length(
      {.low = 0, .high = limit, .barrier = true, .cells = cells, .start = 0, .at_most = [=](double from, double to) {
         return normal_cdf(to - from + reference - shift);
       }});
}

double normal_ewma_run_length(double weight, double width, double shift, int cells) {
  const double limit = width * std::sqrt(weight / (2 - weight));
  return mean_run_length(
      {.low = -limit, .high = limit, .cells = cells, .start = 0, .at_most = [=](double from, double to) {
         return normal_cdf((to - (1 - weight) * from) / weight - shift);
       }});
}

}  // namespace stylet::lab::statistics
