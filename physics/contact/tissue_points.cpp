#include "physics/contact/tissue_points.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>

namespace stylet::physics {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr std::uint32_t kTrackEnd = 0;              // its id
constexpr double kPeriods = 2;                      // e-foldings of drift from a patch to the next
constexpr double kMostDrift = 0.02;                 // m; a patch that was further off was no good
constexpr Eigen::Index kStride = 3 * kMaxContacts;  // with room for all points

Vector3d free_in_patch(const TissuePatch& patch, const PatchContact& contact, int body) {
  if (contact.kept) return contact.free_position;
  return patch.bodies[body].free_position(contact) + contact.offset;
}

/// Bone stays where it is, and what is kept has no new patch to go to.
bool drifts(const PatchContact& contact) {
  return !contact.rigid && !contact.kept;
}

}  // namespace

TissuePoints::TissuePoints()
    : openings_(Eigen::MatrixXd::Zero(kMaxOrganRows, kStride)),
      folded_(openings_),
      moved_(Eigen::VectorXd::Zero(kMaxOrganRows)),
      contacts_(kMaxContacts),
      bodies_(kMaxContacts),
      free_(Eigen::Matrix3Xd::Zero(3, kMaxContacts)),
      current_(Eigen::Matrix3Xd::Zero(3, kMaxContacts)),
      forces_(Eigen::Matrix3Xd::Zero(3, kMaxContacts)),
      compliance_(Eigen::VectorXd::Zero(kStride * kStride)),
      stride_(kStride),
      drift_(Eigen::Matrix3Xd::Zero(3, kMaxContacts)),
      old_contacts_(kMaxContacts),
      old_bodies_(kMaxContacts),
      old_forces_(Eigen::Matrix3Xd::Zero(3, kMaxContacts)),
      old_current_(Eigen::Matrix3Xd::Zero(3, kMaxContacts)),
      old_drift_(Eigen::Matrix3Xd::Zero(3, kMaxContacts)),
      old_compliance_(compliance_) {}

bool TissuePoints::load(const TissuePatch& patch) {
  const int body_count = std::clamp(patch.body_count, 0, kMaxBodies);
  organs_.clear();

  // How many shallow contacts of each body to skip: taken from whichever body has most, until the rest fits.
  std::array<int, kMaxBodies> skipped{};
  int total = 0;
  for (int b = 0; b < body_count; ++b) total += patch.bodies[b].contact_count;
  const bool fits = total <= kMaxContacts;
  for (; total > kMaxContacts; --total) {
    int largest = 0;
    for (int b = 1; b < body_count; ++b) {
      const bool larger =
          patch.bodies[b].contact_count - skipped[b] > patch.bodies[largest].contact_count - skipped[largest];
      if (larger) largest = b;
    }
    ++skipped[largest];
  }

  keep_old();
  for (int b = 0; b < body_count; ++b) {
    const BodyPatch& body = patch.bodies[b];
    for (int c = skipped[b]; c < body.contact_count; ++c) {
      const PatchContact& contact = body.contacts[c];
      add(contact, b, contact.free_position);
    }
  }
  carry_forces();
  stride_ = 3 * count_;
  double sum = free_.leftCols(count_).sum();  // finite if its terms are
  int first = 0;                              // point of the body
  for (int j = 0; j < count_; ++j) {
    if (body(j) != body(first)) first = j;
    for (int i = 0; i < first; ++i) {
      block(i, j).setZero();
      block(j, i).setZero();
    }
    const int skip = skipped[body(j)] - first;
    for (int i = first; i <= j; ++i) {
      const auto laid = patch.bodies[body(j)].contact_compliance(skip + i, skip + j);
      block(i, j) = laid;
      block(j, i) = laid.transpose();
      sum += laid.sum();
    }
  }
  finite_ = std::isfinite(sum);
  move_points();
  return fits;
}

void TissuePoints::place(const TissuePatch& patch, std::span<const PatchContact> contacts,
                         std::span<const int> bodies) {
  keep_old();
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    add(contacts[c], bodies[c], Vector3d::Zero());
  }
  carry_forces();
  for (int j = 0; j < count_; ++j) free_.col(j) = free_in(patch, contacts_[j], j);
  stride_ = kStride;
  finite_ = true;
  for (int j = 0; j < count_; ++j) finite_ = couple(patch, j) && finite_;
  move_points();
}

void TissuePoints::append(const TissuePatch& patch, const PatchContact& contact, int body) {
  assert(stride_ == kStride);
  add(contact, body, free_in_patch(patch, contact, body));
  finite_ = couple(patch, count_ - 1) && finite_;
  move_points();
}

