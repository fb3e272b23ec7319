#include "tests/validation/static_body.h"

#include "physics/tissue/membrane.h"
#include "physics/tissue/quadratic.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>
#include <utility>

namespace stylet::validation {

using Eigen::Matrix3Xd;
using Eigen::VectorXd;

namespace {
constexpr int kRenewal = 10;  // iterations after which a new factor has paid for itself
}

StaticBody::StaticBody(physics::TissueModel rest)
    : positions(physics::rest_positions(rest)),
      memory(rest.relaxes() ? rest.memory_count() : 0),
      model_(std::move(rest)),
      rotations_(model_.point_count(), Eigen::Quaterniond::Identity()),
      pattern_(model_),
      factor_(pattern_, workspace_),
      values_(pattern_.nonzeros()) {}

Matrix3Xd StaticBody::forces() {
  inverted_ = physics::update_rotations(model_, positions, rotations_);
  Matrix3Xd f(3, model_.node_count());
  physics::internal_forces(model_, positions, rotations_, f, {}, true, memory);
  return f;
}

double StaticBody::gradient_error(double h) {
  const Eigen::Matrix3Xd found = forces();
  double worst = 0;
  for (Eigen::Index i = 0; i < positions.size(); ++i) {
    const auto energy_at = [&](double offset) {
      const double here = std::exchange(positions.data()[i], positions.data()[i] + offset);
      const double u = energy();
      positions.data()[i] = here;
      return u;
    };
    const double gradient = (8 * (energy_at(h) - energy_at(-h)) - (energy_at(2 * h) - energy_at(-2 * h))) / (12 * h);
    worst = std::max(worst, std::abs(gradient - found.data()[i]));
  }
  return worst / found.cwiseAbs().maxCoeff();
}

double StaticBody::energy() {
  inverted_ = physics::update_rotations(model_, positions, rotations_);
  return physics::elastic_energy(model_, positions, rotations_, {}, memory);
}

void StaticBody::fade(double dt) {
  inverted_ = physics::update_rotations(model_, positions, rotations_);
  if (!memory.empty()) physics::relax_strain(model_, positions, rotations_, {}, dt, memory);
}

Eigen::MatrixXd StaticBody::dense_stiffness() {
  physics::TissueModel free = model_;
  for (int n = 0; n < free.node_count(); ++n) free.free_index[n] = n;
  free.free_node_count = free.node_count();
  const physics::StiffnessPattern pattern(free);
  std::vector<double> values(pattern.nonzeros());
  assemble(free, pattern, values);
  Eigen::MatrixXd k = Eigen::MatrixXd::Zero(free.dof_count(), free.dof_count());
  for (int c = 0; c < free.dof_count(); ++c) {
    for (int i = pattern.column_start()[c]; i < pattern.column_start()[c + 1]; ++i) {
      k(pattern.rows()[i], c) = k(c, pattern.rows()[i]) = values[i];
    }
  }
  return k;
}

double StaticBody::stiffness_error(double h) {
  const Eigen::MatrixXd k = dense_stiffness();
  double worst = 0;
  for (Eigen::Index i = 0; i < positions.size(); ++i) {
    const double here = positions.data()[i];
    positions.data()[i] = here + h;
    const Eigen::Matrix3Xd up = forces();
    positions.data()[i] = here - h;
    const Eigen::Matrix3Xd down = forces();
    positions.data()[i] = here;
    worst = std::max(worst, ((up - down).reshaped() / (2 * h) - k.col(i)).cwiseAbs().maxCoeff());
  }
  return worst / k.cwiseAbs().maxCoeff();
}

void StaticBody::factorise() {
  assemble(model_, pattern_, values_);
  if (!factor_.factorise(pattern_, values_, workspace_))
    throw std::runtime_error("stiffness is not positive definite");
}

void StaticBody::assemble(const physics::TissueModel& model, const physics::StiffnessPattern& pattern,
                          std::vector<double>& values) {
  inverted_ = physics::update_rotations(model_, positions, rotations_);
  std::vector<Eigen::Matrix3d> cofactors(model_.is_quadratic() ? model_.point_count() : 0);
  physics::find_cofactors(model_, positions, cofactors);
  std::vector<physics::PointStiffness> stiffening(model_.stiffens() ? model_.point_count() : 0);
  if (model_.stiffens()) physics::find_stiffening(model_, positions, rotations_, {}, stiffening);
  std::vector<physics::MembraneGradient> membrane;
  for (const physics::MembraneTriangle& triangle : model_.membrane) {
    membrane.push_back(physics::membrane_gradient(triangle, positions));
  }
  std::vector<physics::SqueezedTet> squeezed;
  physics::find_squeezed(model_, positions, {}, squeezed);
  pattern.assemble(model, rotations_, 1, values, squeezed, cofactors, stiffening, membrane);
}

VectorXd StaticBody::free_part(const Matrix3Xd& nodes) const {
  VectorXd v(model_.dof_count());
  for (int n = 0; n < model_.node_count(); ++n) {
    const int f = model_.free_index[n];
    if (f >= 0) v.segment<3>(3 * f) = nodes.col(n);
  }
  return v;
}

Matrix3Xd StaticBody::all_nodes(const VectorXd& free) const {
  Matrix3Xd nodes = Matrix3Xd::Zero(3, model_.node_count());
  for (int n = 0; n < model_.node_count(); ++n) {
    const int f = model_.free_index[n];
    if (f >= 0) nodes.col(n) = free.segment<3>(3 * f);
  }
  return nodes;
}

Matrix3Xd StaticBody::linear_answer(const Matrix3Xd& load) {
  factorise();
  VectorXd x = free_part(load);
  factor_.solve(x, x, workspace_);
  return all_nodes(x);
}

int StaticBody::relax(const Matrix3Xd& load, double tolerance, int max_iterations) {
  struct Pair {
    VectorXd step, change;  // of the positions, of the gradient
    double product;
  };
  std::deque<Pair> pairs;
  factorise();
  VectorXd gradient = free_part(forces() - load);
  for (int iteration = 1; iteration <= max_iterations; ++iteration) {
    if (gradient.lpNorm<Eigen::Infinity>() <= tolerance) return iteration - 1;
    if (iteration % kRenewal == 0) {
      factorise();
      pairs.clear();
    }
    VectorXd direction = -gradient;  // the two loops of L-BFGS around K^-1
    std::vector<double> weight;
    for (auto p = pairs.rbegin(); p != pairs.rend(); ++p) {
      weight.push_back(p->step.dot(direction) / p->product);
      direction -= weight.back() * p->change;
    }
    factor_.solve(direction, direction, workspace_);
    for (auto p = pairs.begin(); p != pairs.end(); ++p) {
      direction += (weight.back() - p->change.dot(direction) / p->product) * p->step;
      weight.pop_back();
    }
    // A step that overshoots is cut where a parabola through the two slopes has its minimum.
    const Matrix3Xd before = positions;
    const double slope = gradient.dot(direction);
    double length = 1;
    VectorXd next;
    for (int cut = 0; cut < 20; ++cut) {
      positions = before + length * all_nodes(direction);
      next = free_part(forces() - load);
      const double ratio = next.dot(direction) / slope;
      if (inverted_ == 0 && std::abs(ratio) < 0.9) break;
      length *= inverted_ > 0 ? 0.5 : ratio < 1 ? std::max(0.1, 1 / (1 - ratio)) : 2;
    }
    const VectorXd step = length * direction, change = next - gradient;
    const double product = step.dot(change);
    if (product > 0) pairs.push_back({step, change, product});
    if (pairs.size() > 12) pairs.pop_front();
    gradient = next;
  }
  return max_iterations + 1;
}

}  // namespace stylet::validation
