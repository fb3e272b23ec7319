#include "physics/contact/needle_tip.h"

#include "physics/contact/patch_walk.h"
#include "physics/contact/subgrid_compliance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace stylet::physics {

using Eigen::Vector3d;

namespace {

constexpr double kBite = 2;       // times `tip_friction` on a surface: a sharp tip that slants bites
constexpr double kApart = 3e-3;   // m beyond a body that the tip has gone through, from where on it is met anew
constexpr double kLetGo = 2e-4;   // m off a surface that is let go of, so that the next step inwards meets it
constexpr double kBeside = 5e-3;  // m; a tip that was drawn back and comes so far beside the end is not pulled there
constexpr double kEndStride = 1e-3;       // m; the end goes no further between two looks at the tissue there
constexpr int kMostEndStrides = 8;        // of a step, where the end has to catch up
constexpr double kFarCut = 3e-3;          // m cut in a step, from where on the end is taken for another one
constexpr double kEasier = 4;             // times what is eased off, at least: the length over which it fades
constexpr double kBoneCompliance = 1e-6;  // m/N; as little as a needle of steel gives way along its whole shaft

}  // namespace

NeedleTip::NeedleTip(const NeedleTrackSettings& settings, double needle_radius,
                     std::shared_ptr<const TissueMap> tissues)
    : settings_(settings),
      radius_(needle_radius),
      tissues_(std::move(tissues)),
      places_(Eigen::Matrix3Xd::Zero(3, kMaxContacts)) {}

void NeedleTip::clear() {
  leave();
  threaded_.fill(false);
  sweep_.clear();
}

void NeedleTip::leave() {
  state_ = TipState::outside;
  end_ = {};
  barrier_ = 0;
  pressed_ = 0;
  caught_up_.fill(0);
  beyond_ = 0;
  lag_ = 0;
  came_back_ = false;
  inward_.setZero();
  side_.setZero();
  ease_.setZero();
}

bool NeedleTip::find(const TissuePatch& patch, const TissuePoints& tissue) {
  const bool found = outside() || find_or_keep(patch, tissue, end_);
  for (TrackPoint& end : ends_) {
    if (end.body >= 0) find_in_patch(patch, end);
  }
  return found;
}

double NeedleTip::reach(const HermiteShaft& shaft, const TissuePoints& tissue) const {
  if (!inside()) return shaft.length();
  const Vector3d behind = tissue.position(end_.point) + ease_ - shaft.tip();
  return shaft.length() + std::min(0.0, behind.dot(shaft.tip_tangent()) + lag_);
}

double NeedleTip::overhang(const TrackPoint& last, double reach) const {
  const bool here = state_ == TipState::inside && end_.body == last.body;
  return std::max(0.0, here ? reach - last.arc : std::min(reach - last.arc, overhang_[last.body]));
}

double NeedleTip::crept() const {
  if (state_ != TipState::indenting || !settings_.subgrid_compliance) return 0;
  double crept = 0;
  for (std::size_t i = 0; i < caught_up_.size(); ++i) {
    crept += end_.site.material.relaxation[i].share * caught_up_[i];
  }
  return crept;
}

// At the dent that stays, as a point of the tissue does at its strain.
void NeedleTip::relax(double dent, double dt) {
  for (std::size_t i = 0; i < caught_up_.size(); ++i) {
    caught_up_[i] -= std::expm1(-dt / end_.site.material.relaxation[i].time_s) * (dent - caught_up_[i]);
  }
}

double NeedleTip::cutting_force() const {
  return tissues_->resistance(end_.tissue).cutting_force;
}

double NeedleTip::compliance() const {
  if (end_.place.rigid) return kBoneCompliance;
  if (!settings_.subgrid_compliance) return 0;
  // Tissue that stiffens spreads the load of a thin tip itself.
  const SubgridSite& site = end_.site;
  if (state_ == TipState::indenting) {
    return stiffens(site) ? stiffened_tip_compliance(site, radius_, pressed_)
                          : surface_tip_compliance(site, settings_.tip_radius);
  }
  const double spread = channel_tip_compliance(site, settings_.tip_radius);
  return site.material.stiffening > 0 ? std::min(spread, stiffened_channel_compliance(site, radius_, cutting_force()))
                                      : spread;
}

