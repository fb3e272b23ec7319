#include "engine/author/picking.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace stylet::author {
namespace {

constexpr double kNormalReach = 0.012;  // m of skin that a normal is taken of

std::optional<double> hit(const Ray& ray, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                          const Eigen::Vector3d& c) {
  // Moeller and Trumbore 1997.
  const Eigen::Vector3d ab = b - a, ac = c - a, p = ray.along.cross(ac);
  const double det = ab.dot(p);
  if (det == 0) return {};
  const Eigen::Vector3d from = ray.from - a;
  const double u = from.dot(p) / det;
  const Eigen::Vector3d q = from.cross(ab);
  const double v = ray.along.dot(q) / det;
  if (u < 0 || v < 0 || u + v > 1) return {};
  const double t = ac.dot(q) / det;
  return t > 0 ? std::optional(t) : std::nullopt;
}

/// Share of the way through the box of the labels; nothing: it goes by.
std::optional<std::array<double, 2>> through_box(const content::LabelVolume& labels, const Ray& ray) {
  const Eigen::Vector3d low = labels.origin.cast<double>().array() - labels.spacing;
  const Eigen::Vector3d high = low + double(labels.spacing) * (labels.size.cast<double>().array() + 1).matrix();
  double from = 0, to = 1e9;
  for (int axis = 0; axis < 3; ++axis) {
    if (ray.along[axis] == 0) {
      if (ray.from[axis] < low[axis] || ray.from[axis] > high[axis]) return {};
      continue;
    }
    const double one = (low[axis] - ray.from[axis]) / ray.along[axis];
    const double other = (high[axis] - ray.from[axis]) / ray.along[axis];
    from = std::max(from, std::min(one, other));
    to = std::min(to, std::max(one, other));
  }
  if (from >= to) return {};
  return std::array{from, to};
}

}  // namespace

Ray ray_through(const content::Camera& camera, double x, double y, int width, int height) {
  const Eigen::Vector3d ahead = (camera.look_at - camera.eye).normalized();
  const Eigen::Vector3d right = ahead.cross(camera.up).normalized();
  const Eigen::Vector3d up = right.cross(ahead);
  const double focal = height / 2.0 / std::tan(camera.vertical_fov / 2);
  return {.from = camera.eye,
          .along = (ahead + (x - width / 2.0) / focal * right - (y - height / 2.0) / focal * up).normalized()};
}

std::vector<Chord> chords(const content::Scene& scene, const Ray& ray) {
  std::vector<Chord> found;
  std::vector<double> hits;
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    const content::Surface& surface = scene.surfaces[s];
    const auto corner = [&](std::size_t i) { return surface.positions[surface.indices[i]].cast<double>(); };
    hits.clear();
    for (std::size_t i = 0; i + 2 < surface.indices.size(); i += 3) {
      if (const auto t = hit(ray, corner(i), corner(i + 1), corner(i + 2))) hits.push_back(*t);
    }
    std::ranges::sort(hits);
    // Through an edge that two triangles share is through the surface once.
    hits.erase(std::unique(hits.begin(), hits.end(), [](double a, double b) { return b - a < 1e-7; }), hits.end());
    if (hits.size() % 2 == 0) {
      for (std::size_t i = 0; i < hits.size(); i += 2) found.push_back({s, hits[i], hits[i + 1]});
    } else {
      for (const double t : hits) found.push_back({s, t, t});
    }
  }
  std::ranges::stable_sort(found, {}, &Chord::from);
  return found;
}

bool inside_patient(const content::LabelVolume& labels, const Eigen::Vector3d& point) {
  const Eigen::Vector3d grid = (point - labels.origin.cast<double>()) / labels.spacing;
  if ((grid.array() < -0.5).any() || (grid.array() > labels.size.cast<double>().array() - 0.5).any()) return false;
  const Eigen::Vector3i at = grid.array().round().cast<int>().max(0).min(labels.size.array() - 1);
  const auto nx = static_cast<std::size_t>(labels.size.x()), ny = static_cast<std::size_t>(labels.size.y());
  return labels.labels[(static_cast<std::size_t>(at.z()) * ny + static_cast<std::size_t>(at.y())) * nx +
                       static_cast<std::size_t>(at.x())] != 0;
}

std::optional<SkinPoint> skin_under(const content::LabelVolume& labels, const Ray& ray) {
  const auto way = through_box(labels, ray);
  if (!way) return {};
  const double step = 0.25 * labels.spacing;
  bool outside = false;
  for (double t = (*way)[0]; t < (*way)[1]; t += step) {
    const bool inside = inside_patient(labels, ray.at(t));
    outside = outside || !inside;
    if (!inside || !outside) continue;
    SkinPoint skin{.point = ray.at(t - 0.5 * step)};
    // From the middle of the tissue about it to the middle of the air about it.
    const int reach = std::clamp(static_cast<int>(kNormalReach / labels.spacing), 2, 24);
    const double apart = kNormalReach / reach;
    Eigen::Vector3d out = Eigen::Vector3d::Zero();
    for (int z = -reach; z <= reach; ++z) {
      for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
          const Eigen::Vector3d aside = apart * Eigen::Vector3d(x, y, z);
          if (aside.norm() <= kNormalReach && !inside_patient(labels, skin.point + aside)) out += aside;
        }
      }
    }
    skin.normal = out.norm() > 0 ? Eigen::Vector3d(out.normalized()) : Eigen::Vector3d(-ray.along);
    return skin;
  }
  return {};
}

std::optional<SkinPoint> entry_of(const content::Motion& motion, double needle_length,
                                  const content::LabelVolume& labels) {
  if (motion.stylus.empty()) return {};
  const physics::StylusPose& hub = motion.stylus.front().pose;
  const Eigen::Vector3d along = hub.orientation * Eigen::Vector3d::UnitZ();
  return skin_under(labels, {.from = hub.position + needle_length * along, .along = along});
}

content::Target target_of(const content::Scene& scene, std::span<const std::size_t> surfaces) {
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  double volume = 0;
  for (const std::size_t s : surfaces) {
    const content::Surface& surface = scene.surfaces[s];
    const auto corner = [&](std::size_t i) { return surface.positions[surface.indices[i]].cast<double>(); };
    for (std::size_t i = 0; i + 2 < surface.indices.size(); i += 3) {
      const Eigen::Vector3d a = corner(i), b = corner(i + 1), c = corner(i + 2);
      const double tet = a.dot(b.cross(c)) / 6;
      volume += tet;
      moment += tet * 0.25 * (a + b + c);
    }
  }
  return {.name = {}, .centre = moment / volume, .radius = std::cbrt(0.75 * volume / std::numbers::pi)};
}

}  // namespace stylet::author
