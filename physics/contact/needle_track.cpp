#include "physics/contact/needle_track.h"

#include "physics/contact/patch_walk.h"
#include "physics/contact/subgrid_compliance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace stylet::physics {
namespace {

using Eigen::Vector3d;

constexpr int kMostPoints = 60;  // three rows each, and three of the tip
constexpr int kNearTip = 8;      // points laid last, which stay when others have to go
/// Share of the spacing, at least, by which a contact is held: a softer one holds nothing that a hand could feel, and
/// C ~ 1/share is the condition of W + C.
constexpr double kLeastShare = 1.0 / 300;
constexpr double kSoonGone = 0.1;    // part of its share that a point may have left when it goes
constexpr double kWithdrawn = 2e-4;  // m the tip goes back past a point before it lets go of it
constexpr std::uint64_t kRowsOfId = 4;

}  // namespace

TrackRows::TrackRows() : contacts(kMaxContacts), laws(kMaxRows), slip(Eigen::VectorXd::Zero(kMaxRows)) {}

NeedleTrack::NeedleTrack(const NeedleTrackSettings& settings, double needle_radius,
                         std::shared_ptr<const TissueMap> tissues)
    : settings_(settings),
      radius_(needle_radius),
      tissues_(tissues != nullptr ? std::move(tissues) : std::make_shared<const TissueMap>()),
      points_(kMostPoints),
      scratch_contacts_(kMostPoints + 1),
      scratch_bodies_(kMostPoints + 1) {}

void NeedleTrack::clear(TissuePoints& tissue) {
  count_ = 0;
  leaving_ = 0;
  tip_ = {};
  threaded_.fill(false);
  tissue.clear();
}

bool NeedleTrack::find(const TissuePatch& patch, TrackPoint& point) const {
  const BodyPatch& body = patch.bodies[static_cast<std::size_t>(point.body)];
  const auto end = body.tet_ids.begin() + body.tet_count;
  const auto at = std::lower_bound(body.tet_ids.begin(), end, point.place.tet);
  point.patch_tet = at != end && *at == point.place.tet ? static_cast<int>(at - body.tet_ids.begin()) : -1;
  if (point.patch_tet >= 0) point.place.patch_nodes = body.tet_nodes[static_cast<std::size_t>(point.patch_tet)];
  return point.patch_tet >= 0;
}

void NeedleTrack::load(const TissuePatch& patch, TissuePoints& tissue) {
  flags_ = 0;
  for (TrackPoint& point : points()) {
    if (!find(patch, point) && point.active) flags_ |= kNeedlePatchLeft;
  }
  if (tip_.state != TipState::outside && !find(patch, tip_.end)) flags_ |= kNeedlePatchLeft;
  for (TrackPoint& end : ends_) {
    if (end.body >= 0) find(patch, end);
  }
  place_points(patch, tissue);
}

void NeedleTrack::place_points(const TissuePatch& patch, TissuePoints& tissue) {
  std::size_t known = 0;
  const auto take = [&](TrackPoint& point) {
    point.point = point.patch_tet < 0 ? -1 : static_cast<int>(known);
    if (point.point < 0) return;
    scratch_contacts_[known] = point.place;
    scratch_bodies_[known++] = point.body;
  };
  for (TrackPoint& point : points()) take(point);
  if (tip_.state != TipState::outside) take(tip_.end);
  tissue.place(patch, {scratch_contacts_.data(), known}, {scratch_bodies_.data(), known});
}

void NeedleTrack::describe(const TissuePatch& patch, TrackPoint& point) const {
  const BodyPatch& body = patch.bodies[static_cast<std::size_t>(point.body)];
  point.site = {.tet_volume = tet_volume(body, point.patch_tet),
                .material = body.tet_materials[static_cast<std::size_t>(point.patch_tet)],
                .barycentric = point.place.barycentric};
}

