// Deformable bodies in contact, stepped to rest without the simulation loop around them.
#pragma once

#include "physics/contact/organ_contact.h"
#include "physics/tissue/corotational.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/Core>

#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace stylet::physics::tests {

/// Bodies in contact, brought to rest by the quasi-Newton step p <- p - A_0^-1 (F_int(p) - H^T lambda) alone.
class ContactBench {
public:
  void add(const TetMesh& mesh, const ElasticMaterial& material, const std::vector<int>& held) {
    const std::vector<ElasticMaterial> materials(mesh.tets.size(), material);
    models_.emplace_back(mesh, materials, held);
    held_.push_back(held);
  }

  void touch(OrganContactSettings settings) {
    std::vector<const Factorisation*> factors;
    for (const TissueModel& model : models_) {
      const StiffnessPattern pattern(model);
      std::vector<double> values(pattern.nonzeros());
      rotations_.emplace_back(model.tets.size(), Eigen::Quaterniond::Identity());
      pattern.assemble(model, rotations_.back(), 1, values);
      factors_.push_back(std::make_unique<Factorisation>(pattern, workspace_));
      ASSERT_TRUE(factors_.back()->factorise(pattern, values, workspace_));
      factors.push_back(factors_.back().get());
      positions_.push_back(rest_positions(model));
    }
    contact_.emplace(models_, factors, std::move(settings));
  }

  void shift_held(std::size_t body, const Eigen::Vector3d& by) {
    for (const int n : held_[body]) positions_[body].col(n) += by;
  }

  /// New rows and multipliers with the bodies where they are told to be.
  void update(std::span<const Eigen::Matrix3Xd> positions, const RigidPose* probe = nullptr) {
    for (std::size_t b = 0; b < positions.size(); ++b) contact_->follow(static_cast<int>(b), positions[b]);
    contact_->update(probe, workspace_);
  }

  /// Of each step: as if the factor were of a body 1/pace times as stiff.
  double pace = 1;

  /// @return steps until nothing moves by more than `tolerance`, m
  int settle(double tolerance, const RigidPose* probe = nullptr, int limit = 400) {
    for (int step = 1; step <= limit; ++step) {
      update(positions_, probe);
      double moved = contact_->report().violation;
      for (std::size_t b = 0; b < models_.size(); ++b) {
        Eigen::VectorXd pull = -free_part(b, internal(b));
        contact_->add_forces(static_cast<int>(b), pull);
        factors_[b]->solve(pull, pull, workspace_);
        pull *= pace;
        moved = std::max(moved, pull.cwiseAbs().maxCoeff());
        for (int n = 0; n < models_[b].node_count(); ++n) {
          const int i = models_[b].free_index[n];
          if (i >= 0) positions_[b].col(n) += pull.segment<3>(3 * i);
        }
      }
      if (moved < tolerance) return step;
    }
    return limit + 1;
  }

  /// F_int at all nodes [3 x nodes], N.
  Eigen::Matrix3Xd internal(std::size_t b) {
    Eigen::Matrix3Xd forces(3, models_[b].node_count());
    update_rotations(models_[b], positions_[b], rotations_[b]);
    internal_forces(models_[b], positions_[b], rotations_[b], forces);
    return forces;
  }

  /// What the support pushes on the body with, N.
  Eigen::Vector3d support(std::size_t b) {
    const Eigen::Matrix3Xd forces = internal(b);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int n : held_[b]) sum += forces.col(n);
    return sum;
  }

  OrganContact& contact() { return *contact_; }
  const TissueModel& model(std::size_t b) const { return models_[b]; }
  const Eigen::Matrix3Xd& positions(std::size_t b) const { return positions_[b]; }

private:
  Eigen::VectorXd free_part(std::size_t b, const Eigen::Matrix3Xd& all) const {
    Eigen::VectorXd part(models_[b].dof_count());
    for (int n = 0; n < models_[b].node_count(); ++n) {
      const int i = models_[b].free_index[n];
      if (i >= 0) part.segment<3>(3 * i) = all.col(n);
    }
    return part;
  }

  SolveWorkspace workspace_;
  std::vector<TissueModel> models_;
  std::vector<std::vector<int>> held_;
  std::vector<std::unique_ptr<Factorisation>> factors_;
  std::vector<std::vector<Eigen::Quaterniond>> rotations_;
  std::vector<Eigen::Matrix3Xd> positions_;
  std::optional<OrganContact> contact_;
};

inline constexpr double kYoung = 10e3;  // Pa

/// A block of 60 x 60 x 40 mm with its lower side at `z`.
inline TetMesh block(double z, int cells, double width = 0.06) {
  return reference::kuhn_box({-width / 2, -width / 2, z}, {width / 2, width / 2, z + 0.04}, {cells, cells, cells});
}

inline std::vector<int> at_height(const TetMesh& mesh, double z) {
  return reference::nodes_where(mesh, [&](const Eigen::Vector3d& x) { return std::abs(x.z() - z) < 1e-9; });
}

}  // namespace stylet::physics::tests
