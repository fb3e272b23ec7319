#include "physics/contact/organ_contact.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace stylet::physics {
namespace {

constexpr double kProximal = 0.02;  // e of eq. 31, of mean(diag H S H^T)
constexpr int kMaxSweeps = 60;      // of projected Gauss-Seidel; what is left is for the next step
constexpr double kSettled = 1e-10;  // m: a sweep that moves no point further ends them
// Cosine between the normal and the way to the nearest point, below which a node is beside the surface, not in front
// of or behind it. At the rim of the surface, where nodes hang over, nearly 1 unless the node was pressed before.
constexpr double kInFront = 0.5;
constexpr double kInFrontOfRim = 0.98;
constexpr double kOnSurface = 1e-5;  // m: nearer than this the way has no direction
constexpr double kOverRim = 1e-3;    // m: a pressed node no further beside the rim stays; else it would come and go
constexpr int kMaxSubdivision = 6;   // of a face's edge into probe points
constexpr double kAtLimit = 1e-9;    // relative: friction nearer to its limit than this slides
// Of a node that is far from the other surface the distance tells how long it need not be looked at. A face that was
// turned away from it may since have turned to it: all the same it is looked at every so many updates.
constexpr std::size_t kLookAgain = 8;
constexpr double kSideways = 0.4;  // of its distance: no node gets from in front of or beside a surface behind it

void check(std::span<const TissueModel> models, const OrganContactSettings& settings) {
  const auto exists = [&](int body) { return body >= 0 && body < static_cast<int>(models.size()); };
  for (const ContactPair& pair : settings.pairs) {
    if (!exists(pair.nodes_of) || !exists(pair.surface_of) || pair.nodes_of == pair.surface_of) {
      throw std::invalid_argument("contact: bodies " + std::to_string(pair.nodes_of) + " and " +
                                  std::to_string(pair.surface_of) + " are not two of the " +
                                  std::to_string(models.size()) + " there are");
    }
  }
  if (settings.probe && !exists(settings.probe->body)) {
    throw std::invalid_argument("contact: the probe touches body " + std::to_string(settings.probe->body) +
                                ", which does not exist");
  }
}

/// Centroids of the n^2 triangles that a face is cut into.
std::vector<Eigen::Vector3d> face_points(int n) {
  std::vector<Eigen::Vector3d> points;
  const auto add = [&](double i, double j) { points.emplace_back(i / n, j / n, 1 - (i + j) / n); };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; i + j < n; ++j) {
      add(i + 1.0 / 3, j + 1.0 / 3);
      if (i + j < n - 1) add(i + 2.0 / 3, j + 2.0 / 3);
    }
  }
  return points;
}

/// Two unit vectors across a vector and each other.
std::array<Eigen::Vector3d, 2> across(const Eigen::Vector3d& normal) {
  const Eigen::Vector3d first = normal.unitOrthogonal();
  return {first, normal.cross(first).normalized()};
}

/// The nearest vector that is no longer than `limit`.
Eigen::Vector2d within(const Eigen::Vector2d& v, double limit) {
  const double length = v.norm();
  return length > limit ? Eigen::Vector2d(limit / length * v) : v;
}

/// Larger eigenvalue of a symmetric matrix.
double stiffest(const Eigen::Matrix2d& m) {
  return 0.5 * (m.trace() + std::hypot(m(0, 0) - m(1, 1), 2 * m(0, 1)));
}

constexpr double kSlidesWithin = 0.015;  // of a small body at rest, m
constexpr double kHeldWithin = 0.045;    // of the middle of the face: the head's half width and its way in, m
// Fewer are done before another thread wakes.
constexpr std::size_t kNodesWorthSharing = 1000;
constexpr std::size_t kRowsWorthSharing = 100;

void keep_distinct(std::vector<int>& nodes) {
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
}

double mean_edge(const BodySurface& surface, const TissueModel& model) {
  double sum = 0;
  for (int f = 0; f < surface.face_count(); ++f) {
    const auto& [a, b, c] = surface.face(f);
    sum += (model.mesh.nodes[b] - model.mesh.nodes[a]).norm();
  }
  return sum / surface.face_count();
}

}  // namespace