void NeedleTrack::place(const HermiteShaft& shaft, const TissuePoints& tissue, double dt, TrackRows& out) {
  flags_ &= kNeedlePatchLeft;
  out.contact_count = 0;
  out.row_count = 0;
  std::array<ShaftPoint, kMostPoints> at;
  for (int i = 0; i < count_; ++i) {
    TrackPoint& point = points_[static_cast<std::size_t>(i)];
    if (point.point < 0 || !tissue.position(point.point).allFinite()) {
      point.active = false;
      continue;
    }
    ShaftPoint& here = at[static_cast<std::size_t>(i)];
    here = shaft.project(tissue.position(point.point), point.arc, point.arc);
    const bool was_active = point.active;
    point.active = point.arc <= shaft.length() + (was_active ? kWithdrawn : 0.0) && point.arc >= 0;
    if (point.active && !was_active) point.held_arc = point.arc;
  }
  double reach = shaft.length();  // the shaft is in the tissue up to the track's end, a little behind a tip that cuts
  if (tip_.state == TipState::inside && tip_.end.point >= 0) {
    reach += std::min(0.0, (tissue.position(tip_.end.point) - shaft.tip()).dot(shaft.tip_tangent()));
  }
  share_shaft(reach);
  for (int i = 0; i < count_; ++i) {
    const TrackPoint& point = points_[static_cast<std::size_t>(i)];
    if (point.active) add_contact(shaft, point, at[static_cast<std::size_t>(i)], dt, out);
  }
  if (tip_.state != TipState::outside && tip_.end.point >= 0) add_tip(shaft, dt, out);
}

void NeedleTrack::share_shaft(double reach) {
  for (int body = 0; body < kMaxBodies; ++body) {
    TrackPoint* previous = nullptr;
    TrackPoint* last = last_active(body);
    if (last == nullptr) continue;
    const bool tip_here = tip_.state == TipState::inside && tip_.end.body == body;
    const double overhang = std::max(0.0, tip_here ? reach - last->arc : overhang_[static_cast<std::size_t>(body)]);
    for (TrackPoint& point : points()) {
      if (point.body != body || !point.active) continue;
      point.share = 0;
      if (previous != nullptr) {
        const double gap = std::max(0.0, point.arc - previous->arc);
        const double grown = &point == last ? std::min(1.0, overhang / settings_.spacing) : 1.0;
        point.share = 0.5 * grown * gap;
        previous->share += gap - point.share;
      }
      previous = &point;
    }
    last->share += overhang;
    if (tip_here && leaving_ != 0) left_ = std::max(left_, std::min(1.0, overhang / settings_.spacing));
  }
  if (leaving_ == 0) return;
  for (int body = 0; body < kMaxBodies; ++body) share_out_leaving(body);
}

void NeedleTrack::share_out_leaving(int body) {
  TrackPoint* before = nullptr;
  TrackPoint* leaving = nullptr;
  TrackPoint* behind = nullptr;
  for (TrackPoint& point : points()) {
    if (point.body != body || !point.active || behind != nullptr) continue;
    (point.place.id == leaving_ ? leaving : leaving == nullptr ? before : behind) = &point;
  }
  if (leaving == nullptr || before == nullptr) return;
  const double gap_before = std::max(0.0, leaving->arc - before->arc);
  const double gap_behind = behind != nullptr ? std::max(0.0, behind->arc - leaving->arc) : 0;
  const double given = left_ * leaving->share;
  // What is left when it has gone is half way between the two.
  const double to_before =
      behind == nullptr ? given : given * gap_behind / std::max(gap_before + gap_behind, 1e-3 * settings_.spacing);
  leaving->share -= given;
  before->share += to_before;
  if (behind != nullptr) behind->share += given - to_before;
}

// The point with the least between its neighbours; of equal ones the oldest.
void NeedleTrack::choose_leaving() {
  constexpr double kEqual = 0.1;  // of the spacing
  leaving_ = 0;
  left_ = 0;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < count_ - kNearTip; ++i) {
    const TrackPoint& point = points_[static_cast<std::size_t>(i)];
    const TrackPoint* before = nullptr;
    const TrackPoint* behind = nullptr;
    for (int k = 0; k < count_; ++k) {
      const TrackPoint& other = points_[static_cast<std::size_t>(k)];
      if (other.body != point.body) continue;
      if (k < i) before = &other;
      if (k > i && behind == nullptr) behind = &other;
    }
    if (before == nullptr || behind == nullptr) continue;
    const double gap = behind->arc - before->arc;
    if (gap < least - kEqual * settings_.spacing) {
      least = gap;
      leaving_ = point.place.id;
    }
  }
}

