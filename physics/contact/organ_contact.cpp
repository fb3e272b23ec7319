#include "physics/contact/organ_contact.h"

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
constexpr int kMaxSubdivision = 6;   // of a face's edge into probe points

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

double mean_edge(const BodySurface& surface, const TissueModel& model) {
  double sum = 0;
  for (int f = 0; f < surface.face_count(); ++f) {
    const auto& [a, b, c] = surface.face(f);
    sum += (model.mesh.nodes[static_cast<std::size_t>(b)] - model.mesh.nodes[static_cast<std::size_t>(a)]).norm();
  }
  return sum / surface.face_count();
}

}  // namespace

OrganContact::OrganContact(std::span<const TissueModel> models, std::span<const Factorisation* const> rest,
                           OrganContactSettings settings)
    : settings_(std::move(settings)), bodies_(models.size()) {
  check(models, settings_);
  std::vector<char> used(models.size(), 0);
  for (const ContactPair& pair : settings_.pairs) {
    used[static_cast<std::size_t>(pair.nodes_of)] = used[static_cast<std::size_t>(pair.surface_of)] = 1;
  }
  if (settings_.probe) used[static_cast<std::size_t>(settings_.probe->body)] = 1;
  std::vector<Eigen::Matrix3Xd> at_rest;
  for (const TissueModel& model : models) at_rest.push_back(rest_positions(model));
  for (std::size_t b = 0; b < models.size(); ++b) {
    if (used[b] == 0) continue;
    bodies_[b].model = &models[b];
    bodies_[b].surface = std::make_unique<BodySurface>(models[b]);
    bodies_[b].compliance = std::make_unique<SurfaceCompliance>(models[b], *rest[b], bodies_[b].surface->nodes());
    bodies_[b].positions = &at_rest[b];
  }

  std::size_t capacity = 0;
  for (std::size_t p = 0; p < settings_.pairs.size(); ++p) {
    const std::span<const int> nodes =
        bodies_[static_cast<std::size_t>(settings_.pairs[p].nodes_of)].surface->nodes();
    std::vector<NodeContact>& states = nodes_.emplace_back(nodes.size());
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const SurfaceRow row = face_to_face(static_cast<int>(p), nodes[k], true);
      if (row.support_count > 0) states[k].rest_overlap = std::min(0.0, row.gap);
    }
    capacity += static_cast<std::size_t>(settings_.max_points);
  }
  if (settings_.probe) {
    const BodySurface& surface = *bodies_[static_cast<std::size_t>(settings_.probe->body)].surface;
    const double edge = mean_edge(surface, models[static_cast<std::size_t>(settings_.probe->body)]);
    const int cuts =
        std::clamp(static_cast<int>(std::lround(edge / settings_.probe->point_spacing)), 1, kMaxSubdivision);
    const std::vector<Eigen::Vector3d> points = face_points(cuts);
    points_a_face_ = points.size();
    for (int f = 0; f < surface.face_count(); ++f) {
      for (const Eigen::Vector3d& weights : points) {
        points_.push_back({.face = f,
                           .weights = weights,
                           .area = surface.rest_area(f) / static_cast<double>(points.size()),
                           .lambda = 0});
      }
    }
    capacity += static_cast<std::size_t>(settings_.probe->max_points);
  }
  rows_.reserve(capacity);
  w_.resize(static_cast<Eigen::Index>(capacity), static_cast<Eigen::Index>(capacity));
  slack_.resize(static_cast<Eigen::Index>(capacity));

  // What touches at rest is learnt here, so that the first steps need not.
  SolveWorkspace workspace;
  for (std::size_t p = 0; p < settings_.pairs.size(); ++p) find_pair(static_cast<int>(p));
  for (const TissueModel& model : models) learn(model.node_count(), workspace);
  rows_.clear();
}

void OrganContact::update(std::span<const Eigen::Matrix3Xd> positions, const RigidPose* probe,
                          SolveWorkspace& workspace) {
  report_ = {};
  rows_.clear();
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    if (!bodies_[b].surface) continue;
    bodies_[b].positions = &positions[b];
    bodies_[b].surface->update(positions[b]);
  }
  for (std::size_t p = 0; p < settings_.pairs.size(); ++p) find_pair(static_cast<int>(p));
  if (settings_.probe && probe != nullptr) find_probe(*probe);
  learn(settings_.learn_limit, workspace);
  assemble();
  relax();
  keep();
  sum_up(probe);
}

