#include "physics/loops/haptic_loop.h"

#include "physics/contact/hermite_shaft.h"
#include "physics/contact/shaft.h"
#include "physics/needle/rotation_vector.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace stylet::physics {

using Eigen::Quaterniond;
using Eigen::Vector3d;

namespace {

// Smallest pivot over the tissue's own compliance below which rows count as dependent, and what they then get of it.
constexpr double kDependent = 1e-2;
constexpr double kSoftened = 1e-3;

}  // namespace

HapticLoop::HapticLoop(const HapticLoopSettings& settings, const StylusPose& initial_hub_pose)
    : settings_(settings),
      needle_(settings.needle, settings.base),
      shape_(straight_needle(settings.needle, initial_hub_pose)),
      predicted_(shape_),
      hub_{initial_hub_pose.position, initial_hub_pose.orientation.normalized()},
      next_hub_(hub_),
      track_(settings.track, 0.5 * settings.needle.outer_diameter, settings.tissues),
      delassus_(needle_.node_count(), kMaxRows),
      solver_(kMaxRows),
      bounded_(kMaxRows),
      delta_free_(Eigen::VectorXd::Zero(kMaxRows)),
      lambda_(Eigen::VectorXd::Zero(kMaxRows)),
      load_(Eigen::VectorXd::Zero(6 * needle_.node_count())),
      free_motion_(load_),
      motion_(load_),
      node_forces_(Eigen::Matrix3Xd::Zero(3, kMaxPatchNodes)),
      node_touched_(kMaxPatchNodes) {
  if (!(settings.relative_compliance >= 0) || !(settings.max_base_translation > 0) ||
      !(settings.max_base_rotation > 0) || !(settings.max_node_rotation > 0)) {
    throw std::invalid_argument("haptic loop: compliance must not be negative and step limits must be positive");
  }
  bounded_.set_limits(settings.solve_limits);
  publish_shape();
}

const NeedleState& HapticLoop::step(const StylusPose& hub, double dt, const TissuePatch& patch) {
  if (clock_ != nullptr) clock_->start();
  if (!accept(hub, dt)) return keep(kNeedleNonFinite);
  if (!synchronise(patch)) return keep(kNeedleNonFinite);
  mark(HapticStage::synchronisation);
  if (!free_motion(dt)) return keep(kNeedleSolveFailed);  // 1 needle free motion
  mark(HapticStage::free_motion);
  if (owns_track()) {  // 2 contact points, directions, H_n, H_v, delta_free
    track_.place(HermiteShaft(predicted_, needle_.beam_length(), settings_.track.straight_edges), tissue_, dt, rows_);
    mark(HapticStage::contact_positions);
  } else {
    project_contacts();
    mark(HapticStage::contact_positions);
    direct_contacts();
    mark(HapticStage::contact_directions);
  }
  delassus_.place_rows(needle_, rows_.contacts, rows_.contact_count);
  mark(HapticStage::contact_rows);
  free_violation(free_motion_, tissue_, rows_.contacts, rows_.contact_count, delta_free_);
  mark(HapticStage::delta_free);
  delassus_.couple(needle_, tissue_, rows_.contacts);  // 3 W
  mark(HapticStage::delassus);
  if (!solve_contacts()) return keep(kNeedleSolveFailed);  // 4 lambda
  mark(HapticStage::solve);
  if (!correct()) return keep(kNeedleNonFinite);  // 5 needle and isolated DOFs
  if (owns_track() && loaded_epoch_ != 0) {
    track_.advance(HermiteShaft(shape_, needle_.beam_length(), settings_.track.straight_edges), patch, rows_,
                   bounded_, lambda_, state_.step + 1, tissue_);
    flags_ |= track_.flags();
  }
  mark(HapticStage::correction);
  feel();  // 6 force at the base
  mark(HapticStage::force);
  publish(dt, patch);
  mark(HapticStage::publication);
  return state_;
}

Eigen::Matrix3Xd HapticLoop::directions() const {
  Eigen::Matrix3Xd all(3, delassus_.rows());
  for (int c = 0; c < rows_.contact_count; ++c) {
    const ActiveContact& contact = rows_.contacts[c];
    all.middleCols(contact.first_row, contact.row_count) = contact.rows();
  }
  return all;
}