// For one more point, at once.
bool NeedleTrack::make_room() {
  if (count_ < kMostPoints) return true;
  if (leaving_ == 0) choose_leaving();
  const auto rest = std::remove_if(points_.begin(), points_.begin() + count_,
                                   [&](const TrackPoint& point) { return point.place.id == leaving_; });
  if (left_ < 1 - kSoonGone || leaving_ == 0) flags_ |= kNeedleRowOverflow;  // that is felt
  count_ = static_cast<int>(rest - points_.begin());
  leaving_ = 0;
  return count_ < kMostPoints;
}

void NeedleTrack::add_contact(const HermiteShaft& shaft, const TrackPoint& point, const ShaftPoint& at, double dt,
                              TrackRows& out) const {
  const InsertionResistance& resistance = tissues_->resistance(point.tissue);
  ActiveContact& contact = out.contacts[static_cast<std::size_t>(out.contact_count++)];
  contact.point = point.point;
  contact.first_row = out.row_count;
  contact.row_count = resistance.resists_sliding() ? 3 : 2;
  contact.shaft = at;
  contact.directions << shaft.lateral_directions(at), at.tangent;
  const double share = point.share;
  const double held_by = std::hypot(share, kLeastShare * settings_.spacing);
  const ShaftCompliance soft =
      settings_.subgrid_compliance ? shaft_compliance(point.site, radius_, held_by) : ShaftCompliance{};
  const std::uint64_t id = kRowsOfId * point.place.id;
  const auto row = static_cast<std::size_t>(out.row_count);
  out.laws[row] = bilateral_row(id, soft.lateral);
  out.laws[row + 1] = bilateral_row(id + 1, soft.lateral);
  out.slip.segment<3>(out.row_count).setZero();
  if (contact.row_count == 3) {
    out.laws[row + 2] =
        friction_row(id + 2, share * resistance.friction_per_length, resistance.friction_coefficient,
                     {out.row_count, out.row_count + 1}, share * resistance.viscous_friction / dt, soft.axial);
    out.slip[out.row_count + 2] = point.held_arc - point.arc;
  }
  out.row_count += contact.row_count;
}

void NeedleTrack::add_tip(const HermiteShaft& shaft, double dt, TrackRows& out) const {
  const InsertionResistance& resistance = tissues_->resistance(tip_.end.tissue);
  const bool indenting = tip_.state == TipState::indenting;
  if (!indenting && tip_.barrier <= 0 && !resistance.resists_cutting()) return;
  ActiveContact& contact = out.contacts[static_cast<std::size_t>(out.contact_count++)];
  contact.point = tip_.end.point;
  contact.first_row = out.row_count;
  contact.row_count = 3;
  contact.shaft = shaft.at_tip();
  double norm = 1;
  if (indenting) {
    contact.directions.col(0) = tip_.inward;
  } else {
    contact.directions.col(0) = contact.shaft.tangent + settings_.bevel_ratio * shaft.tip_bevel();
    norm = contact.directions.col(0).norm();
    contact.directions.col(0) /= norm;
  }
  contact.directions.col(1) = contact.directions.col(0).unitOrthogonal();
  contact.directions.col(2) = contact.directions.col(0).cross(contact.directions.col(1));

  // A tip that is pressed on something is held sideways by it.
  const auto row = static_cast<std::size_t>(out.row_count);
  double compliance = 0;
  if (settings_.subgrid_compliance) {
    compliance = indenting ? surface_tip_compliance(tip_.end.site, settings_.tip_radius)
                           : channel_tip_compliance(tip_.end.site, settings_.tip_radius);
  }
  const double holds = tip_.barrier > 0 ? tip_.barrier : resistance.cutting_force;
  out.laws[row] = box_row(0, -holds * norm, 0, compliance);
  if (tip_.barrier <= 0) out.laws[row].viscosity = resistance.cutting_viscosity / dt;
  out.laws[row].viscous_upper = false;  // nothing is cut on the way back
  const std::array<int, 2> pressed{out.row_count, ContactRow::kNone};
  out.laws[row + 1] = disc_row(1, out.row_count + 2, 0, settings_.tip_friction, pressed, compliance);
  out.laws[row + 2] = disc_row(2, out.row_count + 1, 0, settings_.tip_friction, pressed, compliance);
  out.slip.segment<3>(out.row_count).setZero();
  out.row_count += 3;
}