void NeedleTip::add_rows(const HermiteShaft& shaft, double dt, TrackRows& out) const {
  const InsertionResistance& resistance = tissues_->resistance(end_.tissue);
  const bool indenting = state_ == TipState::indenting;
  if (!indenting && barrier_ <= 0 && !resistance.resists_cutting()) return;
  ActiveContact& contact = out.contacts[out.contact_count++];
  contact.point = end_.point;
  contact.first_row = out.row_count;
  contact.row_count = 3;
  contact.shaft = shaft.at_tip();
  contact.directions.col(0) = indenting ? inward_ : contact.shaft.tangent;
  contact.directions.col(1) = contact.directions.col(0).unitOrthogonal();
  contact.directions.col(2) = contact.directions.col(0).cross(contact.directions.col(1));

  // A tip that is pressed on something is held sideways by it.
  const auto row = static_cast<std::size_t>(out.row_count);
  const double compliance = this->compliance();
  const double holds = barrier_ > 0 ? barrier_ : resistance.cutting_force;
  out.laws[row] = box_row(0, -holds, 0, compliance);
  if (barrier_ <= 0) out.laws[row].viscosity = resistance.cutting_viscosity / dt;
  out.laws[row].viscous_upper = false;  // nothing is cut on the way back
  const std::array<int, 2> pressed{out.row_count, ContactRow::kNone};
  const double friction = (indenting ? kBite : 1) * settings_.tip_friction;
  out.laws[row + 1] = disc_row(1, out.row_count + 2, 0, friction, pressed, compliance);
  out.laws[row + 2] = disc_row(2, out.row_count + 1, 0, friction, pressed, compliance);
  out.slip[out.row_count] = -lag_ - crept();
  out.slip.segment<2>(out.row_count + 1) = -contact.directions.rightCols<2>().transpose() * side_;
  out.slip.segment<3>(out.row_count) -= contact.directions.transpose() * ease_;
  out.row_count += 3;
}

// A tip that went through a body is in it again when it is back where it left.
bool NeedleTip::come_back(TrackPoints& points, double length) {
  for (int body = 0; body < kMaxBodies; ++body) {
    const TrackPoint* last = points.last_active(body);
    if (last == nullptr || !threaded_[body] || length - last->arc > overhang_[body]) continue;
    leave();
    state_ = TipState::inside;
    end_ = ends_[body];
    came_back_ = true;
    return true;
  }
  return false;
}

void NeedleTip::begin_unpressed(const HermiteShaft& shaft, const TissuePoints& tissue) {
  if (!came_back_ || end_.point < 0) return;
  came_back_ = false;
  const Vector3d ahead = shaft.tip() - tissue.position(end_.point);
  const double along = ahead.dot(shaft.tip_tangent());
  lag_ = std::max(0.0, along);
  side_ = ahead - along * shaft.tip_tangent();
}

void NeedleTip::sweep(const HermiteShaft& shaft, const TissuePatch& patch, TrackPoints& points) {
  std::array<bool, kMaxBodies> watched{};
  for (int body = 0; body < kMaxBodies; ++body) {
    const TrackPoint* last = points.last_active(body);
    // The surface that it has left by is not met from outside: it moves with the force on the track.
    const bool beyond = last == nullptr || shaft.length() - last->arc > overhang_[body] + kApart;
    watched[body] = beyond && (outside() || end_.body != body);
  }
  sweep_.follow(patch, shaft.tip(), shaft.tip_tangent(), watched, held_up_);
  if (sweep_.late()) flags_ |= kNeedleSurfaceLate;
}

