// Stylet's coupling: contacts laid on the needle's own track, each row by its law.
#pragma once

#include "physics/contact/bounded_solver.h"
#include "physics/contact/needle_track.h"
#include "physics/loops/haptic_loop_settings.h"
#include "physics/loops/needle_coupling.h"

#include <cstdint>
#include <memory>

namespace stylet::physics {

/// Coupling::stylet.
class TrackCoupling final : public NeedleCoupling {
public:
  TrackCoupling(const HapticLoopSettings& settings, const Needle& needle);

  std::unique_ptr<NeedleCoupling> clone() const override { return std::make_unique<TrackCoupling>(*this); }
  void clear(TissuePoints& tissue) override { track_.clear(tissue); }
  std::uint32_t load(const TissuePatch& patch, TissuePoints& tissue) override;
  void place(const NeedleShape& predicted, double dt, ContactSystem& system) override;
  std::uint32_t solve(const Delassus& delassus, ContactSystem& system) override;
  std::uint32_t advance(const NeedleShape& shape, const TissuePatch& patch, std::uint64_t number,
                        ContactSystem& system) override;
  void publish(const ContactSystem& system, NeedleState& out) const override;

private:
  HermiteShaft shaft(const NeedleShape& shape) const { return {shape, beam_length_, straight_edges_}; }

  double relative_compliance_;
  bool straight_edges_;
  double beam_length_;    // m
  double needle_length_;  // m
  double dt_ = 0;         // of the step placed, s
  NeedleTrack track_;
  BoundedSolver solver_;
};

}  // namespace stylet::physics