void NeedleTrack::slide(const TrackRows& rows, const BoundedSolver& solver) {
  for (int c = 0; c < rows.contact_count; ++c) {
    const ActiveContact& contact = rows.contacts[static_cast<std::size_t>(c)];
    if (contact.row_count != 3) continue;
    const int row = contact.first_row + 2;
    for (TrackPoint& point : points()) {
      if (point.point != contact.point || !point.active) continue;
      if (solver.state(row) != RowState::sticking) {
        point.held_arc -= solver.motion()[static_cast<std::size_t>(row)];
      }
    }
  }
}

void NeedleTrack::advance(const HermiteShaft& shaft, const TissuePatch& patch, const TrackRows& rows,
                          const BoundedSolver& solver, Eigen::Ref<const Eigen::VectorXd> lambda, std::uint64_t step,
                          TissuePoints& tissue) {
  slide(rows, solver);
  if (tip_.state == TipState::outside) come_back(shaft.length());
  if (tip_.state == TipState::outside) touch(shaft, patch, tissue);
  if (tip_.state == TipState::inside && last_active(tip_.end.body) == nullptr) {  // withdrawn past the hole
    ends_[static_cast<std::size_t>(tip_.end.body)] = tip_.end;
    tip_ = {};
    place_points(patch, tissue);
  }
  if (tip_.state != TipState::outside && tip_.end.point >= 0) {
    advance_tip(shaft, patch, rows, solver, lambda, step, tissue);
  }
  if (tip_.state == TipState::inside && tip_.end.point >= 0) lay(shaft, patch, tissue);
}

// A tip in the air meets the surfaces that the simulation has seen ahead of it.
void NeedleTrack::touch(const HermiteShaft& shaft, const TissuePatch& patch, TissuePoints& tissue) {
  constexpr double kNear = 8e-3;  // m: beyond, the surface is no longer the plane through the crossing
  for (int i = 0; i < patch.interface_count; ++i) {
    const PatchInterface& surface = patch.interfaces[static_cast<std::size_t>(i)];
    if (!surface.entering || surface.patch_tet < 0 || last_active(surface.body) != nullptr) continue;
    const BodyPatch& body = patch.bodies[static_cast<std::size_t>(surface.body)];
    const auto& nodes = body.tet_nodes[static_cast<std::size_t>(surface.patch_tet)];
    Vector3d crossing = Vector3d::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      crossing +=
          surface.barycentric[static_cast<Eigen::Index>(k)] * tissue.node_position(patch, surface.body, nodes[k]);
    }
    const Vector3d gap = shaft.tip() - crossing;
    if (!(gap.norm() <= kNear) || !(gap.dot(surface.normal) <= 0)) continue;

    const auto b = static_cast<std::size_t>(surface.body);
    if (threaded_[b]) {  // its old hole?
      const auto first = std::find_if(points().begin(), points().end(),
                                      [&](const TrackPoint& point) { return point.body == surface.body; });
      const bool same = first != points().end() && first->point >= 0 && ends_[b].patch_tet >= 0 &&
                        (tissue.position(first->point) - shaft.tip()).norm() < settings_.reentry_distance;
      if (same) {
        first->active = true;
        first->arc = first->held_arc = shaft.length();
        tip_ = {.state = TipState::inside, .end = ends_[b]};
        place_points(patch, tissue);
        return;
      }
      const auto rest = std::remove_if(points_.begin(), points_.begin() + count_,
                                       [&](const TrackPoint& point) { return point.body == surface.body; });
      count_ = static_cast<int>(rest - points_.begin());
      threaded_[b] = false;
    }
    const PatchWalk at = walk_patch(patch, surface.body, surface.patch_tet, shaft.tip(), tissue);
    tip_ = {};
    tip_.state = TipState::indenting;
    tip_.inward = -surface.normal;
    tip_.end.body = surface.body;
    tip_.end.patch_tet = at.patch_tet;
    tip_.end.place = {
        .id = 0, .tet = body.tet_ids[static_cast<std::size_t>(at.patch_tet)], .barycentric = at.barycentric};
    tip_.end.place.patch_nodes = body.tet_nodes[static_cast<std::size_t>(at.patch_tet)];
    describe(patch, tip_.end);
    tip_.beyond = tissues_->at(rest_position(patch, tip_.end.body, tip_.end.place), 1);
    tip_.end.tissue = tip_.beyond;
    tip_.barrier = tissues_->puncture_force(0, tip_.beyond);
    place_points(patch, tissue);
    if (tissue.finite()) return;
    flags_ |= kNeedleNonFinite;  // the patch is no good there: not met yet
    tip_ = {};
    place_points(patch, tissue);
    return;
  }
}

