// From the patient to pixels: one or two eyes behind a window at the distance of what is looked at.
#pragma once

#include "engine/content/scene.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <span>
#include <vector>

namespace stylet::render {

struct StereoSettings {
  /// Distance between the eyes, m. 0.063 is life size; the view is close, so a smaller one is easier on the eyes.
  double eye_separation = 0.063;
  /// Distance at which both eyes see a point at the same pixel; 0: where the camera looks. Infinity: parallel axes.
  double convergence = 0;
};

/// One eye. Clip space: +x right, +y up (drawn with a negative viewport height), reversed infinite depth near / z.
struct Eye {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< patient frame, m
  Eigen::Matrix4d clip_from_patient = Eigen::Matrix4d::Identity();
};

inline constexpr double kNearPlane = 0.01;  ///< m

/// An eye as a headset reports it: a pose and an asymmetric field of view (OpenXR's XrView).
struct EyeView {
  Eigen::Isometry3d patient_from_eye = Eigen::Isometry3d::Identity();  ///< the eye looks along -z, +x right, +y up
  /// Angles of the picture's edges off the axis, rad; to the left and downwards they are negative. left < right,
  /// down < up, all within a right angle.
  double left = -0.5;
  double right = 0.5;
  double up = 0.5;
  double down = -0.5;
};

Eye eye_of(const EyeView& view);

/// A camera between the eyes that looks as they do on average; `distance` ahead is what it looks at, m. Its field of
/// view is the first eye's.
content::Camera camera_between(std::span<const EyeView> eyes, double distance);

/// The eyes of a camera: one, or left and right. Their axes stay parallel and the frusta are sheared (off-axis), so a
/// point at depth z has the disparity x_left - x_right = f b (1/z - 1/convergence), f in pixels, b the separation.
/// @param aspect  width / height
std::vector<Eye> eyes_of(const content::Camera& camera, double aspect, int views, const StereoSettings& stereo);

/// Pixel (x right, y down, from the corner of the first pixel) of a point, and its depth along the axis, m.
/// Behind the eye the depth is negative and the pixel means nothing.
Eigen::Vector3d project(const Eye& eye, const Eigen::Vector3d& point, int width, int height);

}  // namespace stylet::render
