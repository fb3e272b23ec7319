// The camera that a session starts with: the needle is seen, whatever the window's size.
#include "engine/desktop/framing.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace stylet::desktop {
namespace {

bool inside(const picture::Pane& pane, const Eigen::Vector2d& at) {
  return at.x() >= pane.x && at.x() <= pane.x + pane.width && at.y() >= pane.y && at.y() <= pane.y + pane.height;
}

/// Points of a needle of 150 mm with its tip above the middle, from all sides.
std::vector<Eigen::Vector3f> needle(double azimuth) {
  const Eigen::Vector3d tip(0.02 * std::cos(azimuth), 0.02 * std::sin(azimuth), 0.02);
  const Eigen::Vector3d axis = Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0.9).normalized();
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i <= 10; ++i) points.push_back((tip + 0.015 * i * axis).cast<float>());
  return points;
}

TEST(Framing, NoNeedleStartsBehindAPanel) {
  const content::Camera camera{.eye = {-0.3, -0.3, 0.3}, .up = {0, 0, 1}, .vertical_fov = 0.5};
  int hidden_before = 0;
  for (const auto& size : {std::pair{1024, 640}, {1280, 720}, {1920, 1080}, {3840, 2160}}) {
    const int width = size.first, height = size.second;
    const Layout layout = layout_of(width, height, 15 * text_scale(width, height, 1), {});
    for (int side = 0; side < 12; ++side) {
      const auto points = needle(side * 0.5236);
      const auto seen = [&](const content::Camera& from) {
        for (const Eigen::Vector3f& point : points) {
          const Eigen::Vector2d at = projected(from, point.cast<double>(), width, height);
          if (!inside({0, 0, width, height}, at) || inside(layout.course, at) || inside(layout.force, at) ||
              inside(layout.ultrasound, at)) {
            return false;
          }
        }
        return true;
      };
      hidden_before += seen(camera) ? 0 : 1;
      EXPECT_TRUE(seen(framed(camera, points, layout, width, height))) << width << " wide, side " << side;
    }
  }
  EXPECT_GT(hidden_before, 8) << "it takes the moving";
}

TEST(Framing, LeavesACameraThatSeesItAll) {
  const content::Camera camera{.eye = {-0.3, -0.3, 0.3}, .up = {0, 0, 1}, .vertical_fov = 0.5};
  const Layout none{};
  const std::vector<Eigen::Vector3f> points{Eigen::Vector3f(0, 0, 0.01F), Eigen::Vector3f(0, 0, 0.02F)};
  const content::Camera same = framed(camera, points, none, 1280, 720);
  EXPECT_TRUE(same.eye.isApprox(camera.eye));
  EXPECT_TRUE(same.look_at.isApprox(camera.look_at));
}

TEST(Framing, ProjectsWhatIsLookedAtToTheMiddle) {
  const content::Camera camera{.eye = {-0.3, 0.1, 0.3}, .up = {0, 0, 1}, .vertical_fov = 0.5};
  EXPECT_NEAR((projected(camera, camera.look_at, 1280, 720) - Eigen::Vector2d(640, 360)).norm(), 0, 1e-9);
  // Half the angle of view above it is the upper edge.
  const Eigen::Vector3d ahead = (camera.look_at - camera.eye).normalized();
  const Eigen::Vector3d up = ahead.cross(camera.up).normalized().cross(ahead);
  const Eigen::Vector3d edge = camera.eye + ahead + std::tan(0.25) * up;
  EXPECT_NEAR(projected(camera, edge, 1280, 720).y(), 0, 1e-9);
}

}  // namespace
}  // namespace stylet::desktop
