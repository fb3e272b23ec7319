#include "engine/view/orbit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::view {

content::Camera orbited(const content::Camera& camera, double yaw, double pitch, double zoom) {
  const Eigen::Vector3d up = camera.up.normalized();
  const Eigen::Vector3d arm = camera.eye - camera.look_at;
  const double distance = std::max(arm.norm(), 1e-6);
  constexpr double kPole = std::numbers::pi / 2 - 5 * std::numbers::pi / 180;
  const double elevation = std::asin(std::clamp(arm.dot(up) / distance, -1.0, 1.0));
  const double new_elevation = std::clamp(elevation + pitch, -kPole, kPole);
  Eigen::Vector3d level = arm - arm.dot(up) * up;
  level = level.norm() < 1e-9 ? up.unitOrthogonal() : Eigen::Vector3d(level.normalized());
  level = Eigen::AngleAxisd(yaw, up) * level;
  content::Camera turned = camera;
  turned.eye = camera.look_at + std::clamp(distance * zoom, 0.05, 5.0) *
                                    (std::cos(new_elevation) * level + std::sin(new_elevation) * up);
  return turned;
}

content::Camera after(const CameraCommand& command, const content::Camera& camera, const content::Camera& home) {
  const Orbit* orbit = std::get_if<Orbit>(&command);
  return orbit != nullptr ? orbited(camera, orbit->yaw, orbit->pitch, orbit->zoom) : home;
}

}  // namespace stylet::view