OrganContact::OrganContact(std::span<const TissueModel> models, std::span<const Factorisation* const> rest,
                           OrganContactSettings settings, Companion* companion)
    : settings_(std::move(settings)), bodies_(models.size()) {
  check(models, settings_);
  std::vector<char> used(models.size(), 0);
  for (const ContactPair& pair : settings_.pairs) {
    used[pair.nodes_of] = used[pair.surface_of] = 1;
  }
  if (settings_.probe) used[settings_.probe->body] = 1;
  std::vector<Eigen::Matrix3Xd> at_rest;
  for (const TissueModel& model : models) at_rest.push_back(rest_positions(model));
  for (std::size_t b = 0; b < models.size(); ++b) {
    if (used[b] == 0) continue;
    bodies_[b].model = &models[b];
    bodies_[b].surface = std::make_unique<BodySurface>(models[b]);
    bodies_[b].compliance = std::make_unique<SurfaceCompliance>(models[b], *rest[b], bodies_[b].surface->nodes());
    bodies_[b].positions = &at_rest[b];
    bodies_[b].force = bodies_[b].motion = Eigen::Matrix3Xd::Zero(3, models[b].node_count());
  }

  std::size_t capacity = 0;
  Eigen::Index unknowns = 0;
  for (std::size_t p = 0; p < settings_.pairs.size(); ++p) {
    const std::span<const int> nodes = bodies_[settings_.pairs[p].nodes_of].surface->nodes();
    std::vector<NodeContact>& states = nodes_.emplace_back(nodes.size());
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const SurfaceRow row = face_to_face(static_cast<int>(p), nodes[k], true, states[k].sight);
      if (row.support_count > 0) states[k].rest_overlap = std::min(0.0, row.gap);
    }
    capacity += static_cast<std::size_t>(settings_.max_points);
    unknowns += settings_.max_points;
  }
  if (settings_.probe) {
    const BodySurface& surface = *bodies_[settings_.probe->body].surface;
    const double edge = mean_edge(surface, models[settings_.probe->body]);
    const int cuts =
        std::clamp(static_cast<int>(std::lround(edge / settings_.probe->point_spacing)), 1, kMaxSubdivision);
    const std::vector<Eigen::Vector3d> points = face_points(cuts);
    points_a_face_ = points.size();
    for (int f = 0; f < surface.face_count(); ++f) {
      for (const Eigen::Vector3d& weights : points) {
        points_.push_back(
            {.face = f, .weights = weights, .area = surface.rest_area(f) / static_cast<double>(points.size())});
      }
    }
    capacity += static_cast<std::size_t>(settings_.probe->max_points);
    unknowns += static_cast<Eigen::Index>(settings_.probe->friction > 0 ? 3 : 1) * settings_.probe->max_points;
  }
  rows_.reserve(capacity);
  w_.resize(unknowns, unknowns);
  slack_.resize(unknowns);

  // What touches at rest is learnt here, so that the first steps need not.
  SolveWorkspace workspace;
  for (std::size_t p = 0; p < settings_.pairs.size(); ++p) find_pair(static_cast<int>(p), companion);
  for (const TissueModel& model : models) learn(model.node_count(), workspace);
  rows_.clear();
  learn_beforehand(companion);
}

void OrganContact::update(const RigidPose* probe, SolveWorkspace& workspace) {
  report_ = {};
  rows_.clear();
  ++updates_;
  for (std::size_t p = 0; p < settings_.pairs.size(); ++p) find_pair(static_cast<int>(p), workspace.companion);
  if (settings_.probe && probe != nullptr) find_probe(*probe, workspace.companion);
  learn(settings_.learn_limit, workspace);
  assemble(workspace.companion);
  relax();
  keep(probe);
  sum_up(probe);
  remember(probe);
}

void OrganContact::follow(int body, const Eigen::Matrix3Xd& positions, Companion* companion) {
  Body& of = bodies_[body];
  if (!of.surface) return;
  of.positions = &positions;
  of.surface->update(positions, companion);
}

void OrganContact::remember(const RigidPose* probe) {
  if (!settings_.probe) return;
  if (probe == nullptr) {
    pose_before_.reset();
    for (const std::size_t slot : inside_) points_[slot].side = ProbeSide::none;
    return;
  }
  pose_before_ = *probe;
  positions_before_ = *bodies_[settings_.probe->body].positions;
}

