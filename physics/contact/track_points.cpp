#include "physics/contact/track_points.h"

#include "physics/contact/patch_walk.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace stylet::physics {
namespace {

using Eigen::Vector3d;

constexpr int kNearTip = 8;        // points laid last, which stay when others have to go
constexpr double kSoonGone = 0.1;  // part of its share that a point may have left when it goes
// Patches for which a point is kept that they lack. They are only late as a rule, and breathing tissue moves on.
constexpr int kMostKept = 10;
constexpr int kSteps = 16;  // of the way from one point to the next, at which it is looked what is there

/// A piece of shaft, m, in tissue of that E; 0: not known, taken for what is known next to it.
void give(double length, double modulus, TrackPoint& point) {
  if (modulus > 0 && (length > 0 || point.share == 0)) {
    const double known = point.modulus > 0 ? point.share : 0;
    point.modulus = known + length > 0 ? (known * point.modulus + length * modulus) / (known + length) : modulus;
  }
  point.share += length;
}

/// E of the tissue on the way from one point to the next, by halves: once, unless one of them has moved.
void find_halves(const TrackPoint& from, const TissueMap& tissues, TrackPoint& to) {
  if (to.halves_of[0] == from.rest && to.halves_of[1] == to.rest) return;
  const Vector3d middle = 0.5 * (from.rest + to.rest);
  to.halves = {tissues.modulus_along(from.rest, middle, kSteps / 2),
               tissues.modulus_along(middle, to.rest, kSteps / 2)};
  to.halves_of = {from.rest, to.rest};
}

}  // namespace

void put_in_patch(const TissuePatch& patch, int patch_tet, const Eigen::Vector4d& barycentric, TrackPoint& point) {
  const BodyPatch& body = patch.bodies[point.body];
  point.patch_tet = patch_tet;
  point.kept_patches = 0;
  point.place.kept = false;
  point.place.tet = body.tet_ids[patch_tet];
  point.place.patch_nodes = body.tet_nodes[patch_tet];
  for (std::size_t k = 0; k < 4; ++k) point.place.nodes[k] = body.node_ids[point.place.patch_nodes[k]];
  point.place.barycentric = barycentric;
  point.rest = rest_position(patch, point.body, point.place);
  point.site = site_in_patch(patch, point);
}

bool find_in_patch(const TissuePatch& patch, TrackPoint& point) {
  const BodyPatch& body = patch.bodies[point.body];
  const auto end = body.tet_ids.begin() + body.tet_count;
  const auto at = std::lower_bound(body.tet_ids.begin(), end, point.place.tet);
  point.patch_tet = at != end && *at == point.place.tet ? static_cast<int>(at - body.tet_ids.begin()) : -1;
  if (point.patch_tet < 0) return false;
  point.place.patch_nodes = body.tet_nodes[point.patch_tet];
  point.place.kept = false;
  point.kept_patches = 0;
  return true;
}

bool find_or_keep(const TissuePatch& patch, const TissuePoints& tissue, TrackPoint& point) {
  const int known = point.point;
  if (find_in_patch(patch, point)) return true;
  if (!point.place.kept && known >= 0) point.place.free_position = tissue.free_position(known);
  point.place.kept = known >= 0 && ++point.kept_patches <= kMostKept;
  const BodyPatch& body = patch.bodies[point.body];
  const auto end = body.node_ids.begin() + body.node_count;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto at = std::lower_bound(body.node_ids.begin(), end, point.place.nodes[k]);
    const bool there = at != end && *at == point.place.nodes[k];
    point.place.patch_nodes[k] = there ? static_cast<int>(at - body.node_ids.begin()) : -1;
  }
  return false;
}

PatchWalk walk_from(const TissuePatch& patch, const TrackPoint& point, const Eigen::Vector3d& x,
                    const TissuePoints& tissue) {
  return walk_patch(patch, point.body, point.patch_tet, x - tissue.drift(point.point), tissue);
}

SubgridSite site_in_patch(const TissuePatch& patch, const TrackPoint& point) {
  const BodyPatch& body = patch.bodies[point.body];
  const auto& nodes = body.tet_nodes[point.patch_tet];
  SubgridSite site{
      .tet_volume = 0, .material = {.young_modulus = 0, .poisson_ratio = 0}, .barycentric = point.place.barycentric};
  // A point a little outside is taken on the face.
  const Eigen::Vector4d inside = site.barycentric.cwiseMax(0.0);
  const Eigen::Vector4d weights = inside / inside.sum();
  site.strained = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const NodeSurroundings& around = body.surroundings[nodes[k]];
    const double weight = weights[static_cast<Eigen::Index>(k)];
    site.tet_volume += weight * around.tet_volume;
    add_part(site.material, around.material, weight);
    site.strained += weight * around.strained;
    site.capsule += weight * around.capsule;
  }
  return site;
}

SubgridSite site_on_surface(const SurfacePatch& surface, const SurfaceHit& hit, const Eigen::Vector4d& barycentric) {
  SubgridSite site{.tet_volume = 0, .material = {.young_modulus = 0, .poisson_ratio = 0}, .barycentric = barycentric};
  for (int c = 0; c < 3; ++c) {
    const NodeSurroundings& around =
        surface.topology->surroundings[surface.topology->faces[hit.face].corners[static_cast<std::size_t>(c)]];
    site.tet_volume += hit.weights[c] * around.tet_volume;
    add_part(site.material, around.material, hit.weights[c]);
    site.capsule += hit.weights[c] * around.capsule;
  }
  return site;
}

TrackPoints::TrackPoints(double spacing) : spacing_(spacing), points_(kMost) {}

