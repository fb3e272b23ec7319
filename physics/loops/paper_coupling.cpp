#include "physics/loops/paper_coupling.h"

#include "physics/contact/shaft.h"

#include <algorithm>
#include <span>

namespace stylet::physics {

PaperCoupling::PaperCoupling(const HapticLoopSettings& settings, const Needle& needle)
    : frozen_(settings.coupling == Coupling::paper_frozen),
      along_trajectory_(settings.coupling == Coupling::paper_trajectory),
      relative_compliance_(settings.relative_compliance),
      beam_length_(needle.beam_length()),
      needle_length_(needle.rest_length()),
      solver_(kMaxRows) {}

std::uint32_t PaperCoupling::load(const TissuePatch& patch, TissuePoints& tissue) {
  return tissue.load(patch) ? 0U : kNeedleRowOverflow;
}

void PaperCoupling::place(const NeedleShape& predicted, double /*dt*/, ContactSystem& system) {
  const TissuePoints& tissue = system.tissue;
  TrackRows& rows = system.rows;
  rows.contact_count = 0;
  for (int point = 0; point < tissue.count(); ++point) {
    ActiveContact& contact = rows.contacts[rows.contact_count];
    contact.point = point;
    contact.first_row = 2 * rows.contact_count;
    contact.row_count = 2;
    if (frozen_) {
      const PatchContact& laid = tissue.contact(point);
      const int beam = std::clamp(laid.beam, 0, predicted.node_count - 2);
      contact.shaft = shaft_point(predicted.nodes(), beam, laid.beam_fraction);
    } else {
      contact.shaft = project_on_shaft(predicted.nodes(), tissue.position(point));
      if (contact.shaft.ahead_of_tip || contact.shaft.behind_hub) continue;
    }
    ++rows.contact_count;
  }
}

void PaperCoupling::direct(const NeedleShape& predicted, ContactSystem& system) {
  for (int c = 0; c < system.rows.contact_count; ++c) {
    ActiveContact& contact = system.rows.contacts[c];
    if (frozen_) {
      contact.directions.leftCols<2>() = system.tissue.contact(contact.point).directions;
      continue;
    }
    const Eigen::Vector3d tangent = along_trajectory_ ? trajectory(contact, system.tissue) : contact.shaft.tangent;
    contact.directions.leftCols<2>() = lateral_directions(tangent, predicted.orientation(contact.shaft.beam));
  }
}

Eigen::Vector3d PaperCoupling::trajectory(const ActiveContact& contact, const TissuePoints& tissue) const {
  constexpr double kAlong = 0.5;  // cosine
  const int point = contact.point;
  const int body = tissue.body(point);
  const int before = point > 0 && tissue.body(point - 1) == body ? point - 1 : point;
  const int behind = point + 1 < tissue.count() && tissue.body(point + 1) == body ? point + 1 : point;
  const Eigen::Vector3d line = tissue.position(behind) - tissue.position(before);  // from entry to tip
  const double length = line.norm();
  if (!(line.dot(contact.shaft.tangent) > kAlong * length)) return contact.shaft.tangent;
  return line / length;
}

// Contacts that the mesh or the beams cannot tell apart leave a row next to nothing to move by: its multiplier is
// then made of rounding. Such a system is softened, also where the exact one was asked for, and the step flagged.
std::uint32_t PaperCoupling::solve(const Delassus& delassus, ContactSystem& system) {
  const double scale = delassus.mean_tissue_compliance();
  const double compliance = relative_compliance_ * scale;
  const auto delta_free = system.delta_free.head(delassus.rows());
  std::uint32_t flags = 0;
  bool solved = solver_.solve(delassus.matrix(), compliance, delta_free, system.lambda);
  if (!(solver_.smallest_pivot() >= kDependent * scale)) {
    flags = kNeedleRowsDependent;
    if (!solved || !(compliance >= kSoftened * scale)) {
      solved = solver_.solve(delassus.matrix(), std::max(compliance, kSoftened * scale), delta_free, system.lambda);
    }
  }
  return solved ? flags : flags | kNeedleSolveFailed;
}

void PaperCoupling::publish(const ContactSystem& system, NeedleState& out) const {
  const TissuePoints& tissue = system.tissue;
  const std::span contacts(system.rows.contacts.data(), static_cast<std::size_t>(system.rows.contact_count));
  const auto arc = [&](const ActiveContact& c) { return (c.shaft.beam + c.shaft.beam_fraction) * beam_length_; };
  out.contact_count = 0;
  const ActiveContact* deepest = nullptr;
  for (const ActiveContact& contact : contacts) {
    const PatchContact& laid = tissue.contact(contact.point);
    out.contacts[out.contact_count++] = {.id = laid.id,
                                         .body = tissue.body(contact.point),
                                         .tet = laid.tet,
                                         .barycentric = laid.barycentric,
                                         .beam = contact.shaft.beam,
                                         .beam_fraction = contact.shaft.beam_fraction,
                                         .position = tissue.position(contact.point),
                                         .force = tissue.force(contact.point)};
    if (deepest == nullptr || arc(contact) > arc(*deepest)) deepest = &contact;
  }
  out.track_count = out.contact_count;

  // The tip is in the body of the contact nearest to it; its depth there counts from that body's first contact.
  out.tip = deepest == nullptr ? TipState::outside : TipState::inside;
  out.tip_body = deepest == nullptr ? -1 : tissue.body(deepest->point);
  out.tip_depth = 0;
  for (const ActiveContact& contact : contacts) {
    if (tissue.body(contact.point) != out.tip_body) continue;
    out.tip_depth = std::max(out.tip_depth, needle_length_ - arc(contact));
  }
}

}  // namespace stylet::physics
