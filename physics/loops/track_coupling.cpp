#include "physics/loops/track_coupling.h"

#include <algorithm>
#include <span>

namespace stylet::physics {

TrackCoupling::TrackCoupling(const HapticLoopSettings& settings, const Needle& needle)
    : relative_compliance_(settings.relative_compliance),
      straight_edges_(settings.track.straight_edges),
      beam_length_(needle.beam_length()),
      needle_length_(needle.rest_length()),
      track_(settings.track, 0.5 * settings.needle.outer_diameter, settings.tissues),
      solver_(kMaxRows) {
  solver_.set_limits(settings.solve_limits);
}

std::uint32_t TrackCoupling::load(const TissuePatch& patch, TissuePoints& tissue) {
  track_.load(patch, tissue);
  return 0;  // what there is to flag, advance() does
}

void TrackCoupling::place(const NeedleShape& predicted, double dt, ContactSystem& system) {
  dt_ = dt;
  track_.place(shaft(predicted), system.tissue, dt, system.rows);
}

// Rows without sub-grid compliance are softened by `relative_compliance` of the tissue's own, and where they depend
// on each other, as in PaperCoupling::solve().
std::uint32_t TrackCoupling::solve(const Delassus& delassus, ContactSystem& system) {
  const int rows = delassus.rows();
  const std::span laws(system.rows.laws.data(), static_cast<std::size_t>(rows));
  const auto delta = system.delta_free.head(rows);
  system.delta_free.head(rows) += system.rows.slip.head(rows);
  const double scale = delassus.mean_tissue_compliance();
  const double softness = relative_compliance_ * scale;
  bool stiff = false;
  for (ContactRow& law : laws) {
    stiff = stiff || law.compliance == 0;
    if (law.compliance == 0) law.compliance = softness;
  }
  std::uint32_t flags = 0;
  BoundedSolveReport report = solver_.solve(laws, delassus.matrix(), delta, system.lambda);
  if (stiff && (!report.solved || report.smallest_pivot < kDependent * scale)) {
    flags |= kNeedleRowsDependent;
    if (softness < kSoftened * scale) {
      for (ContactRow& law : laws) law.compliance = std::max(law.compliance, kSoftened * scale);
      system.lambda.head(rows).setZero();  // made of rounding: no guess
      report = solver_.solve(laws, delassus.matrix(), delta, system.lambda);
    }
  }
  if (report.fallback) flags |= kNeedleSolveInexact;
  if (report.lagged_bounds) flags |= kNeedleBoundsLagged;  // an error of first order in the step's length
  if (report.softened_rows > 0) flags |= kNeedleRowsDependent;
  if (!report.solved) flags |= kNeedleSolveFailed;
  return flags;
}

std::uint32_t TrackCoupling::advance(const NeedleShape& shape, const TissuePatch& patch, std::uint64_t number,
                                     ContactSystem& system) {
  system.tissue.settle_organs(patch);
  track_.advance({shaft(shape), patch, system.rows, solver_, system.lambda, number, dt_, system.taken},
                 system.tissue);
  return track_.flags();
}

void TrackCoupling::publish(const ContactSystem& system, NeedleState& out) const {
  track_.publish(system.tissue, beam_length_, needle_length_, out);
}

}  // namespace stylet::physics
