// Nonlinear least squares with bounds: Levenberg and Marquardt's steps, with the covariance of what was found.
#pragma once

#include <Eigen/Core>

#include <functional>
#include <limits>
#include <span>
#include <vector>

namespace stylet::lab::statistics {

/// y(x; p). @param[out] gradient  dy/dp, sized as p
using CurveModel = std::function<double(double x, const Eigen::VectorXd& p, Eigen::VectorXd& gradient)>;

struct CurveParameter {
  double start = 0;
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

struct CurveFit {
  Eigen::VectorXd parameters;
  Eigen::MatrixXd covariance;  ///< s^2 (J^T J)^-1, bounds not heeded; not finite where J^T J is singular
  std::vector<bool> at_bound;  ///< of each parameter
  double squares = 0;          ///< sum of squared residuals
  double residual_sd = 0;      ///< s, with n - p degrees of freedom
  bool converged = false;
  int points = 0;

  /// Half of the 95 % interval over a standard error: Student's t of what is left of the points.
  double standard_errors_of_95() const;

  double standard_error(int parameter) const;
  /// Akaike's criterion for few points: n ln(SSE/n) + 2k + 2k(k + 1)/(n - k - 1), k = parameters + 1.
  double aicc() const;
};

/// @param x, y  same size, more than there are parameters
CurveFit fit_curve(const CurveModel& model, std::span<const double> x, std::span<const double> y,
                   std::span<const CurveParameter> parameters);

}  // namespace stylet::lab::statistics
