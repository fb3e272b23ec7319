#include "engine/session/tracked_transforms.h"

namespace stylet::session {
namespace {

constexpr double kMm = 1000;  // a metre

/// Of a frame given in the patient frame, both in millimetres.
Eigen::Matrix4d to_tracker(const Eigen::Vector3f& position, const Eigen::Quaternionf& orientation) {
  // Patient: +X left, +Y superior, +Z anterior.
  Eigen::Matrix3d ras_from_patient;
  ras_from_patient << -1, 0, 0, 0, 0, 1, 0, 1, 0;
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = ras_from_patient * orientation.cast<double>().normalized().toRotationMatrix();
  matrix.topRightCorner<3, 1>() = kMm * (ras_from_patient * position.cast<double>());
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

}  // namespace

std::vector<NamedTransform> tracked_transforms(const state::FrameState& state,
                                               const ultrasound::SectorGeometry& image) {
  std::vector<NamedTransform> transforms{
      {"ImageToProbe", image_to_probe(image)},
      {"ProbeToTracker", to_tracker(state.probe_position, state.probe_orientation)}};
  if (!state.needle_positions.empty()) {
    transforms.push_back(
        {"NeedleToTracker", to_tracker(state.needle_positions.front(), state.needle_orientations.front())});
    transforms.push_back(
        {"NeedleTipToTracker", to_tracker(state.needle_positions.back(), state.needle_orientations.back())});
  }
  transforms.push_back({"TargetToTracker", to_tracker(state.target, Eigen::Quaternionf::Identity())});
  return transforms;
}

}  // namespace stylet::session