bool TissuePoints::move_last(const TissuePatch& patch, const PatchContact& contact, int body) {
  const Vector3d force = forces_.col(count_ - 1);
  const Vector3d drift = drift_.col(count_ - 1);
  const PatchContact before = contacts_[count_ - 1];
  const int body_before = bodies_[count_ - 1];
  const auto put = [&](const PatchContact& at, int in) {
    --count_;
    add(at, in, Vector3d::Zero());
    forces_.col(count_ - 1) = force;
    drift_.col(count_ - 1) = drift;
    free_.col(count_ - 1) = free_in(patch, at, count_ - 1);
    return couple(patch, count_ - 1);
  };
  const bool moved = put(contact, body);
  if (!moved) put(before, body_before);
  move_points();
  return moved;
}

bool TissuePoints::move(const TissuePatch& patch, int point, const PatchContact& contact) {
  const auto put = [&](const PatchContact& at) {
    contacts_[point] = at;
    free_.col(point) = free_in(patch, at, point);
    bool finite = couple(patch, point);
    for (int j = point + 1; j < count_; ++j) finite = couple_pair(patch, point, j) && finite;
    return finite;
  };
  const PatchContact before = contacts_[point];
  const bool moved = put(contact);
  if (!moved) put(before);
  move_points();
  return moved;
}

void TissuePoints::keep_old() {
  std::swap(contacts_, old_contacts_);
  std::swap(bodies_, old_bodies_);
  forces_.swap(old_forces_);
  current_.swap(old_current_);
  drift_.swap(old_drift_);
  compliance_.swap(old_compliance_);
  old_stride_ = stride_;
  old_finite_ = finite_;
  old_count_ = count_;
  count_ = 0;
}

void TissuePoints::add(const PatchContact& contact, int body, const Vector3d& free_position) {
  contacts_[count_] = contact;
  bodies_[count_] = body;
  free_.col(count_) = free_position;
  forces_.col(count_).setZero();
  drift_.col(count_).setZero();
  ++count_;
}

void TissuePoints::carry_forces() {
  for (int i = 0; i < count_; ++i) {
    for (int o = 0; o < old_count_; ++o) {
      if (old_bodies_[o] != bodies_[i]) continue;
      const bool same = old_contacts_[o].id == contacts_[i].id;
      if (same) forces_.col(i) = old_forces_.col(o);
      // A new point is laid where the track ends.
      if (same || old_contacts_[o].id == kTrackEnd) drift_.col(i) = old_drift_.col(o);
      if (same) break;
    }
  }
}

Vector3d TissuePoints::free_in(const TissuePatch& patch, const PatchContact& contact, int point) const {
  const Vector3d free = free_in_patch(patch, contact, bodies_[point]);
  return drifts(contact) ? free + drift(point) : free;
}

void TissuePoints::hand_over() {
  period_ = std::max(1, steps_);
  steps_ = 0;
  if (!finite_ || !old_finite_) return;
  for (int j = 0; j < count_; ++j) {
    for (int o = 0; o < old_count_ && drifts(contacts_[j]); ++o) {
      if (old_bodies_[o] != bodies_[j] || old_contacts_[o].id != contacts_[j].id) continue;
      drift_.col(j) = old_current_.col(o) - current_.col(j);
      if (drift_.col(j).squaredNorm() > kMostDrift * kMostDrift) drift_.col(j).setZero();
      free_.col(j) += drift_.col(j);
    }
  }
  move_points();
}

void TissuePoints::hold_others(Eigen::Ref<const Eigen::Matrix3Xd> places) {
  if (!finite_) return;
  for (int j = 0; j + 1 < count_; ++j) {
    if (!drifts(contacts_[j])) continue;
    const Vector3d off = places.col(j) - current_.col(j);
    drift_.col(j) += off;
    free_.col(j) += off;
    current_.col(j) += off;
  }
}

void TissuePoints::go_on() {
  const double left = std::exp(-kPeriods / period_);
  ++steps_;
  if (drift_.leftCols(count_).isZero(0)) return;
  for (int j = 0; j < count_; ++j) {
    if (drifts(contacts_[j])) free_.col(j) -= (1 - left) * drift_.col(j);
  }
  drift_.leftCols(count_) *= left;
  move_points();
}