SurfaceRow OrganContact::face_to_face(int pair, int node, bool pressed, Sight& sight) const {
  const ContactPair& bodies = settings_.pairs[pair];
  const Body& body = bodies_[bodies.nodes_of];
  const BodySurface& surface = *bodies_[bodies.surface_of].surface;
  SurfaceRow row;
  const Eigen::Vector3d x = body.positions->col(node);
  const double outside = surface.bounds().exteriorDistance(x);
  sight.clear = outside - settings_.reach;
  if (sight.clear > 0) return row;
  const SurfacePoint nearest = surface.closest(x, body.surface->node_normal(node), settings_.search, sight.near);
  sight.near = nearest.face;
  const double distance = nearest.face < 0 ? settings_.search : nearest.distance;
  // In front of the surface by more than half its distance, or no row.
  sight.clear = std::min(distance - settings_.reach / kInFront, kSideways * distance);
  if (nearest.face < 0) return row;
  row.normal = surface.normal(nearest);
  row.gap = (x - nearest.position).dot(row.normal);
  if (row.gap < 0) sight.clear = 0;
  const double in_front = nearest.on_crease && !pressed ? kInFrontOfRim : kInFront;
  const double beside = std::sqrt(std::max(0.0, nearest.distance * nearest.distance - row.gap * row.gap));
  const bool stays = nearest.distance <= kOnSurface || (pressed && beside < kOverRim);
  if (!stays && std::abs(row.gap) < in_front * nearest.distance) return row;
  row.position = nearest.position;
  row.pair = pair;
  row.supports[0] = {bodies.nodes_of, node, 1};
  for (std::size_t a = 0; a < 3; ++a) {
    row.supports[a + 1] = {bodies.surface_of, surface.face(nearest.face)[a], -nearest.weights[static_cast<int>(a)]};
  }
  row.support_count = 4;
  return row;
}

bool OrganContact::movable(const SurfaceRow& row) const {
  return std::any_of(row.supports.begin(), row.supports.begin() + row.support_count, [&](const auto& support) {
    const TissueModel& model = *bodies_[support.body].model;
    return support.weight != 0 && model.free_index[support.node] >= 0;
  });
}

void OrganContact::find_pair(int pair, Companion* companion) {
  const auto p = static_cast<std::size_t>(pair);
  const std::span<const int> nodes = bodies_[settings_.pairs[p].nodes_of].surface->nodes();
  const double travel = bodies_[settings_.pairs[p].nodes_of].surface->travel() +
                        bodies_[settings_.pairs[p].surface_of].surface->travel();
  std::array<std::vector<SurfaceRow>, kSharedParts> of_part;
  in_parts(nodes.size() < kNodesWorthSharing ? nullptr : companion, kSharedParts, [&](int part) {
    const auto [begin, end] = part_of(nodes.size(), part);
    for (std::size_t k = begin; k < end; ++k) {
      NodeContact& node = nodes_[p][k];
      if (node.lambda == 0 && travel < node.clear_until && (updates_ + k) % kLookAgain != 0) continue;
      SurfaceRow row = face_to_face(pair, nodes[k], node.lambda > 0, node.sight);
      node.clear_until = travel + node.sight.clear;
      if (row.support_count == 0 || !movable(row)) continue;
      row.gap -= node.rest_overlap;
      if (row.gap > settings_.reach) continue;
      row.lambda = node.lambda;
      row.slot = k;
      of_part[static_cast<std::size_t>(part)].push_back(row);
    }
  });
  std::vector<SurfaceRow> found;
  for (const std::vector<SurfaceRow>& rows : of_part) found.insert(found.end(), rows.begin(), rows.end());
  take_deepest(found, settings_.max_points);
}

