#include "engine/tracking/tracked_transforms.h"

namespace stylet::tracking {
namespace {

constexpr double kMm = 1000;  // a metre

}  // namespace

Eigen::Matrix3d ras_from_patient() {
  // Patient: +X left, +Y superior, +Z anterior.
  Eigen::Matrix3d axes;
  axes << -1, 0, 0, 0, 0, 1, 0, 1, 0;
  return axes;
}

Eigen::Matrix4d ras_pose(const Eigen::Vector3f& position, const Eigen::Quaternionf& orientation) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = ras_from_patient() * orientation.cast<double>().normalized().toRotationMatrix();
  matrix.topRightCorner<3, 1>() = kMm * (ras_from_patient() * position.cast<double>());
  return matrix;
}

Eigen::Matrix4d image_to_probe(const ultrasound::SectorGeometry& image) {
  const double pixel = kMm * image.metres_per_pixel;
  const Eigen::Vector2d first = kMm * image.position({0, 0});
  Eigen::Matrix4d matrix;
  matrix << pixel, 0, 0, first.x(),  //
      0, 0, -pixel, 0,               //
      0, pixel, 0, first.y(),        //
      0, 0, 0, 1;
  return matrix;
}

std::vector<NamedTransform> tracked_transforms(const state::FrameState& state,
                                               const ultrasound::SectorGeometry& image) {
  std::vector<NamedTransform> transforms{{"ImageToProbe", image_to_probe(image)},
                                         {"ProbeToTracker", ras_pose(state.probe_position, state.probe_orientation)}};
  if (!state.needle_positions.empty()) {
    transforms.push_back(
        {"NeedleToTracker", ras_pose(state.needle_positions.front(), state.needle_orientations.front())});
    transforms.push_back(
        {"NeedleTipToTracker", ras_pose(state.needle_positions.back(), state.needle_orientations.back())});
  }
  for (std::size_t t = 0; t < state.targets.size(); ++t) {
    const std::string number = t == 0 ? "" : std::to_string(t + 1);
    transforms.push_back(
        {"Target" + number + "ToTracker", ras_pose(state.targets[t].centre, Eigen::Quaternionf::Identity())});
  }
  return transforms;
}

}  // namespace stylet::tracking