// A tip that is in no track presses on the surface that it has gone through since, there where it did.
bool NeedleTip::touch(const HermiteShaft& shaft, const TissuePatch& patch, const TissuePoints& tissue,
                      TrackPoints& points) {
  const int body = sweep_.entered();
  if (body < 0) return begin_inside(shaft, patch, tissue, points);
  const SurfaceHit hit = sweep_.hit(body);
  sweep_.take(body);
  if (sweep_.late()) flags_ |= kNeedleSurfaceLate;
  if (come_into_old_hole(body, shaft, tissue, points)) return true;
  const SurfacePatch& surface = patch.bodies[body].surface;
  const Vector3d inward = -normal_on(surface, hit);
  if (inward.dot(shaft.tip_tangent()) <= 0) {
    // It has come in backwards, behind its shaft: that is no tip's puncture, and the track is not known.
    sweep_.pass_over(body);
    flags_ |= kNeedleSurfaceLate;
    return false;
  }
  const SurfaceTopology::Face& face = surface.topology->faces[hit.face];
  Eigen::Vector4d barycentric = Eigen::Vector4d::Zero();
  for (int c = 0; c < 3; ++c) barycentric[kFaceCorners[face.apex][c]] = hit.weights[c];
  leave();
  state_ = TipState::indenting;
  inward_ = inward;
  end_.body = body;
  end_.place = {.id = 0, .tet = face.tet, .barycentric = barycentric};
  if (find_in_patch(patch, end_)) {
    put_in_patch(patch, end_.patch_tet, barycentric, end_);
  } else {
    // Nothing more is known of the tissue there: it yields as it does next to the tip, and the rest of it is held.
    flags_ |= kNeedlePatchLeft;
    end_.place.kept = true;
    end_.place.nodes = face.tet_nodes;
    end_.place.patch_nodes.fill(-1);
    end_.place.free_position = position_on(surface, hit);
    end_.site = site_on_surface(surface, hit, barycentric);
  }
  Vector3d rest = Vector3d::Zero();
  for (int c = 0; c < 3; ++c) rest += hit.weights[c] * surface.topology->rest_positions.col(face.corners[c]);
  end_.rest = rest;
  beyond_ = tissues_->at(rest, 1);
  end_.tissue = beyond_;
  barrier_ = tissues_->puncture_force(0, beyond_);
  // Met late, behind the tissue that the tip was in or because it moved: the tip has pressed on nothing yet.
  lag_ = std::max(0.0, (shaft.tip() - position_on(surface, hit)).dot(inward) - sweep_.way(body));
  return true;
}

// A tip that is in a body without a track, and goes on: one begins there. Nothing is broken through, and the tissue
// around the tip has not been pressed yet.
bool NeedleTip::begin_inside(const HermiteShaft& shaft, const TissuePatch& patch, const TissuePoints& tissue,
                             TrackPoints& points) {
  const int body = sweep_.went_on();
  if (body < 0) return false;
  flags_ |= kNeedleSurfaceLate;
  if (patch.bodies[body].tet_count == 0) return false;
  const PatchWalk at = walk_patch(patch, body, 0, shaft.tip(), tissue);
  if (at.left != PatchWalk::Left::nothing) return false;
  sweep_.take(body);
  points.forget(body);
  leave();
  state_ = TipState::inside;
  threaded_[body] = true;
  end_.body = body;
  put_in_patch(patch, at.patch_tet, at.barycentric, end_);
  end_.tissue = tissues_->at(end_.rest, 1);
  if (!points.lay(end_, shaft.length())) flags_ |= kNeedleRowOverflow;
  return true;
}

bool NeedleTip::come_into_old_hole(int body, const HermiteShaft& shaft, const TissuePoints& tissue,
                                   TrackPoints& points) {
  if (!threaded_[body] || points.last_active(body) != nullptr) return false;
  TrackPoint* first = points.first(body);
  const bool same = first != nullptr && first->point >= 0 && ends_[body].patch_tet >= 0 &&
                    (tissue.position(first->point) - shaft.tip()).norm() < settings_.reentry_distance;
  if (!same) {
    points.forget(body);
    threaded_[body] = false;
    return false;
  }
  first->active = true;
  first->arc = first->held_arc = shaft.length();
  leave();
  state_ = TipState::inside;
  end_ = ends_[body];
  return true;
}