void OrganContact::find_probe(const RigidPose& pose, Companion* companion) {
  const ProbeContactSettings& probe = *settings_.probe;
  const Body& body = bodies_[probe.body];
  const Eigen::Matrix3d world_from_probe = pose.orientation.toRotationMatrix();
  const double reach = probe.shape.reach(settings_.search) + settings_.reach;
  faces_.clear();
  body.surface->faces_in({pose.position.array() - reach, pose.position.array() + reach}, faces_);
  for (const std::size_t slot : inside_before_) points_[slot].side_before = ProbeSide::none;
  for (const std::size_t slot : inside_) {
    points_[slot].side_before = points_[slot].side;
    points_[slot].side = ProbeSide::none;
  }
  inside_before_.swap(inside_);
  inside_.clear();
  struct Found {
    std::vector<SurfaceRow> rows;
    std::vector<std::size_t> inside;
  };
  std::array<Found, kSharedParts> of_part;
  in_parts(companion, kSharedParts, [&](int part) {
    Found& found = of_part[static_cast<std::size_t>(part)];
    const auto [begin, end] = part_of(faces_.size(), part);
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t first = static_cast<std::size_t>(faces_[i]) * points_a_face_;
      for (std::size_t slot = first; slot < first + points_a_face_; ++slot) {
        if (SurfaceRow row; meets_probe(points_[slot], pose, world_from_probe, row)) {
          row.slot = slot;
          found.rows.push_back(row);
        }
        if (points_[slot].side != ProbeSide::none) found.inside.push_back(slot);
      }
    }
  });
  std::vector<SurfaceRow> rows;
  for (const Found& found : of_part) {
    rows.insert(rows.end(), found.rows.begin(), found.rows.end());
    inside_.insert(inside_.end(), found.inside.begin(), found.inside.end());
  }
  take_deepest(rows, probe.max_points);
}

bool OrganContact::meets_probe(ProbePoint& point, const RigidPose& pose, const Eigen::Matrix3d& world_from_probe,
                               SurfaceRow& row) {
  const ProbeContactSettings& probe = *settings_.probe;
  const Body& body = bodies_[probe.body];
  const auto& nodes = body.surface->face(point.face);
  const auto& x = *body.positions;
  const Eigen::Vector3d a = x.col(nodes[0]);
  const Eigen::Vector3d b = x.col(nodes[1]);
  const Eigen::Vector3d c = x.col(nodes[2]);
  row.position = point.weights[0] * a + point.weights[1] * b + point.weights[2] * c;
  const Eigen::Vector3d in_probe = world_from_probe.transpose() * (row.position - pose.position);
  if (std::abs(in_probe.y()) > probe.shape.half_height + settings_.reach) return false;  // the others are curved
  ProbeShape::Distance distance = probe.shape.distance_from(point.side_before, in_probe);
  if (distance.value > settings_.reach) return false;
  ProbeSide side = point.side_before;
  if (side == ProbeSide::none && distance.value < 0) {
    side = probe.shape.entry(before(point, in_probe), in_probe);
    distance = probe.shape.distance_from(side, in_probe);
  }
  row.normal = world_from_probe * distance.gradient;
  // The far side of a thin body; but not where the skin has been turned over under the head.
  if (point.side_before == ProbeSide::none && (b - a).cross(c - a).dot(row.normal) >= 0) return false;
  if (distance.value < 0) point.side = side;
  row.gap = distance.value;
  row.area = point.area;
  // The secant of (30) at the force of the step before.
  row.compliance = probe.layer_compliance / point.area;
  row.compliance /= std::hypot(1, row.compliance * point.lambda / probe.layer_thickness);
  row.lambda = point.lambda;
  row.support_count = 3;
  for (std::size_t n = 0; n < 3; ++n) row.supports[n] = {probe.body, nodes[n], point.weights[static_cast<int>(n)]};
  if (!movable(row)) return false;
  if (probe.friction > 0) hold(row, point, in_probe, world_from_probe);
  return true;
}

Eigen::Vector3d OrganContact::before(const ProbePoint& point, const Eigen::Vector3d& in_probe) const {
  if (!pose_before_) return in_probe;
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  const auto& nodes = bodies_[settings_.probe->body].surface->face(point.face);
  for (std::size_t n = 0; n < 3; ++n) x += point.weights[static_cast<int>(n)] * positions_before_.col(nodes[n]);
  return pose_before_->orientation.toRotationMatrix().transpose() * (x - pose_before_->position);
}

void OrganContact::take_deepest(std::vector<SurfaceRow>& found, int most) {
  const auto room = static_cast<std::size_t>(most);
  if (found.size() > room) {
    std::nth_element(found.begin(), found.begin() + most, found.end(), [](const SurfaceRow& a, const SurfaceRow& b) {
      return std::pair(a.gap, a.slot) < std::pair(b.gap, b.slot);
    });
    report_.left_out += static_cast<int>(found.size() - room);
    found.resize(room);
  }
  std::sort(found.begin(), found.end(), [](const SurfaceRow& a, const SurfaceRow& b) { return a.slot < b.slot; });
  rows_.insert(rows_.end(), found.begin(), found.end());
}

