// The paper's couplings: contacts laid by the simulation loop, each held by two bilateral rows.
#pragma once

#include "physics/contact/constraint_solver.h"
#include "physics/loops/haptic_loop_settings.h"
#include "physics/loops/needle_coupling.h"

#include <cstdint>
#include <memory>

namespace stylet::physics {

/// Coupling::paper_frozen, paper_updated and paper_trajectory (paper III).
class PaperCoupling final : public NeedleCoupling {
public:
  PaperCoupling(const HapticLoopSettings& settings, const Needle& needle);

  std::unique_ptr<NeedleCoupling> clone() const override { return std::make_unique<PaperCoupling>(*this); }
  void clear(TissuePoints& tissue) override { tissue.clear(); }
  std::uint32_t load(const TissuePatch& patch, TissuePoints& tissue) override;
  void place(const NeedleShape& predicted, double dt, ContactSystem& system) override;
  void direct(const NeedleShape& predicted, ContactSystem& system) override;
  std::uint32_t solve(const Delassus& delassus, ContactSystem& system) override;
  void publish(const ContactSystem& system, NeedleState& out) const override;

private:
  /// Unit, along the line of the body's contact points at one of them: between its neighbours, or from it to the only
  /// one. The edge's own tangent where there is no such line, or where it does not run along the needle.
  Eigen::Vector3d trajectory(const ActiveContact& contact, const TissuePoints& tissue) const;

  bool frozen_;
  bool along_trajectory_;
  double relative_compliance_;
  double beam_length_;    // m
  double needle_length_;  // m
  ConstraintSolver solver_;
};

}  // namespace stylet::physics