bool HapticLoop::accept(const StylusPose& hub, double dt) {
  flags_ = 0;
  const double norm = hub.orientation.norm();
  if (!hub.position.allFinite() || !(norm > 1e-6) || !std::isfinite(norm) || !(dt > 0) || !std::isfinite(dt)) {
    return false;
  }
  next_hub_ = {hub.position, Quaterniond(hub.orientation.coeffs() / norm)};
  const Vector3d translation = hub.position - hub_.position;
  const double distance = translation.stableNorm();
  if (distance > settings_.max_base_translation) {
    next_hub_.position = hub_.position + (settings_.max_base_translation / distance) * translation;
    flags_ |= kNeedleBaseLimited;
  }
  const Vector3d rotation = logarithm(next_hub_.orientation * hub_.orientation.conjugate());
  const double angle = rotation.norm();
  if (angle > settings_.max_base_rotation) {
    const Quaterniond turn = exponential(settings_.max_base_rotation / angle * rotation);
    next_hub_.orientation = (turn * hub_.orientation).normalized();
    flags_ |= kNeedleBaseLimited;
  }
  return true;
}

// Forces are carried over by contact, so points loaded from a patch that is no good lose nothing.
bool HapticLoop::synchronise(const TissuePatch& patch) {
  if (patch.epoch == 0 || patch.body_count == 0) {
    if (owns_track()) track_.clear(tissue_);
    tissue_.clear();
    loaded_epoch_ = 0;
    patch_fits_ = patch_finite_ = true;
  } else if (patch.epoch != loaded_epoch_) {
    if (owns_track()) {
      track_.load(patch, tissue_);
    } else {
      patch_fits_ = tissue_.load(patch);
    }
    loaded_epoch_ = patch.epoch;
    patch_finite_ = tissue_.finite();
    for (int b = 0; b < patch.body_count; ++b) {
      const BodyPatch& body = patch.bodies[b];
      patch_finite_ = patch_finite_ && body.free_positions.leftCols(body.node_count).allFinite();
    }
  }
  if (!patch_fits_) flags_ |= kNeedleRowOverflow;
  return patch_finite_;
}

// The needle first follows the hub rigidly, which is exact in the air whatever the rotation, and is linearised there:
// one Newton step x = A_n^-1 b from the moved shape. x_free stays a vector: a needle bent by tissue springs far away
// when let free, and contacts are better linearised where it really is.
bool HapticLoop::free_motion(double dt) {
  predicted_ = shape_;
  follow_hub(predicted_, hub_, next_hub_);
  if (!needle_.base_is_free()) {
    predicted_.positions.col(0) = next_hub_.position;
    predicted_.orientations[0] = next_hub_.orientation;
  }
  needle_.assemble(predicted_, next_hub_, dt);
  mark(HapticStage::free_motion);
  if (!needle_.factorise(predicted_, next_hub_, dt)) return false;
  mark(HapticStage::needle_factor);
  load_.setZero();
  needle_.solve(load_, free_motion_);
  return true;
}

void HapticLoop::project_contacts() {
  rows_.contact_count = 0;
  const int last_beam = needle_.node_count() - 2;
  for (int point = 0; point < tissue_.count(); ++point) {
    ActiveContact& contact = rows_.contacts[rows_.contact_count];
    contact.point = point;
    contact.first_row = 2 * rows_.contact_count;
    contact.row_count = 2;
    if (settings_.coupling == Coupling::paper_frozen) {
      const PatchContact& laid = tissue_.contact(point);
      contact.shaft = shaft_point(predicted_.nodes(), std::clamp(laid.beam, 0, last_beam), laid.beam_fraction);
    } else {
      contact.shaft = project_on_shaft(predicted_.nodes(), tissue_.position(point));
      if (contact.shaft.ahead_of_tip || contact.shaft.behind_hub) continue;
    }
    ++rows_.contact_count;
  }
}

