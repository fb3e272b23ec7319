#include "physics/contact/needle_track.h"

#include "physics/contact/patch_walk.h"
#include "physics/contact/subgrid_compliance.h"
#include "physics/needle/rotation_vector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

namespace stylet::physics {
namespace {

/// Share of the spacing, at least, by which a contact is held: a softer one holds nothing that a hand could feel, and
/// C ~ 1/share is the condition of W + C.
constexpr double kLeastShare = 1.0 / 300;
constexpr double kWithdrawn = 2e-4;  // m the tip goes back past a point before it lets go of it
constexpr std::uint64_t kRowsOfId = 4;
// m; no tissue is stretched beside the shaft by more, and a shaft that comes back farther beside its track cuts anew.
constexpr double kFarBeside = 20e-3;
constexpr double kLeastTurn = 1e-3;  // rad of the hub about its axis before friction resists it: nothing felt

bool holds_active(std::span<const TrackPoint> points, int body) {
  return std::ranges::any_of(points, [&](const TrackPoint& point) { return point.body == body && point.active; });
}

/// Lateral rows are bounded from the step on after one that was beyond the strength: until then they are as they
/// would be without it.
bool pressed_hard(const TrackPoint& point, double strength) {
  return strength > 0 && (point.cuts || point.pressed > strength);
}

/// What a point is farther beside the shaft than tissue stretches.
Eigen::Vector3d too_far_beside(const Eigen::Vector3d& point, const Eigen::Vector3d& shaft,
                               const Eigen::Vector3d& tangent) {
  const Eigen::Vector3d beside = shaft - point - (shaft - point).dot(tangent) * tangent;
  const double distance = beside.norm();
  return distance > kFarBeside ? Eigen::Vector3d((1 - kFarBeside / distance) * beside) : Eigen::Vector3d::Zero();
}

double held_share(const TrackPoint& point, double spacing) {
  return std::hypot(point.share, kLeastShare * spacing);
}

}  // namespace

TrackRows::TrackRows() : contacts(kMaxContacts), laws(kMaxRows), slip(Eigen::VectorXd::Zero(kMaxRows)) {}

NeedleTrack::NeedleTrack(const NeedleTrackSettings& settings, double needle_radius,
                         std::shared_ptr<const TissueMap> tissues)
    : settings_(settings),
      radius_(needle_radius),
      tissues_(tissues != nullptr ? std::move(tissues) : std::make_shared<const TissueMap>()),
      points_(settings.spacing),
      tip_(settings, needle_radius, tissues_),
      scratch_contacts_(TrackPoints::kMost + 1),
      scratch_bodies_(TrackPoints::kMost + 1) {}

void NeedleTrack::clear(TissuePoints& tissue) {
  turns_ = known_ = false;
  points_.clear();
  tip_.clear();
  tissue.clear();
}

void NeedleTrack::load(const TissuePatch& patch, TissuePoints& tissue) {
  flags_ = 0;
  for (TrackPoint& point : points_.all()) {
    if (!find_or_keep(patch, tissue, point) && point.active) flags_ |= kNeedlePatchLeft;
  }
  if (!tip_.find(patch, tissue)) flags_ |= kNeedlePatchLeft;
  tissue.take_organs(patch);
  place_points(patch, tissue);
  tissue.settle_organs(patch);
  tissue.hand_over();
}

void NeedleTrack::place_points(const TissuePatch& patch, TissuePoints& tissue) {
  std::size_t known = 0;
  const auto take = [&](TrackPoint& point) {
    point.point = point.patch_tet < 0 && !point.place.kept ? -1 : static_cast<int>(known);
    if (point.point < 0) return;
    scratch_contacts_[known] = point.place;
    scratch_bodies_[known++] = point.body;
  };
  for (TrackPoint& point : points_.all()) take(point);
  if (!tip_.outside()) take(tip_.end());
  tissue.place(patch, {scratch_contacts_.data(), known}, {scratch_bodies_.data(), known});
}

void NeedleTrack::place(const HermiteShaft& shaft, TissuePoints& tissue, double dt, TrackRows& out) {
  flags_ &= kNeedlePatchLeft;
  tissue.go_on();
  dt_ = dt;
  out.contact_count = 0;
  out.row_count = 0;
  turns_ = turn(shaft);
  strayed_ = -1;
  std::array<ShaftPoint, TrackPoints::kMost> at;
  const auto points = points_.all();
  for (std::size_t i = 0; i < points.size(); ++i) {
    TrackPoint& point = points[i];
    if (point.point < 0 || !tissue.position(point.point).allFinite()) {
      point.lost = point.lost || point.active;
      point.active = false;
      continue;
    }
    at[i] = shaft.project(tissue.position(point.point), point.arc, point.arc);
    const bool was_active = point.active;
    point.active = point.arc <= shaft.length() + (was_active ? kWithdrawn : 0.0) && point.arc >= 0;
    if (point.active && !was_active) {
      // Out of the body altogether, the tip finds its track again through the old hole alone, not from beside it. A
      // patch that lacked the track for a while is another matter: the needle is in it still.
      const double beside = (tissue.position(point.point) - at[i].position).norm();
      const bool in_body = holds_active(points.first(i), point.body);
      if (!point.lost && in_body && beside > kFarBeside) strayed_ = point.body;
      point.active = point.lost || (in_body ? beside <= kFarBeside : beside < settings_.reentry_distance);
    }
    point.lost = false;
    if (point.active && !was_active) {
      point.held_arc = point.arc;
      point.bristles = {};
      point.turned = 0;
    }
  }
  tip_.begin_unpressed(shaft, tissue);
  share_shaft(tip_.reach(shaft, tissue));
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].active) add_contact(shaft, points[i], at[i], dt, out);
  }
  if (!tip_.outside() && tip_.end().point >= 0) tip_.add_rows(shaft, dt, out);
}