bool OrganContact::is_large(const Body& body) const {
  return body.model != nullptr && body.model->dof_count() >= settings_.large_dofs;
}

void OrganContact::learn_beforehand(Companion* companion) {
  std::vector<std::vector<int>> wanted(bodies_.size());
  for (std::size_t p = 0; p < settings_.pairs.size(); ++p) {
    for (const int node : bodies_[settings_.pairs[p].nodes_of].surface->nodes()) {
      Sight unknown;
      const SurfaceRow row = face_to_face(static_cast<int>(p), node, true, unknown);
      for (int s = 0; s < row.support_count; ++s) wanted[row.supports[s].body].push_back(row.supports[s].node);
    }
  }
  // A small body slides on a large one as the patient breathes.
  const auto slide = [&](int large, int small) {
    if (!is_large(bodies_[large]) || is_large(bodies_[small])) return;
    const std::span<const int> around = bodies_[small].surface->nodes();
    for (const int node : bodies_[large].surface->nodes()) {
      const Eigen::Vector3d& x = bodies_[large].model->mesh.nodes[node];
      const bool near = std::any_of(around.begin(), around.end(), [&](int other) {
        return (bodies_[small].model->mesh.nodes[other] - x).squaredNorm() < kSlidesWithin * kSlidesWithin;
      });
      if (near) wanted[large].push_back(node);
    }
  };
  for (const ContactPair& pair : settings_.pairs) {
    slide(pair.nodes_of, pair.surface_of);
    slide(pair.surface_of, pair.nodes_of);
  }
  if (settings_.probe && settings_.probe->held_at) {
    const int body = settings_.probe->body;
    for (const int node : bodies_[body].surface->nodes()) {
      const double distance = (bodies_[body].model->mesh.nodes[node] - *settings_.probe->held_at).norm();
      if (distance < kHeldWithin) wanted[body].push_back(node);
    }
  }
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    if (is_large(bodies_[b])) bodies_[b].compliance->learn_all(wanted[b], companion);
  }
}

void OrganContact::learn(int limit, SolveWorkspace& workspace) {
  for (Body& body : bodies_) body.touched.clear();
  for (const bool pressed : {true, false}) {
    for (const SurfaceRow& row : rows_) {
      if ((row.lambda > 0) != pressed) continue;
      for (int s = 0; s < row.support_count; ++s) {
        const SurfaceRow::Support& support = row.supports[s];
        bodies_[support.body].touched.push_back(support.node);
      }
    }
  }
  for (Body& body : bodies_) {
    if (body.compliance) body.compliance->learn(body.touched, limit, workspace);
  }
  std::erase_if(rows_, [&](const SurfaceRow& row) {  // they come in the next steps
    return std::any_of(row.supports.begin(), row.supports.begin() + row.support_count,
                       [&](const auto& support) { return !bodies_[support.body].compliance->known(support.node); });
  });
}

void OrganContact::hold(SurfaceRow& row, ProbePoint& point, const Eigen::Vector3d& in_probe,
                        const Eigen::Matrix3d& world_from_probe) {
  const ProbeContactSettings& probe = *settings_.probe;
  row.limit = probe.friction * point.lambda;
  if (row.limit <= 0) return;  // nothing pressed it here yet
  row.across = across(row.normal);
  row.shear_compliance = probe.shear_compliance / point.area;
  const auto along = [&](const Eigen::Vector3d& v) {
    const Eigen::Vector3d world = world_from_probe * v;
    return Eigen::Vector2d(row.across[0].dot(world), row.across[1].dot(world));
  };
  row.tangential = within(along(point.friction), row.limit);
  row.offset = along(in_probe - point.anchor);
}

