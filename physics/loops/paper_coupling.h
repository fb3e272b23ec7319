// The paper's couplings: contacts laid by the simulation loop, each held by two bilateral rows.
#pragma once

#include "physics/contact/constraint_solver.h"
#include "physics/loops/haptic_loop_settings.h"
#include "physics/loops/needle_coupling.h"

#include <cstdint>
#include <memory>

namespace stylet::physics {

/// Coupling::paper_frozen and paper_updated (paper III).
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
  bool frozen_;
  double relative_compliance_;
  double beam_length_;    // m
  double needle_length_;  // m
  ConstraintSolver solver_;
};

}  // namespace stylet::physics