void NeedleTrack::share_shaft(double reach) {
  for (int body = 0; body < kMaxBodies; ++body) {
    const TrackPoint* last = points_.last_active(body);
    if (last == nullptr) continue;
    const double overhang = tip_.overhang(*last, reach);
    points_.share_shaft(body, tip_.end_in(body), overhang, *tissues_);
    if (tip_.state() == TipState::inside && tip_.end().body == body) points_.fade_leaving(overhang);
  }
  points_.share_out_leaving();
}

void NeedleTrack::add_contact(const HermiteShaft& shaft, const TrackPoint& point, const ShaftPoint& at, double dt,
                              TrackRows& out) const {
  const InsertionResistance& resistance = tissues_->resistance(point.tissue);
  ActiveContact& contact = out.contacts[out.contact_count++];
  contact.point = point.point;
  contact.first_row = out.row_count;
  contact.row_count = !resistance.resists_sliding() ? 2 : turns_ ? 4 : 3;
  contact.lever = radius_;
  contact.shaft = at;
  contact.directions << shaft.lateral_directions(at), at.tangent;
  const double share = point.share;
  const double held_by = held_share(point, settings_.spacing);
  SubgridSite site = point.site;
  if (point.modulus > 0) site.material.young_modulus = point.modulus * site.strained;
  const ShaftCompliance soft =
      settings_.subgrid_compliance ? shaft_compliance(site, radius_, held_by) : ShaftCompliance{};
  const std::uint64_t id = kRowsOfId * point.place.id;
  const auto row = static_cast<std::size_t>(out.row_count);
  // A piece of shaft shorter than it is thick presses with its end, too.
  const double strength = grip(point) * resistance.side_strength * std::max(held_by, 2 * radius_);
  if (point.torn > 0 || pressed_hard(point, strength)) {
    out.laws[row] =
        disc_row(id, out.row_count + 1, strength, 0, {ContactRow::kNone, ContactRow::kNone}, soft.lateral);
    out.laws[row + 1] =
        disc_row(id + 1, out.row_count, strength, 0, {ContactRow::kNone, ContactRow::kNone}, soft.lateral);
  } else {
    out.laws[row] = bilateral_row(id, soft.lateral);
    out.laws[row + 1] = bilateral_row(id + 1, soft.lateral);
  }
  out.slip.segment<3>(out.row_count).setZero();
  const std::array<int, 2> lateral{out.row_count, out.row_count + 1};
  const double adhesion = grip(point) * share * resistance.friction_per_length;
  const double viscosity = grip(point) * share * resistance.viscous_friction / dt;
  const bool lugre = settings_.friction == ShaftFriction::lugre;
  if (contact.row_count > 2) out.slip[out.row_count + 2] = point.held_arc - point.arc;
  if (contact.row_count > 2 && lugre) {
    const LugreRow bristles = lugre_row(point);
    out.laws[row + 2] = bilateral_row(id + 2, soft.axial + bristles.compliance);
    out.slip[out.row_count + 2] += bristles.offset;
  } else if (contact.row_count > 2) {
    out.laws[row + 2] =
        friction_row(id + 2, adhesion, resistance.friction_coefficient, lateral, viscosity, soft.axial);
  }
  if (contact.turns()) {
    out.laws[row + 3] = friction_row(id + 3, adhesion, resistance.friction_coefficient, lateral, viscosity,
                                     turn_compliance(site, held_by));
    out.slip[out.row_count + 3] = point.turned + radius_ * hub_turn_.dot(at.tangent);
    if (!lugre) {  // along and round, it slides one way
      out.laws[row + 2].across = out.row_count + 3;
      out.laws[row + 3].across = out.row_count + 2;
    }
  }
  out.row_count += contact.row_count;
}