bool TissuePoints::couple(const TissuePatch& patch, int j) {
  const int rows = organs_.rows();
  if (rows > 0) {
    auto openings = openings_.middleCols<3>(std::ptrdiff_t{3} * j).topRows(rows);
    if (contact(j).rigid || contact(j).kept) {
      openings.setZero();
    } else {
      organs_.openings(patch, body(j), contact(j), openings);
    }
    organs_.fold(openings, folded_.middleCols<3>(std::ptrdiff_t{3} * j).topRows(organs_.carrying()));
    for (int d = 0; d < 3; ++d) free_(d, j) += openings.col(d).dot(organs_.free_change());
  }
  bool finite = free_.col(j).allFinite();
  for (int i = 0; i <= j; ++i) finite = couple_pair(patch, i, j) && finite;
  return finite;
}

bool TissuePoints::couple_pair(const TissuePatch& patch, int i, int j) {
  Matrix3d coupled = Matrix3d::Zero();
  const bool held = contact(i).rigid || contact(j).rigid;
  const bool kept = contact(i).kept || contact(j).kept;
  if (body(i) == body(j) && !held) {
    coupled = kept ? old_compliance(i, j) : patch.bodies[body(j)].compliance(contact(i), contact(j));
  }
  const int carrying = organs_.carrying();
  for (int a = 0; a < 3 && carrying > 0; ++a) {
    for (int b = 0; b < 3; ++b) {
      coupled(a, b) -= folded_.col(std::ptrdiff_t{3} * i + a)
                           .head(carrying)
                           .dot(folded_.col(std::ptrdiff_t{3} * j + b).head(carrying));
    }
  }
  block(i, j) = coupled;
  block(j, i) = coupled.transpose();
  return std::isfinite(coupled.sum());
}

void TissuePoints::settle_organs(const TissuePatch& patch) {
  const int rows = organs_.rows();
  if (rows == 0) return;
  auto moved = moved_.head(rows);
  moved.setZero();
  for (int j = 0; j < count_; ++j) {
    if (forces_.col(j).isZero(0)) continue;
    for (int d = 0; d < 3; ++d) moved += forces_(d, j) * openings_.col(std::ptrdiff_t{3} * j + d).head(rows);
  }
  if (!organs_.settle(moved)) return;
  for (int j = 0; j < count_; ++j) {
    free_.col(j) = free_in(patch, contacts_[j], j);
    finite_ = couple(patch, j) && finite_;
  }
  move_points();
}

Matrix3d TissuePoints::old_compliance(int i, int j) const {
  const auto old = [&](int point) {
    for (int o = 0; o < old_count_; ++o) {
      if (old_bodies_[o] == bodies_[point] && old_contacts_[o].id == contacts_[point].id) return o;
    }
    return -1;
  };
  const int a = old(i);
  const int b = old(j);
  if (a < 0 || b < 0) return Matrix3d::Zero();
  return Eigen::Map<const Matrix3d, 0, Eigen::OuterStride<>>(
      old_compliance_.data() + 3 * a + std::ptrdiff_t{3} * b * old_stride_, Eigen::OuterStride<>(old_stride_));
}

Vector3d TissuePoints::node_position(const TissuePatch& patch, int body, int patch_node) const {
  const BodyPatch& nodes = patch.bodies[body];
  Vector3d position = nodes.free_positions.col(patch_node);
  for (int i = 0; i < count_; ++i) {
    if (bodies_[i] != body || contacts_[i].rigid || forces_.col(i).isZero(0)) continue;
    for (int k = 0; k < 4; ++k) {
      if (contacts_[i].patch_nodes[k] < 0) continue;
      position +=
          nodes.w_bar(patch_node, contacts_[i].patch_nodes[k]) * (contacts_[i].barycentric[k] * forces_.col(i));
    }
  }
  const int rows = organs_.rows();
  for (int d = 0; d < 3 && rows > 0; ++d) {
    position[d] += patch.organs.y[body].col(std::ptrdiff_t{3} * patch_node + d).head(rows).dot(organs_.change());
  }
  return position;
}

void TissuePoints::apply(const std::vector<ActiveContact>& contacts, int contact_count,
                         Eigen::Ref<const Eigen::VectorXd> lambda) {
  forces_.leftCols(count_).setZero();
  for (int c = 0; c < contact_count; ++c) {
    const ActiveContact& contact = contacts[c];
    forces_.col(contact.point) -= contact.rows() * lambda.segment(contact.first_row, contact.force_rows());
  }
  move_points();
}

void TissuePoints::move_points() {
  current_.leftCols(count_) = free_.leftCols(count_);
  Eigen::Map<Eigen::VectorXd> x(current_.data(), 3 * count_);
  for (int j = 0; j < count_; ++j) {
    if (forces_.col(j).isZero(0)) continue;
    for (int d = 0; d < 3; ++d) x += forces_(d, j) * compliance_.segment((3 * j + d) * stride_, 3 * count_);
  }
}

}  // namespace stylet::physics