bool NeedleTip::withdraw(TrackPoints& points) {
  if (state_ != TipState::inside || points.last_active(end_.body) != nullptr) return false;
  const auto lost = [&](const TrackPoint& point) { return point.body == end_.body && point.lost; };
  if (std::ranges::any_of(points.all(), lost)) return false;  // not withdrawn from: the patch lacks them
  ends_[end_.body] = end_;
  overhang_[end_.body] = std::numeric_limits<double>::infinity();  // back in its hole it is in the track
  sweep_.pass_over(end_.body);  // bent or cut aside, it may be under the surface still, beside that hole
  leave();
  return true;
}

void NeedleTip::go_aside(const SolvedStep& step, const Vector3d& aside, TissuePoints& tissue) {
  if (!inside() || end_.place.rigid) return;
  if (end_.patch_tet < 0) {  // kept without a patch that has it
    end_.place.offset += aside;
    end_.place.free_position += aside;
    tissue.move_last(step.patch, end_.place, end_.body);
    return;
  }
  const Vector3d target = tissue.position(end_.point) + aside;
  const PatchWalk at = walk_from(step.patch, end_, target, tissue);
  if (at.left == PatchWalk::Left::patch) flags_ |= kNeedlePatchLeft;
  if (put_end(at, step.patch, tissue) && barrier_ <= 0) {
    end_.tissue = tissues_->at(end_.rest, end_.tissue);
  }
}

bool NeedleTip::begin_anew(int body, const SolvedStep& step, const TissuePoints& tissue, TrackPoints& points) {
  const TrackPoint* last = points.last_active(body);
  if (state_ != TipState::inside || end_.body != body || last == nullptr || last->patch_tet < 0) return false;
  const PatchWalk at = walk_from(step.patch, *last, step.shaft.tip(), tissue);
  if (at.left != PatchWalk::Left::nothing) return false;
  points.forget_withdrawn(body);
  leave();
  state_ = TipState::inside;
  end_.body = body;
  put_in_patch(step.patch, at.patch_tet, at.barycentric, end_);
  end_.tissue = tissues_->at(end_.rest, 1);
  return true;
}

bool NeedleTip::tear_out(TrackPoints& points) {
  bool torn = false;
  for (int body = 0; body < kMaxBodies; ++body) {
    const TrackPoint* last = points.last_active(body);
    const bool tip_is_out = last != nullptr && last->torn >= settings_.tear_distance;
    torn = points.drop_torn(body, settings_.tear_distance) || torn;
    if (!tip_is_out) continue;
    if (state_ == TipState::inside && end_.body == body) leave();
    last = points.last_active(body);
    if (last == nullptr) {
      points.forget(body);
      threaded_[body] = false;
    } else {
      ends_[body] = *last;
      overhang_[body] = 0;
    }
  }
  return torn;
}