// Its Coulomb friction is of the force that presses the shaft on the tissue in the step before.
LugreRow NeedleTrack::lugre_row(const TrackPoint& point) const {
  const InsertionResistance& resistance = tissues_->resistance(point.tissue);
  const double length = grip(point) * held_share(point, settings_.spacing);
  return {settings_.lugre,
          length * resistance.friction_per_length + resistance.friction_coefficient * point.pressed,
          length * resistance.viscous_friction,
          length,
          point.bristles,
          dt_};
}

/// Whether friction resists the shaft's turning: from when the hub has turned until nothing is left of it in the
/// shaft.
bool NeedleTrack::turn(const HermiteShaft& shaft) {
  hub_turn_ = known_ ? logarithm(shaft.hub_orientation() * hub_.conjugate()) : Eigen::Vector3d::Zero();
  const auto points = points_.all();
  if (std::ranges::none_of(points, &TrackPoint::active)) {
    idle_turn_ = 0;
    return false;
  }
  idle_turn_ += hub_turn_.dot(shaft.hub_tangent());
  return turns_ || std::abs(idle_turn_) > kLeastTurn;
}

void NeedleTrack::slide(const SolvedStep& step) {
  for (int c = 0; c < step.rows.contact_count; ++c) {
    const ActiveContact& contact = step.rows.contacts[c];
    const int row = contact.first_row + 2;
    for (TrackPoint& point : points_.all()) {
      if (point.point != contact.point || !point.active) continue;
      point.pressed = std::hypot(step.lambda[row - 2], step.lambda[row - 1]);
      // What has not slid past the point has gone round with the tissue next to the shaft.
      if (contact.turns()) point.turned = -step.solver.compliance(row + 1) * step.lambda[row + 1];
      if (contact.row_count < 3) continue;
      if (settings_.friction == ShaftFriction::lugre) {
        point.held_arc -= lugre_row(point).advance(step.lambda[row], dt_, point.bristles);
      } else if (step.solver.state(row) != RowState::sticking) {
        point.held_arc -= step.motion(row);
      }
    }
  }
}