void HapticLoop::direct_contacts() {
  for (int c = 0; c < rows_.contact_count; ++c) {
    ActiveContact& contact = rows_.contacts[c];
    contact.directions.leftCols<2>() =
        settings_.coupling == Coupling::paper_frozen
            ? tissue_.contact(contact.point).directions
            : lateral_directions(contact.shaft.tangent, predicted_.orientation(contact.shaft.beam));
  }
}

bool HapticLoop::solve_contacts() {
  return owns_track() ? solve_bounded() : solve_bilateral();
}

// Rows without sub-grid compliance are softened by `relative_compliance` of the tissue's own, and where they depend
// on each other, as in solve_bilateral().
bool HapticLoop::solve_bounded() {
  const int rows = delassus_.rows();
  const std::span<ContactRow> laws(rows_.laws.data(), static_cast<std::size_t>(rows));
  delta_free_.head(rows) += rows_.slip.head(rows);
  const double scale = delassus_.mean_tissue_compliance();
  const double softness = settings_.relative_compliance * scale;
  bool stiff = false;
  for (ContactRow& law : laws) {
    stiff = stiff || law.compliance == 0;
    if (law.compliance == 0) law.compliance = softness;
  }
  solve_report_ = bounded_.solve(laws, delassus_.matrix(), delta_free_.head(rows), lambda_);
  if (stiff && (!solve_report_.solved || solve_report_.smallest_pivot < kDependent * scale)) {
    flags_ |= kNeedleRowsDependent;
    if (softness < kSoftened * scale) {
      for (ContactRow& law : laws) law.compliance = std::max(law.compliance, kSoftened * scale);
      lambda_.head(rows).setZero();  // made of rounding: no guess
      solve_report_ = bounded_.solve(laws, delassus_.matrix(), delta_free_.head(rows), lambda_);
    }
  }
  if (solve_report_.fallback) flags_ |= kNeedleSolveInexact;
  if (solve_report_.lagged_bounds) flags_ |= kNeedleBoundsLagged;  // an error of first order in the step's length
  if (solve_report_.softened_rows > 0) flags_ |= kNeedleRowsDependent;
  return solve_report_.solved;
}

// Contacts that the mesh or the beams cannot tell apart leave a row next to nothing to move by: its multiplier is
// then made of rounding. Such a system is softened, also where the exact one was asked for, and the step flagged.
bool HapticLoop::solve_bilateral() {
  const double scale = delassus_.mean_tissue_compliance();
  const double compliance = settings_.relative_compliance * scale;
  const auto delta_free = delta_free_.head(delassus_.rows());
  const bool solved = solver_.solve(delassus_.matrix(), compliance, delta_free, lambda_);
  if (solver_.smallest_pivot() >= kDependent * scale) return solved;
  flags_ |= kNeedleRowsDependent;
  if (solved && compliance >= kSoftened * scale) return true;
  return solver_.solve(delassus_.matrix(), std::max(compliance, kSoftened * scale), delta_free, lambda_);
}

// x = A_n^-1 (b + H_n^T lambda) for the needle, translations and rotations; x = x_free + W_bar H_v^T lambda for the
// tissue (paper eq. 4, 7).
bool HapticLoop::correct() {
  needle_load(rows_.contacts, rows_.contact_count, lambda_, load_);
  needle_.solve(load_, motion_);
  if (!motion_.allFinite() || !lambda_.head(delassus_.rows()).allFinite()) return false;

  double largest = 0;
  for (int i = 0; i < needle_.node_count(); ++i) largest = std::max(largest, motion_.segment<3>(6 * i + 3).norm());
  shape_ = predicted_;
  if (largest > settings_.max_node_rotation) {
    flags_ |= kNeedleStepShortened;
    free_motion_ = settings_.max_node_rotation / largest * motion_;
    move(shape_, free_motion_);
  } else {
    move(shape_, motion_);
  }
  hub_translation_ = next_hub_.position - hub_.position;
  hub_rotation_ = logarithm(next_hub_.orientation * hub_.orientation.conjugate());
  hub_ = next_hub_;
  tissue_.apply(rows_.contacts, rows_.contact_count, lambda_);
  return true;
}