// W = D^T (S D), D having the directions of the unknowns on the nodes of their rows.
void OrganContact::assemble(Companion* companion) {
  unknowns_ = 0;
  for (SurfaceRow& row : rows_) {
    row.first = static_cast<int>(unknowns_);
    unknowns_ += row.unknowns();
  }
  for (Body& body : bodies_) {
    if (!body.compliance) continue;
    keep_distinct(body.touched);
    keep_distinct(body.loaded);
    body.compliance->gather(body.touched, body.loaded);
  }
  const auto direction = [](const SurfaceRow& row, int k) -> const Eigen::Vector3d& {
    return k == 0 ? row.normal : row.across[static_cast<std::size_t>(k) - 1];
  };
  /// each(first row in the gathered compliance, weight) of what the row touches of a body and can move.
  const auto for_supports = [&](const SurfaceRow& row, std::size_t b, const auto& each) {
    for (int s = 0; s < row.support_count; ++s) {
      const SurfaceRow::Support& support = row.supports[s];
      if (support.body != static_cast<int>(b)) continue;
      if (const Eigen::Index at = bodies_[b].compliance->gathered_row(support.node); at >= 0)
        each(at, support.weight);
    }
  };
  const auto couple = [&](std::size_t i, Eigen::VectorXf& moved) {
    const SurfaceRow& row = rows_[i];
    for (int u = row.first; u < row.first + row.unknowns(); ++u) {
      w_.row(u).head(u + 1).setZero();
      for (std::size_t b = 0; b < bodies_.size(); ++b) {
        if (!bodies_[b].compliance) continue;
        const SurfaceCompliance& compliance = *bodies_[b].compliance;
        bool touched = false;
        moved.setZero(compliance.gathered_rows());
        for_supports(row, b, [&](Eigen::Index at, double weight) {
          compliance.add_motion(at, weight * direction(row, u - row.first), moved);
          touched = true;
        });
        for (std::size_t j = 0; j <= i && touched; ++j) {
          const SurfaceRow& other = rows_[j];
          Eigen::Vector3d motion = Eigen::Vector3d::Zero();
          for_supports(other, b, [&](Eigen::Index at, double weight) {
            motion += weight * moved.segment<3>(at).cast<double>();
          });
          const int last = std::min(other.first + other.unknowns() - 1, u);
          for (int v = other.first; v <= last; ++v) w_(u, v) += direction(other, v - other.first).dot(motion);
        }
      }
      for (int v = 0; v < u; ++v) w_(v, u) = w_(u, v);
    }
  };
  in_parts(rows_.size() < kRowsWorthSharing ? nullptr : companion, kSharedParts, [&](int part) {
    Eigen::VectorXf moved;
    for (std::size_t i = static_cast<std::size_t>(part); i < rows_.size(); i += kSharedParts) couple(i, moved);
  });
  double trace = 0;
  for (const SurfaceRow& row : rows_) trace += w_(row.first, row.first);
  const double proximal = rows_.empty() ? 0 : kProximal * trace / static_cast<double>(rows_.size());
  for (const SurfaceRow& row : rows_) {
    w_(row.first, row.first) += proximal + row.compliance;
    for (int k = 1; k < row.unknowns(); ++k) {
      w_(row.first + k, row.first + k) += proximal + row.shear_compliance;
    }
  }
}

void OrganContact::foresee_turn() {
  // The bodies rest under the forces of the last update. The same multipliers on the rows of now are other forces:
  // normals have turned, points have moved to other faces, some are gone. What the bodies do about that comes before
  // what a change of the multipliers does. Left out, a point stuck on a round rim would swing for ever.
  for (SurfaceRow& row : rows_) {
    for (int s = 0; s < row.support_count; ++s) {
      const SurfaceRow::Support& support = row.supports[s];
      Body& body = bodies_[support.body];
      body.force.col(support.node) -= support.weight * row.force();  // what is lost
      body.loaded.push_back(support.node);
    }
  }
  for (Body& body : bodies_) {
    if (!body.surface) continue;
    keep_distinct(body.loaded);
    Eigen::VectorXf moved = Eigen::VectorXf::Zero(body.compliance->gathered_rows());
    for (const int from : body.loaded) {
      const Eigen::Index at = body.compliance->gathered_row(from);
      if (at >= 0 && !body.force.col(from).isZero(0)) body.compliance->add_motion(at, -body.force.col(from), moved);
    }
    for (const int node : body.touched) {
      const Eigen::Index at = body.compliance->gathered_row(node);
      auto motion = body.motion.col(node);
      motion.setZero();
      if (at >= 0) motion = moved.segment<3>(at).cast<double>();
    }
    for (const int node : body.loaded) body.force.col(node).setZero();
    body.loaded.clear();
  }
  for (const SurfaceRow& row : rows_) {
    Eigen::Vector3d motion = Eigen::Vector3d::Zero();
    for (int s = 0; s < row.support_count; ++s) {
      const SurfaceRow::Support& support = row.supports[s];
      motion += support.weight * bodies_[support.body].motion.col(support.node);
    }
    slack_[row.first] += row.normal.dot(motion);
    for (int k = 1; k < row.unknowns(); ++k) {
      slack_[row.first + k] += row.across[k - 1].dot(motion);
    }
  }
}

