// A body at rest as a linear system: what it answers to small loads.
#pragma once

#include "physics/tissue/factorisation.h"
#include "physics/tissue/stiffness.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <cstddef>

namespace stylet::bench {

class BodyAtRest {
public:
  /// Factorises K. @throws std::runtime_error  it is not positive definite
  explicit BodyAtRest(physics::TissueModel model);

  const physics::TissueModel& model() const { return model_; }
  std::size_t factor_nonzeros() const { return factor_.factor_nonzeros(); }

  /// f . K^-1 f: how far the load's own points of attack give way along it.
  /// @param load  [3 x nodes], N; on held nodes without effect
  double compliance(const Eigen::Matrix3Xd& load);
  /// K^-1 f [3 x nodes], m.
  Eigen::Matrix3Xd displacement(const Eigen::Matrix3Xd& load);

private:
  physics::TissueModel model_;
  physics::SolveWorkspace workspace_;
  physics::StiffnessPattern pattern_;
  physics::Factorisation factor_;
};

}  // namespace stylet::bench