// What the hand feels is minus what it must apply to the base. From the linearised rows of the first node, because
// the internal force of the moved shape carries second-order axial strains times EA/L = 1e7 N/m that are not there
// yet.
void HapticLoop::feel() {
  const Vector6d reaction = needle_.base_reaction(load_, motion_);
  const Vector3d lever = predicted_.positions.col(0) - hub_.position;
  const Wrench before = state_.wrench;
  state_.wrench.force = -reaction.head<3>();
  state_.wrench.moment = -reaction.tail<3>() + lever.cross(state_.wrench.force);
  state_.hand_work -= 0.5 * (before.force + state_.wrench.force).dot(hub_translation_) +
                      0.5 * (before.moment + state_.wrench.moment).dot(hub_rotation_);
}

const NeedleState& HapticLoop::keep(std::uint32_t reason) {
  ++state_.step;
  state_.flags = flags_ | reason;
  return state_;
}

void HapticLoop::publish(double dt, const TissuePatch& patch) {
  ++state_.step;
  state_.time_s += dt;
  state_.patch_epoch = loaded_epoch_;
  state_.flags = flags_;
  publish_shape();
  publish_contacts();
  publish_forces(patch);
}

void HapticLoop::publish_shape() {
  state_.node_count = shape_.node_count;
  state_.positions.leftCols(shape_.node_count) = shape_.nodes();
  for (int i = 0; i < shape_.node_count; ++i) {
    state_.orientations[i] = shape_.orientation(i);
  }
}

void HapticLoop::publish_contacts() {
  if (owns_track()) {
    track_.publish(tissue_, needle_.beam_length(), needle_.rest_length(), state_);
    return;
  }
  state_.contact_count = rows_.contact_count;
  state_.track_count = rows_.contact_count;
  const auto arc = [&](const ActiveContact& c) {
    return (c.shaft.beam + c.shaft.beam_fraction) * needle_.beam_length();
  };
  const ActiveContact* deepest = nullptr;
  for (int c = 0; c < rows_.contact_count; ++c) {
    const ActiveContact& contact = rows_.contacts[c];
    const PatchContact& laid = tissue_.contact(contact.point);
    state_.contacts[c] = {.id = laid.id,
                          .body = tissue_.body(contact.point),
                          .tet = laid.tet,
                          .barycentric = laid.barycentric,
                          .beam = contact.shaft.beam,
                          .beam_fraction = contact.shaft.beam_fraction,
                          .position = tissue_.position(contact.point),
                          .force = tissue_.force(contact.point)};
    if (deepest == nullptr || arc(contact) > arc(*deepest)) deepest = &contact;
  }

  // The tip is in the body of the contact nearest to it; its depth there counts from that body's first contact.
  state_.tip = deepest == nullptr ? TipState::outside : TipState::inside;
  state_.tip_body = deepest == nullptr ? -1 : tissue_.body(deepest->point);
  state_.tip_depth = 0;
  for (int c = 0; c < rows_.contact_count; ++c) {
    const ActiveContact& contact = rows_.contacts[c];
    if (tissue_.body(contact.point) != state_.tip_body) continue;
    state_.tip_depth = std::max(state_.tip_depth, needle_.rest_length() - arc(contact));
  }
}

void HapticLoop::publish_forces(const TissuePatch& patch) {
  state_.force_count = 0;
  for (int body = 0; body < patch.body_count && tissue_.count() > 0; ++body) {
    const BodyPatch& nodes = patch.bodies[body];
    node_forces_.leftCols(nodes.node_count).setZero();
    std::fill_n(node_touched_.begin(), nodes.node_count, false);
    for (int point = 0; point < tissue_.count(); ++point) {
      if (tissue_.body(point) != body || tissue_.force(point).isZero(0)) continue;
      const PatchContact& contact = tissue_.contact(point);
      if (contact.rigid) continue;
      for (int k = 0; k < 4; ++k) {
        const int node = contact.patch_nodes[k];
        node_forces_.col(node) += contact.barycentric[k] * tissue_.force(point);
        node_touched_[node] = true;
      }
    }
    for (int n = 0; n < nodes.node_count; ++n) {
      if (!node_touched_[n]) continue;
      state_.forces[state_.force_count++] = {body, nodes.node_ids[n], node_forces_.col(n)};
    }
  }
}

}  // namespace stylet::physics