void NeedleTrack::advance_tip(const HermiteShaft& shaft, const TissuePatch& patch, const TrackRows& rows,
                              const BoundedSolver& solver, Eigen::Ref<const Eigen::VectorXd> lambda,
                              std::uint64_t step, TissuePoints& tissue) {
  const ActiveContact* contact = nullptr;  // the tip's own; null: nothing resists, or it has only just been laid
  if (rows.contact_count > 0) {
    const ActiveContact& last = rows.contacts[static_cast<std::size_t>(rows.contact_count) - 1];
    if (last.point == tip_.end.point) contact = &last;
  }
  if (tip_.state == TipState::indenting) {
    if (tip_.barrier <= 0) {
      enter(step, 0);
    } else if (contact != nullptr) {
      const int row = contact->first_row;
      if (solver.state(row) == RowState::upper) {  // let go of
        tip_.state = TipState::outside;
        place_points(patch, tissue);
        return;
      }
      if (solver.state(row) == RowState::lower) enter(step, -lambda[row]);
    }
    if (tip_.state != TipState::inside) return;
    if (make_room()) {  // the hole in the surface is the track's first point
      TrackPoint& first = points_[static_cast<std::size_t>(count_++)];
      first = tip_.end;
      first.place.id = next_id_++;
      first.active = true;
      first.arc = first.held_arc = shaft.length();
      place_points(patch, tissue);
    }
    return;
  }

  if (contact == nullptr) {
    const Vector3d ahead = shaft.tip() - tissue.position(tip_.end.point);
    if (ahead.dot(shaft.tip_tangent()) > 0) move_end(shaft, shaft.tip(), patch, tissue);
  } else if (solver.state(contact->first_row) == RowState::lower) {
    const int row = contact->first_row;
    if (tip_.barrier > 0) {
      record(step, tip_.beyond, -lambda[row]);
      tip_.end.tissue = tip_.beyond;
      tip_.barrier = 0;
    }
    // The new end has u = 0: it is off the tip by what the tissue next to it gives way. Sideways that fades as the
    // tip goes on: new tissue has not been pushed yet.
    const double faded = std::exp(-solver.motion()[static_cast<std::size_t>(row)] / settings_.side_length);
    Vector3d give = solver.compliance(row) * lambda[row] * contact->directions.col(0);
    for (int k = 1; k < 3; ++k) {
      give += faded * solver.compliance(row + k) * lambda[row + k] * contact->directions.col(k);
    }
    move_end(shaft, shaft.tip() + give, patch, tissue);
  }
}

void NeedleTrack::enter(std::uint64_t step, double force) {
  record(step, tip_.beyond, force);
  tip_.end.tissue = tip_.beyond;
  tip_.state = TipState::inside;
  tip_.barrier = 0;
  threaded_[static_cast<std::size_t>(tip_.end.body)] = true;
}

void NeedleTrack::record(std::uint64_t step, int to, double force) {
  const int from = tip_.state == TipState::indenting ? 0 : tip_.end.tissue;
  if (force <= 0) return;  // nothing there to break
  ++punctures_;
  last_puncture_ = {.step = step, .body = tip_.end.body, .from = from, .to = to, .force = force};
}

void NeedleTrack::move_end(const HermiteShaft& shaft, const Vector3d& target, const TissuePatch& patch,
                           TissuePoints& tissue) {
  TrackPoint& end = tip_.end;
  if ((target - tissue.position(end.point)).dot(shaft.tip_tangent()) <= 0) return;
  const PatchWalk at = walk_patch(patch, end.body, end.patch_tet, target, tissue);
  if (at.left == PatchWalk::Left::patch) {
    flags_ |= kNeedlePatchLeft;
    return;
  }
  if (at.left == PatchWalk::Left::body) {
    const TrackPoint* last = last_active(end.body);
    overhang_[static_cast<std::size_t>(end.body)] = last != nullptr ? shaft.length() - last->arc : 0;
    ends_[static_cast<std::size_t>(end.body)] = end;
    tip_ = {};
    place_points(patch, tissue);
    return;
  }
  const BodyPatch& body = patch.bodies[static_cast<std::size_t>(end.body)];
  const bool moved_on = at.patch_tet != end.patch_tet;
  const TrackPoint before = end;
  end.patch_tet = at.patch_tet;
  end.place.tet = body.tet_ids[static_cast<std::size_t>(at.patch_tet)];
  end.place.patch_nodes = body.tet_nodes[static_cast<std::size_t>(at.patch_tet)];
  end.place.barycentric = at.barycentric;
  if (moved_on) describe(patch, end);
  end.site.barycentric = end.place.barycentric;
  if (!tissue.move_last(patch, end.place, end.body)) {
    flags_ |= kNeedleNonFinite;
    end = before;
    return;
  }
  meet_tissue(patch);
}