void OrganContact::relax() {
  // The force across the normal that the slack of the row asks for, its limit aside; and how it yields.
  const auto sideways = [&](const SurfaceRow& row, double& yields) {
    yields = stiffest(w_.block<2, 2>(row.first + 1, row.first + 1));
    return Eigen::Vector2d(row.tangential - slack_.segment<2>(row.first + 1) / yields);
  };
  for (const SurfaceRow& row : rows_) {
    slack_[row.first] = row.gap + row.compliance * row.lambda;
    report_.violation =
        std::max(report_.violation, std::abs(std::min(slack_[row.first], w_(row.first, row.first) * row.lambda)));
    if (row.limit <= 0) continue;
    slack_.segment<2>(row.first + 1) = row.offset + row.shear_compliance * row.tangential;
    double yields = 0;
    const Eigen::Vector2d wrong = within(sideways(row, yields), row.limit) - row.tangential;
    report_.violation = std::max(report_.violation, wrong.norm() * yields);
  }
  foresee_turn();
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    double moved = 0;
    for (SurfaceRow& row : rows_) {
      const double next = std::max(0.0, row.lambda - slack_[row.first] / w_(row.first, row.first));
      if (const double change = next - row.lambda; change != 0) {
        row.lambda = next;
        slack_.head(unknowns_) += change * w_.col(row.first).head(unknowns_);
        moved = std::max(moved, std::abs(change) * w_(row.first, row.first));
      }
      if (row.limit <= 0) continue;
      // The limit is that of the step before: what is solved is convex, and has one solution.
      double yields = 0;
      const Eigen::Vector2d force = within(sideways(row, yields), row.limit);
      const Eigen::Vector2d change = force - row.tangential;
      row.tangential = force;
      slack_.head(unknowns_) += w_.middleCols<2>(row.first + 1).topRows(unknowns_) * change;
      moved = std::max(moved, change.norm() * yields);
    }
    if (moved < kSettled) break;
  }
}

void OrganContact::keep(const RigidPose* probe) {
  const Eigen::Matrix3d probe_from_world = probe != nullptr
                                               ? Eigen::Matrix3d(probe->orientation.toRotationMatrix().transpose())
                                               : Eigen::Matrix3d::Identity();
  for (std::vector<NodeContact>& nodes : nodes_) {
    for (NodeContact& node : nodes) node.lambda = 0;
  }
  for (const std::size_t slot : pressed_points_) points_[slot].lambda = 0;
  pressed_points_.clear();
  for (SurfaceRow& row : rows_) {
    if (!std::isfinite(row.lambda)) row.lambda = 0;
    if (!row.tangential.allFinite()) row.tangential.setZero();
    if (row.pair >= 0) {
      nodes_[row.pair][row.slot].lambda = row.lambda;
      continue;
    }
    ProbePoint& point = points_[row.slot];
    point.lambda = row.lambda;
    pressed_points_.push_back(row.slot);
    if (row.limit > 0) {
      // Where friction is at its limit and the point would be held more still, it slides along its force: the anchor
      // follows by what the law leaves over.
      const double strength = row.tangential.norm();
      if (strength >= (1 - kAtLimit) * row.limit) {
        const Eigen::Vector2d direction = row.tangential / strength;
        const double slip = std::max(0.0, -direction.dot(slack_.segment<2>(row.first + 1)));
        point.anchor -= slip * (probe_from_world * (direction[0] * row.across[0] + direction[1] * row.across[1]));
      }
      // No more than this step's normal force allows, either.
      row.tangential = within(row.tangential, settings_.probe->friction * row.lambda);
      point.friction = probe_from_world * (row.tangential[0] * row.across[0] + row.tangential[1] * row.across[1]);
    } else {
      point.friction.setZero();
      point.anchor = probe_from_world * (row.position - probe->position);
    }
  }
}

