#include "engine/desktop/framing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace stylet::desktop {
namespace {

constexpr std::array kDistances{1.0, 1.15, 1.3, 1.5, 1.75, 2.0, 2.4, 2.9};  // of the camera, times as far
constexpr int kSteps = 12;                                                  // each way, that the picture is moved by
constexpr double kReach = 0.48;                                             // of the window, by the last of them
constexpr int kBetween = 8;       // points of the needle looked at between two given ones
constexpr double kClear = 0.015;  // of the window's height, between needle and panel

struct Axes {
  Eigen::Vector3d right, up, ahead;
};

Axes axes_of(const content::Camera& camera) {
  const Eigen::Vector3d ahead = (camera.look_at - camera.eye).normalized();
  const Eigen::Vector3d right = ahead.cross(camera.up).normalized();
  return {right, right.cross(ahead), ahead};
}

/// Pixels of a thing 1 m wide, 1 m away.
double focal_length(const content::Camera& camera, int height) {
  return height / 2.0 / std::tan(camera.vertical_fov / 2);
}

bool hides(const picture::Pane& pane, const Eigen::Vector2d& at, double clear) {
  return pane.width > 0 && at.x() > pane.x - clear && at.x() < pane.x + pane.width + clear &&
         at.y() > pane.y - clear && at.y() < pane.y + pane.height + clear;
}

}  // namespace

Eigen::Vector2d projected(const content::Camera& camera, const Eigen::Vector3d& point, int width, int height,
                          double* depth) {
  const Axes axes = axes_of(camera);
  const Eigen::Vector3d from = point - camera.eye;
  const double ahead = std::max(axes.ahead.dot(from), 1e-3), focal = focal_length(camera, height);
  if (depth != nullptr) *depth = ahead;
  return {width / 2.0 + focal * axes.right.dot(from) / ahead, height / 2.0 - focal * axes.up.dot(from) / ahead};
}

content::Camera framed(const content::Camera& camera, std::span<const Eigen::Vector3f> needle, const Layout& layout,
                       int width, int height) {
  std::vector<Eigen::Vector3d> points{camera.look_at};
  for (std::size_t i = 1; i < needle.size(); ++i) {
    for (int k = 0; k <= kBetween; ++k) {
      const float share = static_cast<float>(k) / kBetween;
      points.push_back(((1 - share) * needle[i - 1] + share * needle[i]).cast<double>());
    }
  }
  const Axes axes = axes_of(camera);
  const double clear = kClear * height;
  const auto hidden = [&](const content::Camera& tried) {
    return std::ranges::count_if(points, [&](const Eigen::Vector3d& point) {
      const Eigen::Vector2d at = projected(tried, point, width, height);
      const bool inside = at.x() > clear && at.x() < width - clear && at.y() > clear && at.y() < height - clear;
      const auto behind = [&](const picture::Pane& pane) { return hides(pane, at, clear); };
      return !inside || behind(layout.course) || behind(layout.force) || behind(layout.ultrasound) ||
             behind(layout.scanner) || behind(layout.instructor);
    });
  };
  content::Camera best = camera;
  auto least = std::numeric_limits<std::ptrdiff_t>::max();
  for (const double times : kDistances) {
    double nearest = std::numeric_limits<double>::infinity();
    content::Camera back = camera;
    back.eye = camera.look_at + times * (camera.eye - camera.look_at);
    // Metres at the place looked at that the window is high.
    const double high = height * (back.look_at - back.eye).norm() / focal_length(back, height);
    const double wide = high * width / height;
    for (int i = -kSteps; i <= kSteps; ++i) {
      for (int k = -kSteps; k <= kSteps; ++k) {
        const double x = kReach * wide * i / kSteps, y = kReach * high * k / kSteps;
        const double moved = std::hypot(x, y);
        content::Camera tried = back;
        tried.eye += x * axes.right + y * axes.up;
        tried.look_at += x * axes.right + y * axes.up;
        const auto count = hidden(tried);
        if (count > least || (count == least && moved >= nearest)) continue;
        best = tried;
        least = count;
        nearest = moved;
      }
    }
    if (least == 0) return best;
  }
  return best;
}

}  // namespace stylet::desktop