SurfaceRow OrganContact::face_to_face(int pair, int node, bool pressed) const {
  const ContactPair& bodies = settings_.pairs[static_cast<std::size_t>(pair)];
  const Body& body = bodies_[static_cast<std::size_t>(bodies.nodes_of)];
  const BodySurface& surface = *bodies_[static_cast<std::size_t>(bodies.surface_of)].surface;
  SurfaceRow row;
  const Eigen::Vector3d x = body.positions->col(node);
  if (surface.bounds().squaredExteriorDistance(x) > settings_.reach * settings_.reach) return row;
  const SurfacePoint nearest = surface.closest(x, body.surface->node_normal(node), settings_.search);
  if (nearest.face < 0) return row;
  row.normal = surface.normal(nearest);
  row.gap = (x - nearest.position).dot(row.normal);
  const double in_front = nearest.on_crease && !pressed ? kInFrontOfRim : kInFront;
  if (nearest.distance > kOnSurface && std::abs(row.gap) < in_front * nearest.distance) return row;
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
    const TissueModel& model = *bodies_[static_cast<std::size_t>(support.body)].model;
    return support.weight != 0 && model.free_index[static_cast<std::size_t>(support.node)] >= 0;
  });
}

void OrganContact::find_pair(int pair) {
  const auto p = static_cast<std::size_t>(pair);
  const std::span<const int> nodes = bodies_[static_cast<std::size_t>(settings_.pairs[p].nodes_of)].surface->nodes();
  std::vector<SurfaceRow> found;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    SurfaceRow row = face_to_face(pair, nodes[k], nodes_[p][k].lambda > 0);
    if (row.support_count == 0 || !movable(row)) continue;
    row.gap -= nodes_[p][k].rest_overlap;
    if (row.gap > settings_.reach) continue;
    row.lambda = nodes_[p][k].lambda;
    row.slot = k;
    found.push_back(row);
  }
  take_deepest(found, settings_.max_points);
}

void OrganContact::find_probe(const RigidPose& pose) {
  const ProbeContactSettings& probe = *settings_.probe;
  const Body& body = bodies_[static_cast<std::size_t>(probe.body)];
  const Eigen::Matrix3d world_from_probe = pose.orientation.toRotationMatrix();
  const double reach = probe.shape.reach(settings_.search) + settings_.reach;
  faces_.clear();
  body.surface->faces_in({pose.position.array() - reach, pose.position.array() + reach}, faces_);
  std::vector<SurfaceRow> found;
  for (const int f : faces_) {
    const auto& [a, b, c] = body.surface->face(f);
    const auto& x = *body.positions;
    const Eigen::Vector3d outward = (x.col(b) - x.col(a)).cross(x.col(c) - x.col(a));
    for (std::size_t k = 0; k < points_a_face_; ++k) {
      const std::size_t slot = static_cast<std::size_t>(f) * points_a_face_ + k;
      const ProbePoint& point = points_[slot];
      SurfaceRow row;
      row.position = point.weights[0] * x.col(a) + point.weights[1] * x.col(b) + point.weights[2] * x.col(c);
      const ProbeShape::Distance distance =
          probe.shape.distance(world_from_probe.transpose() * (row.position - pose.position));
      if (distance.value > settings_.reach) continue;
      row.normal = world_from_probe * distance.gradient;
      if (outward.dot(row.normal) >= 0) continue;  // the far side of a thin body
      row.gap = distance.value;
      row.area = point.area;
      row.compliance = probe.layer_compliance / point.area;
      row.lambda = point.lambda;
      row.slot = slot;
      row.support_count = 3;
      for (std::size_t n = 0; n < 3; ++n) {
        row.supports[n] = {probe.body, body.surface->face(f)[n], point.weights[static_cast<int>(n)]};
      }
      if (movable(row)) found.push_back(row);
    }
  }
  take_deepest(found, probe.max_points);
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

void OrganContact::learn(int limit, SolveWorkspace& workspace) {
  for (Body& body : bodies_) body.touched.clear();
  for (const bool pressed : {true, false}) {
    for (const SurfaceRow& row : rows_) {
      if ((row.lambda > 0) != pressed) continue;
      for (int s = 0; s < row.support_count; ++s) {
        const SurfaceRow::Support& support = row.supports[static_cast<std::size_t>(s)];
        bodies_[static_cast<std::size_t>(support.body)].touched.push_back(support.node);
      }
    }
  }
  for (Body& body : bodies_) {
    if (body.compliance) body.compliance->learn(body.touched, limit, workspace);
  }
  std::erase_if(rows_, [&](const SurfaceRow& row) {  // they come in the next steps
    return std::any_of(row.supports.begin(), row.supports.begin() + row.support_count, [&](const auto& support) {
      return !bodies_[static_cast<std::size_t>(support.body)].compliance->known(support.node);
    });
  });
}

void OrganContact::assemble() {
  const auto n = static_cast<Eigen::Index>(rows_.size());
  double trace = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const SurfaceRow& row = rows_[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j <= i; ++j) {
      const SurfaceRow& other = rows_[static_cast<std::size_t>(j)];
      double sum = 0;
      for (int a = 0; a < row.support_count; ++a) {
        const SurfaceRow::Support& at = row.supports[static_cast<std::size_t>(a)];
        for (int b = 0; b < other.support_count; ++b) {
          const SurfaceRow::Support& from = other.supports[static_cast<std::size_t>(b)];
          if (at.body != from.body) continue;
          const SurfaceCompliance& compliance = *bodies_[static_cast<std::size_t>(at.body)].compliance;
          sum += at.weight * from.weight * row.normal.dot(compliance.block(at.node, from.node) * other.normal);
        }
      }
      w_(i, j) = w_(j, i) = sum;
    }
    trace += w_(i, i);
  }
  const double proximal = n > 0 ? kProximal * trace / static_cast<double>(n) : 0;
  for (Eigen::Index i = 0; i < n; ++i) w_(i, i) += proximal + rows_[static_cast<std::size_t>(i)].compliance;
}

