// A body of corotational tetrahedra under dead loads, brought to its equilibrium.
#pragma once

#include "physics/tissue/corotational.h"
#include "physics/tissue/factorisation.h"
#include "physics/tissue/stiffness.h"
#include "physics/tissue/strain_memory.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <vector>

namespace stylet::validation {

/// State, forces and factorised stiffness of one body. SI.
class StaticBody {
public:
  /// At rest. Prescribed nodes of other positions: set `positions` of the fixed ones.
  explicit StaticBody(physics::TissueModel rest);

  const physics::TissueModel& model() const { return model_; }
  Eigen::Matrix3Xd positions;                 ///< [3 x nodes], m
  std::vector<physics::StrainMemory> memory;  ///< [memory_count()] of what relaxes, else empty

  /// F_int at `positions`, N [3 x nodes].
  Eigen::Matrix3Xd forces();
  double energy();  ///< J
  int inverted_count() const { return inverted_; }
  /// Largest difference of forces() from the gradient of energy(), over the largest force: by fourth-order
  /// differences of steps `h`, m.
  double gradient_error(double h);
  /// A period of `dt` in which nothing moves (eq. 46).
  void fade(double dt);
  /// K of all nodes at `positions` [3 nodes x 3 nodes], whatever is fixed, N/m.
  Eigen::MatrixXd dense_stiffness();
  /// Largest difference of dense_stiffness() from the derivative of forces(), over the largest entry: by central
  /// differences of steps `h`, m.
  double stiffness_error(double h);

  /// K^-1 f at `positions`, on the free nodes; K refactorised. [3 x nodes], zero at the fixed ones.
  Eigen::Matrix3Xd linear_answer(const Eigen::Matrix3Xd& load);

  /// Brings `positions` to F_int = load on the free nodes: L-BFGS on top of a stiffness that is renewed now and then.
  /// @param tolerance  of the largest force left over, N
  /// @return iterations used, more than `max_iterations` if the tolerance was not met
  int relax(const Eigen::Matrix3Xd& load, double tolerance, int max_iterations = 200);

private:
  void assemble(const physics::TissueModel& model, const physics::StiffnessPattern& pattern,
                std::vector<double>& values);
  void factorise();
  Eigen::VectorXd free_part(const Eigen::Matrix3Xd& nodes) const;
  Eigen::Matrix3Xd all_nodes(const Eigen::VectorXd& free) const;

  physics::TissueModel model_;
  std::vector<Eigen::Quaterniond> rotations_;
  physics::SolveWorkspace workspace_;
  physics::StiffnessPattern pattern_;
  physics::Factorisation factor_;
  std::vector<double> values_;
  int inverted_ = 0;
};

}  // namespace stylet::validation
