#include "engine/desktop/screen_move.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace stylet::desktop {
namespace {

constexpr double kNearest = 0.02;  // m before the camera; nearer or behind it nothing is seen

/// Motion at `point` -> the same on the screen, right and up, in metres as they look there.
Eigen::Matrix<double, 2, 3> screen_from_motion(const content::Camera& camera, const Eigen::Vector3d& point) {
  const Eigen::Vector3d ahead = (camera.look_at - camera.eye).normalized();
  const Eigen::Vector3d right = ahead.cross(camera.up).normalized();
  const Eigen::Vector3d up = right.cross(ahead);
  const Eigen::Vector3d from = point - camera.eye;
  // What comes towards the camera goes away from the middle of the picture.
  const double distance = ahead.dot(from);
  Eigen::Vector2d aside = Eigen::Vector2d::Zero();
  if (distance > kNearest) aside = Eigen::Vector2d(right.dot(from), up.dot(from)) / distance;
  Eigen::Matrix<double, 2, 3> screen;
  screen << (right - aside.x() * ahead).transpose(), (up - aside.y() * ahead).transpose();
  return screen;
}

}  // namespace

haptic::NeedleMove as_on_screen(const haptic::NeedleMove& asked, const haptic::NeedleMotion& motion,
                                const content::Camera& camera) {
  haptic::NeedleMove move = asked;
  if (const Eigen::Vector2d wanted(asked.right_m, asked.up_m); !wanted.isZero(0)) {
    Eigen::Matrix3d parts;
    parts << motion.right, motion.up, motion.advance;
    const Eigen::Matrix<double, 2, 3> screen = screen_from_motion(camera, motion.middle) * parts;
    // The least motion that looks as wanted, where a metre of advance counts as 2 kFastest metres sideways: sideways
    // motion seen at an angle with sine s is then s / (s^2 + (1 - s^2) / (2 kFastest)^2) times as fast, kFastest at
    // most.
    const Eigen::Vector3d ease(1, 1, 1 / (4 * kFastest * kFastest));
    const Eigen::Matrix2d across = screen * ease.asDiagonal() * screen.transpose();
    const Eigen::Vector3d solved = ease.asDiagonal() * screen.transpose() * across.inverse() * wanted;
    move.right_m = solved[0];
    move.up_m = solved[1];
    move.advance_m += solved[2];
  }
  if (const Eigen::Vector2d wanted(asked.tilt_right_rad, asked.tilt_up_rad); !wanted.isZero(0)) {
    Eigen::Matrix<double, 3, 2> parts;
    parts << motion.tilt_right, motion.tilt_up;
    const double arm = motion.tilt_right.norm();
    const Eigen::Matrix2d screen = screen_from_motion(camera, motion.hub) * parts;
    // By the adjugate: where the screen shows no tilt that way, there is none.
    Eigen::Matrix2d adjugate;
    adjugate << screen(1, 1), -screen(0, 1), -screen(1, 0), screen(0, 0);
    const double determinant = screen.determinant();
    Eigen::Vector2d solved = (determinant < 0 ? -arm : arm) * (adjugate * wanted);
    const double most = kFastest * wanted.norm() * std::abs(determinant);
    const double length = solved.norm();
    const double scale =
        length > most ? kFastest * wanted.norm() / length : 1 / std::max(std::abs(determinant), 1e-12);
    solved *= length > 0 ? scale : 0;
    move.tilt_right_rad = solved[0];
    move.tilt_up_rad = solved[1];
  }
  return move;
}

}  // namespace stylet::desktop