/// How far tissue beside a point gives way to the shaft in this step, and what cutting it takes.
NeedleTrack::Cut NeedleTrack::cut_at(const SolvedStep& step, const TissuePoints& tissue,
                                     const TrackPoint& point) const {
  for (int c = 0; c < step.rows.contact_count && point.active; ++c) {
    const ActiveContact& contact = step.rows.contacts[c];
    if (contact.point != point.point) continue;
    const int row = contact.first_row;
    if (!step.rows.laws[row].bilateral && step.solver.state(row) != RowState::sticking) {
      const Eigen::Vector2d slid(step.motion(row), step.motion(row + 1));
      return {contact.directions.leftCols<2>() * slid, slid.norm(), -slid.dot(step.lambda.segment<2>(row))};
    }
    if (tissues_->resistance(point.tissue).side_strength <= 0) break;
    double arc = point.arc;
    const ShaftPoint at = step.shaft.project(tissue.position(point.point), arc, arc);
    return {too_far_beside(tissue.position(point.point), at.position, at.tangent)};
  }
  return {};
}

// Where the lateral rows slide, the tissue beside the shaft is cut, and the point goes with the shaft. It never comes
// back by itself: what was cut has not stored anything.
void NeedleTrack::cut_aside(const SolvedStep& step, TissuePoints& tissue) {
  for (TrackPoint& point : points_.all()) {
    point.cuts = false;
    point.torn = 0;
    if (point.point < 0) continue;
    const Cut cut = cut_at(step, tissue, point);
    point.cuts = !cut.aside.isZero(0);
    const bool behind = !point.place.rigid && !point.place.offset.isZero(0);  // for want of a patch
    if (!point.cuts && (!behind || point.patch_tet < 0)) continue;
    const Eigen::Vector3d before = tissue.position(point.point);
    const double out = move_aside(step.patch, before + cut.aside, point, tissue);
    if (!point.cuts) continue;
    point.torn = out;
    if (&point == points_.last_active(tip_.end().body)) {
      tip_.go_aside(step, tissue.position(point.point) - before, tissue);
    }
    if (cut.slid <= 0) continue;
    const double in_tissue = std::max(0.0, 1 - out / cut.slid);
    side_cut_ += in_tissue * point.share * cut.slid;
    side_work_ += in_tissue * cut.work;
  }
  if (!tip_.inside() || tissues_->resistance(tip_.end().tissue).side_strength <= 0) return;
  const Eigen::Vector3d end = tissue.position(tip_.end().point);
  const Eigen::Vector3d aside = too_far_beside(end, step.shaft.tip(), step.shaft.tip_tangent());
  if (!aside.isZero(0)) tip_.go_aside(step, aside, tissue);
}

double NeedleTrack::move_aside(const TissuePatch& patch, const Eigen::Vector3d& target, TrackPoint& point,
                               TissuePoints& tissue) {
  const BodyPatch& body = patch.bodies[point.body];
  const TrackPoint before = point;
  if (point.patch_tet < 0) {  // kept without a patch that has it: beside it, too, until one does
    const Eigen::Vector3d aside = target - tissue.position(point.point);
    point.place.offset += aside;
    point.place.free_position += aside;
    if (!tissue.move(patch, point.point, point.place)) {
      point = before;
      flags_ |= kNeedleNonFinite;
    }
    return 0;
  }
  const PatchWalk at = walk_from(patch, point, target, tissue);
  point.patch_tet = at.patch_tet;
  point.place.tet = body.tet_ids[at.patch_tet];
  point.place.patch_nodes = body.tet_nodes[at.patch_tet];
  for (std::size_t k = 0; k < 4; ++k) point.place.nodes[k] = body.node_ids[point.place.patch_nodes[k]];
  point.place.barycentric = at.barycentric;
  point.place.offset.setZero();
  bool moved = tissue.move(patch, point.point, point.place);
  if (moved && at.left == PatchWalk::Left::patch) {  // the next one holds more: until then that much beside
    point.place.offset = target - tissue.position(point.point);
    moved = tissue.move(patch, point.point, point.place);
  }
  if (!moved) {
    point = before;
    flags_ |= kNeedleNonFinite;
    return 0;
  }
  point.rest = rest_position(patch, point.body, point.place);
  point.site = site_in_patch(patch, point);
  point.tissue = tissues_->at(point.rest, point.tissue);
  return at.left == PatchWalk::Left::body ? (target - tissue.position(point.point)).norm() : 0;
}

