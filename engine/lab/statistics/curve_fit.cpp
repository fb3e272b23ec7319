#include "engine/lab/statistics/curve_fit.h"

#include "engine/lab/statistics/student.h"

#include <Eigen/LU>
#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace stylet::lab::statistics {

namespace {

/// Residuals y - model and the model's Jacobian at p.
struct Linearized {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;
  double squares() const { return residuals.squaredNorm(); }
};

Linearized linearize(const CurveModel& model, std::span<const double> x, std::span<const double> y,
                     const Eigen::VectorXd& p) {
  const auto n = static_cast<Eigen::Index>(x.size());
  Linearized at{Eigen::VectorXd(n), Eigen::MatrixXd(n, p.size())};
  Eigen::VectorXd gradient(p.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    at.residuals[i] = y[k] - model(x[k], p, gradient);
    at.jacobian.row(i) = gradient.transpose();
  }
  return at;
}

/// J d = r with sqrt(damping) I below, columns of equal length: more digits than the normal equations keep.
/// @param moving  parameters that move; the others' step is 0
Eigen::VectorXd damped_step(const Linearized& at, const std::vector<Eigen::Index>& moving, double damping) {
  Eigen::VectorXd step = Eigen::VectorXd::Zero(at.jacobian.cols());
  const auto m = static_cast<Eigen::Index>(moving.size());
  if (m == 0) return step;
  const Eigen::Index n = at.residuals.size();
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + m, m);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n + m);
  right.head(n) = at.residuals;
  Eigen::VectorXd scale(m);
  for (Eigen::Index i = 0; i < m; ++i) {
    const auto column = at.jacobian.col(moving[static_cast<std::size_t>(i)]);
    const double norm = column.norm();
    scale[i] = norm > 0 ? norm : 1;
    system.col(i).head(n) = column / scale[i];
    system(n + i, i) = std::sqrt(damping);
  }
  const Eigen::VectorXd solved = system.colPivHouseholderQr().solve(right).cwiseQuotient(scale);
  for (Eigen::Index i = 0; i < m; ++i) step[moving[static_cast<std::size_t>(i)]] = solved[i];
  return step;
}

double relative_change(const Eigen::VectorXd& next, const Eigen::VectorXd& p) {
  return ((next - p).cwiseAbs().array() / (p.cwiseAbs().array() + 1e-300)).maxCoeff();
}

}  // namespace

double CurveFit::standard_error(int parameter) const {
  return std::sqrt(covariance(parameter, parameter));
}

double CurveFit::standard_errors_of_95() const {
  return student_t(0.95, std::max(points - static_cast<int>(parameters.size()), 1));
}

double CurveFit::aicc() const {
  const double n = points;
  const double k = static_cast<double>(parameters.size()) + 1;
  return n * std::log(squares / n) + 2 * k + 2 * k * (k + 1) / (n - k - 1);
}

CurveFit fit_curve(const CurveModel& model, std::span<const double> x, std::span<const double> y,
                   std::span<const CurveParameter> parameters) {
  constexpr int kMostSteps = 2000;
  constexpr int kSettled = 3;
  const auto size = static_cast<Eigen::Index>(parameters.size());
  Eigen::VectorXd p(size);
  Eigen::VectorXd low(size);
  Eigen::VectorXd high(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    const CurveParameter& parameter = parameters[static_cast<std::size_t>(i)];
    low[i] = parameter.low;
    high[i] = parameter.high;
    p[i] = std::clamp(parameter.start, low[i], high[i]);
  }
  CurveFit fit;
  fit.points = static_cast<int>(x.size());
  Linearized at = linearize(model, x, y, p);
  // What a bound holds and would leave it does not move.
  const auto next_point = [&](double damping) -> Eigen::VectorXd {
    const Eigen::VectorXd down = at.jacobian.transpose() * at.residuals;
    std::vector<Eigen::Index> moving;
    for (Eigen::Index i = 0; i < size; ++i) {
      const bool held = (p[i] <= low[i] && down[i] < 0) || (p[i] >= high[i] && down[i] > 0);
      if (!held) moving.push_back(i);
    }
    const Eigen::VectorXd step = damped_step(at, moving, damping);
    return (p + step).cwiseMax(low).cwiseMin(high);
  };
  double damping = 1;
  int settled = 0;  // steps that no longer moved anything
  for (int k = 0; k < kMostSteps && settled < kSettled; ++k) {
    const Eigen::VectorXd next = next_point(damping);
    Linearized there = linearize(model, x, y, next);
    const double before = at.squares();
    const double after = there.squares();
    const double moved = relative_change(next, p);
    if (std::isfinite(after) && after <= before) {
      settled = moved < 1e-12 || before - after <= 1e-15 * before ? settled + 1 : 0;
      p = next;
      at = std::move(there);
      damping = std::max(damping / 5, 1e-15);
    } else {
      damping *= 3;
      if (moved < 1e-15) settled = kSettled;  // no way is down
    }
  }
  // The sum of squares is flat to half the digits around its least: the last of them come from where its slope is
  // none.
  for (int k = 0; k < 3; ++k) {
    const Eigen::VectorXd next = next_point(0);
    if (!next.allFinite() || relative_change(next, p) > 1e-5) break;
    p = next;
    at = linearize(model, x, y, p);
  }
  fit.converged = settled >= kSettled;
  fit.parameters = p;
  fit.squares = at.squares();
  fit.residual_sd = std::sqrt(fit.squares / static_cast<double>(fit.points - size));
  fit.covariance =
      fit.residual_sd * fit.residual_sd *
      (at.jacobian.transpose() * at.jacobian).eval().fullPivLu().solve(Eigen::MatrixXd::Identity(size, size));
  for (Eigen::Index i = 0; i < size; ++i) fit.at_bound.push_back(p[i] <= low[i] || p[i] >= high[i]);
  return fit;
}

}  // namespace stylet::lab::statistics