bool NeedleTip::advance(const SolvedStep& step, TissuePoints& tissue, TrackPoints& points) {
  held_up_ = !outside() && end_.patch_tet < 0;
  if (outside() || end_.point < 0) return false;
  const ActiveContact* contact = nullptr;  // the tip's own; null: nothing resists, or it has only just been laid
  if (step.rows.contact_count > 0) {
    const ActiveContact& last = step.rows.contacts[static_cast<std::size_t>(step.rows.contact_count) - 1];
    if (last.point == end_.point) contact = &last;
  }
  if (state_ == TipState::indenting) return press_on(step, contact, tissue, points);

  const HermiteShaft& shaft = step.shaft;
  if (contact == nullptr) {
    const Vector3d ahead = shaft.tip() - tissue.position(end_.point);
    return ahead.dot(shaft.tip_tangent()) > 0 && move_end(step, shaft.tip(), nullptr, tissue, points);
  }
  const BoundedSolver& solver = step.solver;
  const int row = contact->first_row;
  if (solver.state(row) != RowState::lower) {  // nothing more is cut: the end goes after what has been
    const Vector3d end = tissue.position(end_.point);
    const Vector3d beside = shaft.tip() - end - (shaft.tip() - end).dot(shaft.tip_tangent()) * shaft.tip_tangent();
    if (solver.state(row) == RowState::upper && beside.norm() > kBeside) side_ = beside;
    return lag_ > 0 && barrier_ <= 0 && move_end(step, end + lag_ * shaft.tip_tangent(), contact, tissue, points);
  }
  if (barrier_ > 0) {
    record(step.number, beyond_, -step.lambda[row], solver.response(row));
    end_.tissue = beyond_;
    barrier_ = 0;
  }
  // The new end has u = 0: it is off the tip by what the tissue next to it gives way. Sideways that fades as the tip
  // goes on, new tissue has not been pushed yet, and what the slanted face presses it aside with sets in (eq. 26).
  const double kept = std::exp(-step.motion(row) / settings_.side_length);
  const Vector3d steering = -settings_.bevel_ratio * cutting_force() * shaft.tip_bevel();
  ease_ *= std::exp(-step.motion(row) / ease_length_);
  Vector3d give = solver.compliance(row) * step.lambda[row] * contact->directions.col(0) - ease_;
  Vector3d side = Vector3d::Zero();
  for (int k = 1; k < 3; ++k) {
    const auto across = contact->directions.col(k);
    const double compliance = solver.compliance(row + k);
    give += kept * (compliance * step.lambda[row + k] - side_.dot(across)) * across;
    side += (kept * side_.dot(across) + (1 - kept) * compliance * steering.dot(across)) * across;
  }
  side_ = side;
  return move_end(step, shaft.tip() + give, contact, tissue, points);
}

// The rows of a far end, or of a surface that is now a channel, differ by the mesh and by where the force acts. What
// that does fades over what is cut next: over enough of it that the fading itself cuts little.
void NeedleTip::ease(const SolvedStep& step, const ActiveContact& contact, const TissuePoints& tissue) {
  const HermiteShaft& shaft = step.shaft;
  Vector3d force = contact.directions * step.lambda.segment<3>(contact.first_row);
  if (const double least = cutting_force(), axial = -force.dot(shaft.tip_tangent());
      stiffens(end_.site) && axial > least) {
    force *= least / axial;  // the row holds no more, and is as soft as it is at that
  }
  ease_ = shaft.tip() - tissue.position(end_.point) - lag_ * shaft.tip_tangent() - side_ + compliance() * force;
  ease_length_ = std::max(settings_.side_length, kEasier * ease_.norm());
}

bool NeedleTip::press_on(const SolvedStep& step, const ActiveContact* contact, TissuePoints& tissue,
                         TrackPoints& points) {
  if (barrier_ <= 0) {
    enter(step.number, 0, 0);
  } else if (contact != nullptr) {
    const int row = contact->first_row;
    const RowState state = step.solver.state(row);
    pressed_ = -step.lambda[row];
    relax(crept() + step.solver.compliance(row) * pressed_, step.dt);
    if (state == RowState::upper || !follow_slide(step, *contact, tissue)) {  // let go of
      sweep_.start_from(end_.body, step.shaft.tip() - kLetGo * inward_);
      state_ = TipState::outside;
      return true;
    }
    // A hole that is ahead of the tip would be left at once: dragged sideways, it must first be over it.
    const double ahead = (step.shaft.tip() - tissue.position(end_.point)).dot(step.shaft.tip_tangent());
    if (state == RowState::lower && ahead >= 0) {
      if (lag_ > 0) lag_ = std::max(0.0, ahead + step.solver.compliance(row) * step.lambda[row]);
      enter(step.number, -step.lambda[row], step.solver.response(row));
      if (end_.patch_tet >= 0) end_.site = site_in_patch(step.patch, end_);  // strained as it is now, not when met
      ease(step, *contact, tissue);
    }
  }
  if (state_ != TipState::inside) return false;
  // The hole in the surface is the track's first point.
  if (!points.lay(end_, step.shaft.length() - lag_)) flags_ |= kNeedleRowOverflow;
  return true;
}