void NeedleTrack::meet_tissue(const TissuePatch& patch) {
  const int here = tissues_->at(rest_position(patch, tip_.end.body, tip_.end.place), tip_.end.tissue);
  if (here == tip_.end.tissue || tip_.barrier > 0) return;
  tip_.barrier = tissues_->puncture_force(tip_.end.tissue, here);
  tip_.beyond = here;
  if (tip_.barrier <= 0) tip_.end.tissue = here;
}

void NeedleTrack::lay(const HermiteShaft& shaft, const TissuePatch& patch, TissuePoints& tissue) {
  const TrackPoint* last = last_active(tip_.end.body);
  const double arc = shaft.length() + (tissue.position(tip_.end.point) - shaft.tip()).dot(shaft.tip_tangent());
  // Withdrawn, the end is ahead of the tip, and the points up to there are laid already.
  if (last == nullptr || arc > shaft.length() + kWithdrawn || arc - last->arc < settings_.spacing) return;
  if (!make_room()) return;
  TrackPoint& point = points_[static_cast<std::size_t>(count_++)];
  point = tip_.end;
  point.place.id = next_id_++;
  point.active = true;
  point.arc = point.held_arc = arc;
  if (count_ == kMostPoints) choose_leaving();
  place_points(patch, tissue);
}

// A tip that went through a body is in it again when it is back where it left.
void NeedleTrack::come_back(double length) {
  for (int body = 0; body < kMaxBodies; ++body) {
    const auto b = static_cast<std::size_t>(body);
    const TrackPoint* last = last_active(body);
    if (last == nullptr || !threaded_[b] || length - last->arc > overhang_[b]) continue;
    tip_ = {.state = TipState::inside, .end = ends_[b]};
    tip_.end.point = -1;  // known to the tissue points from the next patch on
  }
}

NeedleTrack::TrackPoint* NeedleTrack::last_active(int body) {
  TrackPoint* last = nullptr;
  for (TrackPoint& point : points()) {
    if (point.body == body && point.active) last = &point;
  }
  return last;
}

void NeedleTrack::publish(const TissuePoints& tissue, double beam_length, double length, NeedleState& out) const {
  const int last_beam = static_cast<int>(std::lround(length / beam_length)) - 1;
  const auto add = [&](const TrackPoint& point) -> NeedleContact& {
    NeedleContact& to = out.contacts[static_cast<std::size_t>(out.track_count++)];
    to = {.id = point.place.id, .body = point.body, .tet = point.place.tet, .barycentric = point.place.barycentric};
    if (point.point >= 0) {
      to.position = tissue.position(point.point);
      to.force = tissue.force(point.point);
    }
    return to;
  };
  out.track_count = 0;
  out.tip_depth = 0;
  for (const TrackPoint& point : points()) {
    if (!point.active) continue;
    NeedleContact& to = add(point);
    to.beam = std::clamp(static_cast<int>(point.arc / beam_length), 0, last_beam);
    to.beam_fraction = std::clamp(point.arc / beam_length - to.beam, 0.0, 1.0);
    if (point.body == tip_.end.body) out.tip_depth = std::max(out.tip_depth, length - point.arc);
  }
  out.contact_count = out.track_count;
  for (const TrackPoint& point : points()) {
    if (!point.active) add(point);
  }
  if (tip_.state != TipState::outside) add(tip_.end);
  out.tip = tip_.state;
  out.tip_body = tip_.state == TipState::outside ? -1 : tip_.end.body;
  out.puncture_count = punctures_;
  out.last_puncture = last_puncture_;
}

}  // namespace stylet::physics
