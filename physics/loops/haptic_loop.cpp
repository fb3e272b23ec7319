#include "physics/loops/haptic_loop.h"

#include "physics/loops/paper_coupling.h"
#include "physics/loops/track_coupling.h"
#include "physics/needle/rotation_vector.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

namespace stylet::physics {

using Eigen::Quaterniond;
using Eigen::Vector3d;

namespace {

constexpr int kContactsOfTip = 2;  // the tip's own, and the hole that it has just made

std::unique_ptr<NeedleCoupling> make_coupling(const HapticLoopSettings& settings, const Needle& needle) {
  if (settings.coupling == Coupling::stylet) return std::make_unique<TrackCoupling>(settings, needle);
  return std::make_unique<PaperCoupling>(settings, needle);
}

}  // namespace

HapticLoop::HapticLoop(const HapticLoopSettings& settings, const StylusPose& initial_hub_pose)
    : settings_(settings),
      needle_(settings.needle, settings.base),
      shape_(straight_needle(settings.needle, initial_hub_pose)),
      predicted_(shape_),
      hub_{initial_hub_pose.position, initial_hub_pose.orientation.normalized()},
      next_hub_(hub_),
      coupling_(make_coupling(settings, needle_)),
      delassus_(needle_.node_count(), kMaxRows),
      load_(Eigen::VectorXd::Zero(6 * needle_.node_count())),
      free_motion_(load_),
      motion_(load_),
      node_forces_(Eigen::Matrix3Xd::Zero(3, kMaxPatchNodes)),
      node_touched_(kMaxPatchNodes),
      lacked_(static_cast<std::size_t>(4) * kMaxContacts) {
  if (!(settings.relative_compliance >= 0) || !(settings.max_base_translation > 0) ||
      !(settings.max_base_rotation > 0) || !(settings.max_node_rotation > 0) ||
      !(settings.max_node_rotation_stylet > 0)) {
    throw std::invalid_argument("haptic loop: compliance must not be negative and step limits must be positive");
  }
  publish_shape();
}

const NeedleState& HapticLoop::step(const StylusPose& hub, double dt, const TissuePatch& patch) {
  if (clock_ != nullptr) clock_->start();
  if (!accept(hub, dt)) return keep(kNeedleNonFinite);
  if (!synchronise(patch)) return keep(kNeedleNonFinite);
  mark(HapticStage::synchronisation);
  if (!free_motion(dt)) return keep(kNeedleSolveFailed);  // 1 needle free motion
  mark(HapticStage::free_motion);
  coupling_->place(predicted_, dt, system_);  // 2 contact points, directions, H_n, H_v, delta_free
  mark(HapticStage::contact_positions);
  coupling_->direct(predicted_, system_);
  mark(HapticStage::contact_directions);
  const TrackRows& rows = system_.rows;
  delassus_.place_rows(needle_, rows.contacts, rows.contact_count);
  mark(HapticStage::contact_rows);
  free_violation(free_motion_, system_.tissue, rows.contacts, rows.contact_count, system_.delta_free);
  mark(HapticStage::delta_free);
  delassus_.couple(needle_, system_.tissue, rows.contacts);  // 3 W
  mark(HapticStage::delassus);
  flags_ |= coupling_->solve(delassus_, system_);  // 4 lambda
  if ((flags_ & kNeedleSolveFailed) != 0) return keep(kNeedleSolveFailed);
  mark(HapticStage::solve);
  if (!correct()) return keep(kNeedleNonFinite);  // 5 needle and isolated DOFs
  if (loaded_epoch_ != 0) flags_ |= coupling_->advance(shape_, patch, state_.step + 1, system_);
  mark(HapticStage::correction);
  feel();  // 6 force at the base
  mark(HapticStage::force);
  publish(dt, patch);
  mark(HapticStage::publication);
  return state_;
}

Eigen::Matrix3Xd HapticLoop::directions() const {
  Eigen::Matrix3Xd all = Eigen::Matrix3Xd::Zero(3, delassus_.rows());
  for (int c = 0; c < system_.rows.contact_count; ++c) {
    const ActiveContact& contact = system_.rows.contacts[c];
    all.middleCols(contact.first_row, contact.force_rows()) = contact.rows();
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
  TissuePoints& tissue = system_.tissue;
  if (patch.epoch == 0 || patch.body_count == 0) {
    coupling_->clear(tissue);
    loaded_epoch_ = 0;
    patch_flags_ = 0;
    patch_finite_ = true;
  } else if (patch.epoch != loaded_epoch_) {
    patch_flags_ = coupling_->load(patch, tissue);
    loaded_epoch_ = patch.epoch;
    patch_finite_ = tissue.finite();
    for (int b = 0; b < patch.body_count; ++b) {
      const BodyPatch& body = patch.bodies[b];
      patch_finite_ = patch_finite_ && body.free_positions.leftCols(body.node_count).allFinite();
    }
  }
  flags_ |= patch_flags_;
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

// x = A_n^-1 (b + H_n^T lambda) for the needle, translations and rotations; x = x_free + W_bar H_v^T lambda for the
// tissue (paper eq. 4, 7).
bool HapticLoop::correct() {
  const TrackRows& rows = system_.rows;
  const Eigen::VectorXd& lambda = system_.lambda;
  needle_load(rows.contacts, rows.contact_count, lambda, load_);
  needle_.solve(load_, motion_);
  if (!motion_.allFinite() || !lambda.head(delassus_.rows()).allFinite()) return false;

  double largest = 0;
  for (int i = 0; i < needle_.node_count(); ++i) largest = std::max(largest, motion_.segment<3>(6 * i + 3).norm());
  shape_ = predicted_;
  const double most =
      settings_.coupling == Coupling::stylet ? settings_.max_node_rotation_stylet : settings_.max_node_rotation;
  system_.taken = largest > most ? most / largest : 1;
  if (largest > most) {
    // What springs back when a surface lets go of the tip goes on so in the next steps: its mass would not be faster.
    const bool springs_back = settings_.coupling == Coupling::stylet && system_.rows.contact_count <= kContactsOfTip;
    if (!springs_back) flags_ |= kNeedleStepShortened;
    free_motion_ = system_.taken * motion_;
    move(shape_, free_motion_);
  } else {
    move(shape_, motion_);
  }
  hub_translation_ = next_hub_.position - hub_.position;
  hub_rotation_ = logarithm(next_hub_.orientation * hub_.orientation.conjugate());
  hub_ = next_hub_;
  system_.tissue.apply(rows.contacts, rows.contact_count, lambda);
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
  coupling_->publish(system_, state_);
  state_.damage.bend = needle_.bend();
  state_.damage.bend_work = needle_.bend_work();
  publish_forces(patch);
}

void HapticLoop::publish_shape() {
  state_.node_count = shape_.node_count;
  state_.positions.leftCols(shape_.node_count) = shape_.nodes();
  for (int i = 0; i < shape_.node_count; ++i) {
    state_.orientations[i] = shape_.orientation(i);
  }
}

void HapticLoop::publish_forces(const TissuePatch& patch) {
  const TissuePoints& tissue = system_.tissue;
  state_.force_count = 0;
  for (int body = 0; body < patch.body_count && tissue.count() > 0; ++body) {
    const BodyPatch& nodes = patch.bodies[body];
    node_forces_.leftCols(nodes.node_count).setZero();
    std::fill_n(node_touched_.begin(), nodes.node_count, false);
    lacked_count_ = 0;
    for (int point = 0; point < tissue.count(); ++point) {
      if (tissue.body(point) != body || tissue.force(point).isZero(0)) continue;
      const PatchContact& contact = tissue.contact(point);
      if (contact.rigid) continue;
      for (int k = 0; k < 4; ++k) {
        const int node = contact.patch_nodes[k];
        if (node < 0) {
          add_lacked(
              {body, contact.nodes[static_cast<std::size_t>(k)], contact.barycentric[k] * tissue.force(point)});
          continue;
        }
        node_forces_.col(node) += contact.barycentric[k] * tissue.force(point);
        node_touched_[node] = true;
      }
    }
    for (int n = 0; n < nodes.node_count; ++n) {
      if (!node_touched_[n]) continue;
      state_.forces[state_.force_count++] = {body, nodes.node_ids[n], node_forces_.col(n)};
    }
    for (int i = 0; i < lacked_count_; ++i) {
      if (state_.force_count == static_cast<int>(state_.forces.size())) break;
      state_.forces[state_.force_count++] = lacked_[i];
    }
  }
}

void HapticLoop::add_lacked(const NodeForce& force) {
  const auto end = lacked_.begin() + lacked_count_;
  const auto at = std::find_if(lacked_.begin(), end, [&](const NodeForce& of) { return of.node == force.node; });
  if (at != end) {
    at->force += force.force;
  } else {
    lacked_[lacked_count_++] = force;
  }
}

}  // namespace stylet::physics