void OrganContact::relax() {
  const auto n = static_cast<Eigen::Index>(rows_.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    const SurfaceRow& row = rows_[static_cast<std::size_t>(i)];
    slack_[i] = row.gap + row.compliance * row.lambda;
    report_.violation = std::max(report_.violation, std::abs(std::min(slack_[i], w_(i, i) * row.lambda)));
  }
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    double moved = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      double& lambda = rows_[static_cast<std::size_t>(i)].lambda;
      const double next = std::max(0.0, lambda - slack_[i] / w_(i, i));
      const double change = next - lambda;
      if (change == 0) continue;
      lambda = next;
      slack_.head(n) += change * w_.col(i).head(n);
      moved = std::max(moved, std::abs(change) * w_(i, i));
    }
    if (moved < kSettled) break;
  }
}

void OrganContact::keep() {
  for (std::vector<NodeContact>& nodes : nodes_) {
    for (NodeContact& node : nodes) node.lambda = 0;
  }
  for (ProbePoint& point : points_) point.lambda = 0;
  for (SurfaceRow& row : rows_) {
    if (!std::isfinite(row.lambda)) row.lambda = 0;
    (row.pair >= 0 ? nodes_[static_cast<std::size_t>(row.pair)][row.slot].lambda : points_[row.slot].lambda) =
        row.lambda;
  }
}

void OrganContact::sum_up(const RigidPose* probe) {
  probe_ = {};
  report_.rows = static_cast<int>(rows_.size());
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
    const Eigen::Vector3d force = -row.lambda * row.normal;
    probe_.wrench.force += force;
    probe_.wrench.moment += (row.position - probe->position).cross(force);
  }
}

void OrganContact::add_forces(int body, Eigen::VectorXd& forces) const {
  for (const SurfaceRow& row : rows_) {
    if (row.lambda <= 0) continue;
    for (int s = 0; s < row.support_count; ++s) {
      const SurfaceRow::Support& support = row.supports[static_cast<std::size_t>(s)];
      if (support.body != body) continue;
      const int i = bodies_[static_cast<std::size_t>(body)].model->free_index[static_cast<std::size_t>(support.node)];
      if (i >= 0) forces.segment<3>(3 * i) += support.weight * row.lambda * row.normal;
    }
  }
}

}  // namespace stylet::physics
