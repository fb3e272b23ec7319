#include "engine/lab/statistics/agreement.h"

namespace stylet::lab::statistics {

Icc intraclass_correlation(const Eigen::MatrixXd& scores) {
  const auto n = static_cast<double>(scores.rows());
  const auto k = static_cast<double>(scores.cols());
  const double mean = scores.mean();
  const double all = (scores.array() - mean).square().sum();
  const double rows = k * (scores.rowwise().mean().array() - mean).square().sum();
  const double columns = n * (scores.colwise().mean().array() - mean).square().sum();
  const double between = rows / (n - 1);
  const double judges = columns / (k - 1);
  const double within = (all - rows) / (n * (k - 1));
  const double error = (all - rows - columns) / ((n - 1) * (k - 1));
  return {.one_way = (between - within) / (between + (k - 1) * within),
          .agreement = (between - error) / (between + (k - 1) * error + k * (judges - error) / n),
          .consistency = (between - error) / (between + (k - 1) * error),
          .one_way_mean = (between - within) / between,
          .agreement_mean = (between - error) / (between + (judges - error) / n),
          .consistency_mean = (between - error) / between};
}

}  // namespace stylet::lab::statistics
