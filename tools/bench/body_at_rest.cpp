#include "tools/bench/body_at_rest.h"

#include <Eigen/Geometry>

#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

namespace stylet::bench {

BodyAtRest::BodyAtRest(physics::TissueModel model)
    : model_(std::move(model)), pattern_(model_), factor_(pattern_, workspace_) {
  std::vector<double> values(pattern_.nonzeros());
  const std::vector<Eigen::Quaterniond> rotations(static_cast<std::size_t>(model_.point_count()),
                                                  Eigen::Quaterniond::Identity());
  pattern_.assemble(model_, rotations, 1, values);
  if (!factor_.factorise(pattern_, values, workspace_)) {
    throw std::runtime_error("stiffness at rest is not positive definite");
  }
}

Eigen::Matrix3Xd BodyAtRest::displacement(const Eigen::Matrix3Xd& load) {
  Eigen::VectorXd x(model_.dof_count());
  for (int n = 0; n < model_.node_count(); ++n) {
    const int f = model_.free_index[static_cast<std::size_t>(n)];
    if (f >= 0) x.segment<3>(3 * f) = load.col(n);
  }
  factor_.solve(x, x, workspace_);
  Eigen::Matrix3Xd moved = Eigen::Matrix3Xd::Zero(3, model_.node_count());
  for (int n = 0; n < model_.node_count(); ++n) {
    const int f = model_.free_index[static_cast<std::size_t>(n)];
    if (f >= 0) moved.col(n) = x.segment<3>(3 * f);
  }
  return moved;
}

double BodyAtRest::compliance(const Eigen::Matrix3Xd& load) {
  return displacement(load).cwiseProduct(load).sum();
}

}  // namespace stylet::bench