bool NeedleTip::follow_slide(const SolvedStep& step, const ActiveContact& contact, TissuePoints& tissue) {
  const TissuePatch& patch = step.patch;
  const BoundedSolver& solver = step.solver;
  const int row = contact.first_row;
  if (solver.state(row + 1) == RowState::sticking && solver.state(row + 2) == RowState::sticking) return true;
  if (end_.patch_tet < 0) return true;  // there is nothing known to slide on
  const Eigen::Vector2d slide(step.motion(row + 1), step.motion(row + 2));
  const PatchWalk from{.patch_tet = end_.patch_tet, .barycentric = end_.place.barycentric};
  const PatchWalk at = slide_on_surface(patch, end_.body, from, contact.directions.rightCols<2>(), slide, tissue);
  if (at.left == PatchWalk::Left::body) return false;
  if (at.left == PatchWalk::Left::patch) flags_ |= kNeedlePatchLeft;
  if (!put_end(at, patch, tissue)) return true;
  const int beyond = tissues_->at(end_.rest, 1);
  if (beyond != beyond_) {
    beyond_ = end_.tissue = beyond;
    barrier_ = tissues_->puncture_force(0, beyond);
  }
  // What is pressed on is an area: its normal turns to that of another face as the tip goes on by its radius.
  const double turned = 1 - std::exp(-slide.norm() / settings_.tip_radius);
  const Vector3d inward = inward_ + turned * (-surface_normal(patch, end_.body, at) - inward_);
  if (inward.norm() > 0.1) inward_ = inward.normalized();
  return true;
}

bool NeedleTip::put_end(const PatchWalk& at, const TissuePatch& patch, TissuePoints& tissue) {
  const TrackPoint before = end_;
  end_.place.rigid = false;
  end_.place.offset.setZero();
  put_in_patch(patch, at.patch_tet, at.barycentric, end_);
  if (tissue.move_last(patch, end_.place, end_.body)) return true;
  flags_ |= kNeedleNonFinite;
  end_ = before;
  return false;
}

void NeedleTip::enter(std::uint64_t step, double force, double response) {
  record(step, beyond_, force, response);
  end_.tissue = beyond_;
  state_ = TipState::inside;
  barrier_ = 0;
  threaded_[end_.body] = true;
}

void NeedleTip::record(std::uint64_t step, int to, double force, double response) {
  const int from = state_ == TipState::indenting ? 0 : end_.tissue;
  if (force <= 0) return;  // nothing there to break
  ++punctures_;
  const double after = std::min(force, tissues_->resistance(to).cutting_force);
  last_puncture_ = {.step = step,
                    .body = end_.body,
                    .from = from,
                    .to = to,
                    .force = force,
                    .energy = 0.5 * response * (force * force - after * after)};
}