TrackPoint* TrackPoints::first(int body) {
  const auto points = all();
  const auto found =
      std::find_if(points.begin(), points.end(), [&](const TrackPoint& point) { return point.body == body; });
  return found != points.end() ? &*found : nullptr;
}

TrackPoint* TrackPoints::last_active(int body) {
  TrackPoint* last = nullptr;
  for (TrackPoint& point : all()) {
    if (point.body == body && point.active) last = &point;
  }
  return last;
}

void TrackPoints::clear() {
  count_ = 0;
  leaving_ = 0;
}

void TrackPoints::forget(int body) {
  const auto rest = std::remove_if(points_.begin(), points_.begin() + count_,
                                   [&](const TrackPoint& point) { return point.body == body; });
  count_ = static_cast<int>(rest - points_.begin());
}

void TrackPoints::forget_withdrawn(int body) {
  const auto rest = std::remove_if(points_.begin(), points_.begin() + count_, [&](const TrackPoint& point) {
    return point.body == body && !point.active && !point.lost;
  });
  count_ = static_cast<int>(rest - points_.begin());
}

bool TrackPoints::drop_torn(int body, double most) {
  const auto torn = [&](const TrackPoint& point) { return point.body == body && point.active && point.torn >= most; };
  const auto rest = std::remove_if(points_.begin(), points_.begin() + count_, torn);
  const int count = static_cast<int>(rest - points_.begin());
  return std::exchange(count_, count) != count;
}

bool TrackPoints::lay(const TrackPoint& end, double arc) {
  const bool unfelt = make_room();
  TrackPoint& point = points_[count_++];
  point = end;
  point.place.id = next_id_++;
  point.place.rigid = false;  // beside it is soft tissue
  point.place.offset.setZero();
  point.active = true;
  point.arc = point.held_arc = arc;
  point.bristles = {};
  point.pressed = point.turned = 0;
  point.cuts = false;
  point.torn = 0;
  if (count_ == kMost) choose_leaving();
  return unfelt;
}

void TrackPoints::share_shaft(int body, const Vector3d& end, double overhang, const TissueMap& tissues) {
  TrackPoint* previous = nullptr;
  TrackPoint* last = last_active(body);
  if (last == nullptr) return;
  for (TrackPoint& point : all()) {
    if (point.body != body || !point.active) continue;
    point.share = point.modulus = 0;
    if (previous != nullptr) {
      find_halves(*previous, tissues, point);
      const double gap = std::max(0.0, point.arc - previous->arc);
      const double grown = &point == last ? std::min(1.0, overhang / spacing_) : 1.0;
      give(0.5 * gap, point.halves[0], *previous);
      give(0.5 * (1 - grown) * gap, point.halves[1], *previous);
      give(0.5 * grown * gap, point.halves[1], point);
    }
    previous = &point;
  }
  const Vector3d way = end - last->rest;
  const double length = way.norm();
  // Withdrawn, the shaft ends before the track does.
  const double reached = length > overhang ? overhang / length : 1;
  give(overhang, tissues.modulus_along(last->rest, last->rest + reached * way, kSteps), *last);
}

void TrackPoints::fade_leaving(double overhang) {
  if (leaving_ != 0) left_ = std::max(left_, std::min(1.0, overhang / spacing_));
}

void TrackPoints::share_out_leaving() {
  for (int body = 0; leaving_ != 0 && body < kMaxBodies; ++body) share_out_leaving(body);
}

void TrackPoints::share_out_leaving(int body) {
  TrackPoint* before = nullptr;
  TrackPoint* leaving = nullptr;
  TrackPoint* behind = nullptr;
  for (TrackPoint& point : all()) {
    if (point.body != body || !point.active || behind != nullptr) continue;
    (point.place.id == leaving_ ? leaving : leaving == nullptr ? before : behind) = &point;
  }
  if (leaving == nullptr || before == nullptr) return;
  const double gap_before = std::max(0.0, leaving->arc - before->arc);
  const double gap_behind = behind != nullptr ? std::max(0.0, behind->arc - leaving->arc) : 0;
  const double given = left_ * leaving->share;
  // What is left when it has gone is half way between the two.
  const double to_before =
      behind == nullptr ? given : given * gap_behind / std::max(gap_before + gap_behind, 1e-3 * spacing_);
  leaving->share -= given;
  give(to_before, leaving->modulus, *before);
  if (behind != nullptr) give(given - to_before, leaving->modulus, *behind);
}

// The point with the least between its neighbours; of equal ones the oldest.
void TrackPoints::choose_leaving() {
  constexpr double kEqual = 0.1;  // of the spacing
  leaving_ = 0;
  left_ = 0;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < count_ - kNearTip; ++i) {
    const TrackPoint& point = points_[i];
    const TrackPoint* before = nullptr;
    const TrackPoint* behind = nullptr;
    for (int k = 0; k < count_; ++k) {
      const TrackPoint& other = points_[k];
      if (other.body != point.body) continue;
      if (k < i) before = &other;
      if (k > i && behind == nullptr) behind = &other;
    }
    if (before == nullptr || behind == nullptr) continue;
    const double gap = behind->arc - before->arc;
    if (gap < least - kEqual * spacing_) {
      least = gap;
      leaving_ = point.place.id;
    }
  }
}

// With four bodies at most, there are always points between two others.
bool TrackPoints::make_room() {
  if (count_ < kMost) return true;
  if (leaving_ == 0) choose_leaving();
  const auto rest = std::remove_if(points_.begin(), points_.begin() + count_,
                                   [&](const TrackPoint& point) { return point.place.id == leaving_; });
  count_ = static_cast<int>(rest - points_.begin());
  leaving_ = 0;
  return left_ >= 1 - kSoonGone;
}

}  // namespace stylet::physics