void OrganContact::sum_up(const RigidPose* probe) {
  probe_ = {};
  report_.rows = static_cast<int>(rows_.size());
  collect_forces();
  for (const SurfaceRow& row : rows_) {
    if (row.pair >= 0) report_.deepest = std::max(report_.deepest, -row.gap);
    if (row.lambda <= 0) continue;
    ++report_.pressing;
    if (row.pair >= 0) {
      report_.force_n += row.lambda;
      continue;
    }
    ++probe_.points;
    probe_.area += row.area;
    probe_.depth = std::max(probe_.depth, -row.gap);
    const double strength = row.tangential.norm();
    if (strength > 0 && strength >= (1 - kAtLimit) * settings_.probe->friction * row.lambda) ++probe_.sliding;
    const Eigen::Vector3d force = -row.force();
    probe_.wrench.force += force;
    probe_.wrench.moment += (row.position - probe->position).cross(force);
  }
  if (probe != nullptr) feel(*probe);
}

void OrganContact::feel(const RigidPose& probe) {
  const Eigen::Vector3d axis = probe.orientation * Eigen::Vector3d::UnitZ();
  pressed_.clear();
  std::vector<double> along;  // how a gap closes as the head advances
  double gap = settings_.reach;
  for (const SurfaceRow& row : rows_) {
    if (row.pair >= 0) continue;
    probe_.near = true;
    if (row.lambda > 0) {
      pressed_.push_back(row.first);
      along.push_back(row.normal.dot(axis));
    } else {
      gap = std::min(gap, row.gap);
    }
  }
  if (pressed_.empty()) {
    probe_.gap = gap;
    return;
  }
  const Eigen::MatrixXd w = w_(pressed_, pressed_);
  const Eigen::Map<const Eigen::VectorXd> a(along.data(), static_cast<Eigen::Index>(along.size()));
  probe_.stiffness = a.dot(w.llt().solve(a));
}

void OrganContact::collect_forces() {
  for (const SurfaceRow& row : rows_) {
    for (int s = 0; s < row.support_count && row.lambda > 0; ++s) {
      const SurfaceRow::Support& support = row.supports[s];
      Body& body = bodies_[support.body];
      body.force.col(support.node) += support.weight * row.force();
      body.loaded.push_back(support.node);
    }
  }
}

void OrganContact::take(std::span<const int> rows, Eigen::Ref<const Eigen::VectorXd> lambda) {
  for (std::size_t k = 0; k < rows.size(); ++k) {
    SurfaceRow& row = rows_[rows[k]];
    row.lambda = std::max(0.0, lambda[static_cast<Eigen::Index>(k)]);
    (row.pair >= 0 ? nodes_[row.pair][row.slot].lambda : points_[row.slot].lambda) = row.lambda;
  }
  for (Body& body : bodies_) {
    for (const int node : body.loaded) body.force.col(node).setZero();
    body.loaded.clear();
  }
  collect_forces();
}

std::size_t OrganContact::nodes(int body, std::vector<int>& out) const {
  out.clear();
  std::size_t pressed = 0;
  for (const bool under_force : {true, false}) {
    for (const SurfaceRow& row : rows_) {
      if ((row.lambda > 0) != under_force) continue;
      for (int s = 0; s < row.support_count; ++s) {
        const SurfaceRow::Support& support = row.supports[s];
        if (support.body != body || bodies_[body].model->free_index[support.node] < 0) continue;
        if (std::find(out.begin(), out.end(), support.node) == out.end()) out.push_back(support.node);
      }
    }
    if (under_force) pressed = out.size();
  }
  return pressed;
}

void OrganContact::add_forces(int body, Eigen::VectorXd& forces) const {
  for (const SurfaceRow& row : rows_) {
    if (row.lambda <= 0) continue;
    for (int s = 0; s < row.support_count; ++s) {
      const SurfaceRow::Support& support = row.supports[s];
      if (support.body != body) continue;
      const int i = bodies_[body].model->free_index[support.node];
      if (i >= 0) forces.segment<3>(3 * i) += support.weight * row.force();
    }
  }
}

}  // namespace stylet::physics