void NeedleTrack::advance(const SolvedStep& step, TissuePoints& tissue) {
  const HermiteShaft& shaft = step.shaft;
  const TissuePatch& patch = step.patch;
  hub_ = shaft.hub_orientation();
  known_ = true;
  slide(step);
  cut_aside(step, tissue);
  if (tip_.tear_out(points_)) place_points(patch, tissue);
  if (strayed_ >= 0 && tip_.begin_anew(strayed_, step, tissue, points_)) place_points(patch, tissue);
  tip_.sweep(shaft, patch, points_);
  if (tip_.outside() && tip_.come_back(points_, shaft.length())) place_points(patch, tissue);
  if (tip_.outside() && tip_.touch(shaft, patch, tissue, points_)) {
    place_points(patch, tissue);
    if (!tissue.finite()) {  // the patch is no good there: not met yet
      flags_ |= kNeedleNonFinite;
      tip_.let_go();
      place_points(patch, tissue);
    }
  }
  if (tip_.withdraw(points_)) place_points(patch, tissue);
  if (tip_.advance(step, tissue, points_)) place_points(patch, tissue);
  if (tip_.inside()) lay(shaft, patch, tissue);
  flags_ |= tip_.take_flags();
}

void NeedleTrack::lay(const HermiteShaft& shaft, const TissuePatch& patch, TissuePoints& tissue) {
  if (tip_.end().patch_tet < 0) return;  // kept: a point beside it would not have its compliance
  const TrackPoint* last = points_.last_active(tip_.end().body);
  const double arc = shaft.length() + (tissue.position(tip_.end().point) - shaft.tip()).dot(shaft.tip_tangent());
  // Withdrawn, the end is ahead of the tip, and the points up to there are laid already.
  if (last == nullptr || arc > shaft.length() + kWithdrawn || arc - last->arc < settings_.spacing) return;
  if (!points_.lay(tip_.end(), arc)) flags_ |= kNeedleRowOverflow;
  place_points(patch, tissue);
}

void NeedleTrack::publish(const TissuePoints& tissue, double beam_length, double length, NeedleState& out) const {
  const int last_beam = static_cast<int>(std::lround(length / beam_length)) - 1;
  const auto add = [&](const TrackPoint& point) -> NeedleContact& {
    NeedleContact& to = out.contacts[out.track_count++];
    to = {.id = point.place.id, .body = point.body, .tet = point.place.tet, .barycentric = point.place.barycentric};
    to.cuts = point.cuts || (!point.place.rigid && !point.place.offset.isZero(0));
    if (point.point >= 0) {
      to.position = tissue.position(point.point);
      to.force = tissue.force(point.point);
    }
    return to;
  };
  out.track_count = 0;
  out.tip_depth = 0;
  for (const TrackPoint& point : points_.all()) {
    if (!point.active) continue;
    NeedleContact& to = add(point);
    to.beam = std::clamp(static_cast<int>(point.arc / beam_length), 0, last_beam);
    to.beam_fraction = std::clamp(point.arc / beam_length - to.beam, 0.0, 1.0);
    if (point.body == tip_.end().body) out.tip_depth = std::max(out.tip_depth, length - point.arc);
  }
  out.contact_count = out.track_count;
  for (const TrackPoint& point : points_.all()) {
    if (!point.active) add(point);
  }
  if (!tip_.outside()) add(tip_.end());
  out.damage.side_cut = side_cut_;
  out.damage.side_work = side_work_;
  tip_.publish(out);
}

}  // namespace stylet::physics