// In strides, so that no layer is leapt over where the tip has sprung ahead or a patch was late. What is not reached,
// because the patch ends, the cut has gone on by all the same, through what the end is in.
bool NeedleTip::move_end(const SolvedStep& step, const Vector3d& target, const ActiveContact* contact,
                         TissuePoints& tissue, TrackPoints& points) {
  const auto ahead = [&] { return (target - tissue.position(end_.point)).dot(step.shaft.tip_tangent()); };
  const double to_go = ahead();
  if (to_go <= 0) return false;
  const double cut = std::max(lag_, to_go);
  const bool far = lag_ > 0 || to_go > kFarCut;
  if (far) places_.leftCols(tissue.count()) = tissue.positions();
  for (int stride = 0; stride < kMostEndStrides && barrier_ <= 0; ++stride) {
    const Vector3d way = target - tissue.position(end_.point);
    const double part = kEndStride / std::max(way.norm(), kEndStride);
    const Vector3d next = part < 1 ? Vector3d(tissue.position(end_.point) + part * way) : target;
    if (move_end_on(step, next, tissue, points)) return true;
    if (held_up_ || part == 1) break;
  }
  const double left = cut - (to_go - ahead());
  const bool behind = barrier_ <= 0 && (held_up_ || lag_ > 0 || left > kEndStride);
  lag_ = behind ? std::max(0.0, left) : 0;
  if (far) tissue.hold_others(places_.leftCols(tissue.count()));
  if (contact == nullptr) return false;
  if (far) {
    ease(step, *contact, tissue);
  } else if (stiffens(end_.site)) {  // how much it has, a new patch says anew
    const int row = contact->first_row;
    ease_ += (compliance() - step.solver.compliance(row)) * (contact->directions * step.lambda.segment<3>(row));
    ease_length_ = std::max(settings_.side_length, kEasier * ease_.norm());
  }
  return false;
}

bool NeedleTip::move_end_on(const SolvedStep& step, const Vector3d& target, TissuePoints& tissue,
                            TrackPoints& points) {
  if (end_.patch_tet < 0) {
    flags_ |= kNeedlePatchLeft;
    held_up_ = true;
    return false;
  }
  PatchWalk at = walk_from(step.patch, end_, target, tissue);
  const bool doubtful = tissue.drift(end_.point).norm() > kEndStride;  // the patch has yet to go where the tip is
  const bool astray =
      at.left == PatchWalk::Left::body && (doubtful || inside_out(step.patch, end_.body, at.patch_tet, tissue));
  if (astray || at.left == PatchWalk::Left::patch) {
    // A force that dents the tissue deeper than a tetrahedron turns it inside out: the way on then seems to be the
    // way out, or to nowhere. At rest it is known; what the step misses for the deformation the next ones make up
    // for.
    const Vector3d way = target - tissue.position(end_.point);
    const Vector3d from = end_.rest;
    at = walk_patch_at_rest(step.patch, end_.body, end_.patch_tet, from + way);
  }
  if (at.left == PatchWalk::Left::patch) {
    flags_ |= kNeedlePatchLeft;
    held_up_ = true;
    return false;
  }
  if (at.left == PatchWalk::Left::body) {
    const TrackPoint* last = points.last_active(end_.body);
    overhang_[end_.body] = last != nullptr ? step.shaft.length() - last->arc : 0;
    ends_[end_.body] = end_;
    leave();
    return true;
  }
  if (put_end(at, step.patch, tissue)) meet_tissue(step, tissue);
  return false;
}

void NeedleTip::meet_tissue(const SolvedStep& step, TissuePoints& tissue) {
  if (barrier_ > 0) return;
  const Vector3d tip = step.shaft.tip();
  const int bone = tissues_->bone_at(tip);
  const int here = bone != 0 ? bone : tissues_->at(end_.rest, end_.tissue);
  if (here == end_.tissue) return;
  barrier_ = tissues_->puncture_force(end_.tissue, here);
  beyond_ = here;
  if (barrier_ <= 0) end_.tissue = here;
  if (bone == 0) return;
  // It is where the tip has met it, and what holds it is not in the patch.
  end_.place.rigid = true;
  ease_.setZero();
  end_.place.offset = tip - (tissue.free_position(end_.point) - tissue.drift(end_.point));
  tissue.move_last(step.patch, end_.place, end_.body);
}

void NeedleTip::publish(NeedleState& out) const {
  out.tip = state_;
  out.tip_body = outside() ? -1 : end_.body;
  out.puncture_count = punctures_;
  out.last_puncture = last_puncture_;
}

std::uint32_t NeedleTip::take_flags() {
  return std::exchange(flags_, 0U);
}

}  // namespace stylet::physics
