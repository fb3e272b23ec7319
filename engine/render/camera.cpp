#include "engine/render/camera.h"

#include <Eigen/Geometry>

#include <cmath>

namespace stylet::render {

std::vector<Eye> eyes_of(const content::Camera& camera, double aspect, int views, const StereoSettings& stereo) {
  const Eigen::Vector3d towards = camera.look_at - camera.eye;
  const double distance = std::max(towards.norm(), 1e-6);
  const Eigen::Vector3d forward = towards / distance;
  Eigen::Vector3d right = forward.cross(camera.up);
  if (right.norm() < 1e-9) right = forward.unitOrthogonal();  // looking along `up`: any right will do
  right.normalize();
  const Eigen::Vector3d up = right.cross(forward);

  const double convergence = stereo.convergence > 0 ? stereo.convergence : distance;
  const double scale_y = 1.0 / std::tan(camera.vertical_fov / 2);
  const double scale_x = scale_y / aspect;

  std::vector<Eye> eyes;
  for (int view = 0; view < views; ++view) {
    const double offset = views == 1 ? 0.0 : (view == 0 ? -0.5 : 0.5) * stereo.eye_separation;
    Eye eye;
    eye.position = camera.eye + offset * right;
    Eigen::Matrix4d view_from_patient = Eigen::Matrix4d::Identity();  // x right, y up, z forward
    view_from_patient.block<1, 3>(0, 0) = right.transpose();
    view_from_patient.block<1, 3>(1, 0) = up.transpose();
    view_from_patient.block<1, 3>(2, 0) = forward.transpose();
    view_from_patient.block<3, 1>(0, 3) = -view_from_patient.block<3, 3>(0, 0) * eye.position;
    Eigen::Matrix4d clip_from_view = Eigen::Matrix4d::Zero();
    clip_from_view(0, 0) = scale_x;
    clip_from_view(0, 2) = scale_x * offset / convergence;  // shear: zero disparity at `convergence`
    clip_from_view(1, 1) = scale_y;
    clip_from_view(2, 3) = kNearPlane;
    clip_from_view(3, 2) = 1;
    eye.clip_from_patient = clip_from_view * view_from_patient;
    eyes.push_back(eye);
  }
  return eyes;
}

Eye eye_of(const EyeView& view) {
  const double left = std::tan(view.left), right = std::tan(view.right);
  const double up = std::tan(view.up), down = std::tan(view.down);
  Eigen::Matrix4d clip_from_eye = Eigen::Matrix4d::Zero();
  clip_from_eye(0, 0) = 2 / (right - left);
  clip_from_eye(0, 2) = (right + left) / (right - left);
  clip_from_eye(1, 1) = 2 / (up - down);
  clip_from_eye(1, 2) = (up + down) / (up - down);
  clip_from_eye(2, 3) = kNearPlane;
  clip_from_eye(3, 2) = -1;
  return {view.patient_from_eye.translation(), clip_from_eye * view.patient_from_eye.inverse().matrix()};
}

content::Camera camera_between(std::span<const EyeView> eyes, double distance) {
  content::Camera camera;
  Eigen::Vector3d back = Eigen::Vector3d::Zero();
  camera.up = Eigen::Vector3d::Zero();
  for (const EyeView& view : eyes) {
    camera.eye += view.patient_from_eye.translation() / static_cast<double>(eyes.size());
    back += view.patient_from_eye.linear().col(2);
    camera.up += view.patient_from_eye.linear().col(1);
  }
  camera.look_at = camera.eye - distance * back.normalized();
  camera.up.normalize();
  camera.vertical_fov = eyes.front().up - eyes.front().down;
  return camera;
}

Eigen::Vector3d project(const Eye& eye, const Eigen::Vector3d& point, int width, int height) {
  const Eigen::Vector4d clip = eye.clip_from_patient * point.homogeneous();
  return {(clip.x() / clip.w() + 1) / 2 * width, (1 - clip.y() / clip.w()) / 2 * height, clip.w()};
}

}  // namespace stylet::render
