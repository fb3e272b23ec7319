// What lies under the pointer of a 3-D view. Pure.
//
// Patient frame at rest, metres.
#pragma once

#include "engine/content/scene.h"

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace stylet::author {

struct Ray {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d along = Eigen::Vector3d::UnitZ();  ///< unit
  Eigen::Vector3d at(double distance) const { return from + distance * along; }
};

/// Through a pixel of a window (from its upper left corner) that shows the camera's picture.
Ray ray_through(const content::Camera& camera, double x, double y, int width, int height);

/// A stretch of a ray inside a surface; of an open surface, or where the ray ends inside, from and to are the same.
struct Chord {
  std::size_t surface = 0;  ///< index into Scene::surfaces
  double from = 0;          ///< m from the ray's start
  double to = 0;
};

/// All of them, nearest first, in front of the ray's start. O(triangles).
std::vector<Chord> chords(const content::Scene& scene, const Ray& ray);

struct SkinPoint {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< outwards, unit, of the skin within 12 mm
};

/// Where the ray comes from outside into the patient, as the labels have it: to a quarter of a voxel.
std::optional<SkinPoint> skin_under(const content::LabelVolume& labels, const Ray& ray);

/// Where the needle of a motion comes through the skin: its first pose, straight on. Nothing: it misses the patient.
std::optional<SkinPoint> entry_of(const content::Motion& motion, double needle_length,
                                  const content::LabelVolume& labels);

/// Whether the labels have tissue at a point.
bool inside_patient(const content::LabelVolume& labels, const Eigen::Vector3d& point);

/// Centre of volume and radius of the ball of the same volume of closed surfaces.
content::Target target_of(const content::Scene& scene, std::span<const std::size_t> surfaces);

}  // namespace stylet::author
