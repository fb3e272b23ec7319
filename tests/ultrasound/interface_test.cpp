// Interfaces lie on the surfaces that organs have, not on the voxels that those are filled with.
#include "engine/readers/label_volume.h"
#include "engine/ultrasound/reference_image.h"
#include "tests/gltf/glb.h"
#include "tests/ultrasound/phantom.h"
#include "tools/reference/image_metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

namespace stylet::ultrasound {
namespace {

constexpr double kTolerance = 0.2e-3;
constexpr double kVoxel = 1e-3;

/// A closed box, but for its top face, which is inclined: z = top + slope x.
mesh::TriangleMesh wedge(const Eigen::Vector3d& low, const Eigen::Vector3d& high, double slope) {
  mesh::TriangleMesh box;
  for (int i = 0; i < 8; ++i) {
    Eigen::Vector3d p((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                      (i & 4) != 0 ? high.z() : low.z());
    if ((i & 4) == 0) p.z() += slope * p.x();
    box.vertices.push_back(p);
  }
  box.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return box;
}

/// How far a picture's interface lies from the surface, m.
struct Residual {
  double rms = 0;
  double most = 0;
  double brightness_db = 0;  ///< of the echo along the surface, standard deviation
};

/// A solid in a block of liver under a linear probe, both without speckle.
class SeenSolid {
public:
  /// @param measured  the voxels know the surface's place
  SeenSolid(const mesh::TriangleMesh& solid, bool measured)
      : scene_(test::block_phantom([](const Eigen::Vector3f&) { return test::kBackground; })) {
    for (content::Tissue& tissue : scene_.tissues) tissue.acoustics.backscatter_db = -90;
    scene_.probe.convex = false;
    scene_.probe.width = 0.040;
    scene_.probe.scan_lines = 384;
    scene_.probe.samples = 640;
    scene_.probe.depth = 0.1;
    const mesh::TriangleMesh block = wedge({-0.041, -0.021, -0.012}, {0.041, 0.021, 0.105}, 0);
    const std::vector<readers::LabelledSolid> solids{{&block, test::kBackground, -1}, {&solid, test::kWall, -1}};
    scene_.labels = readers::voxelise(solids, kVoxel, std::nullopt, readers::LabelEdges::measured);
    if (!measured) scene_.labels.edges.clear();
    ImagerSettings settings{.width = 640, .height = 640, .planes = 1, .line_oversampling = 1, .noise_db = -200};
    settings.haze = settings.texture = false;
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {  // the roughness of an interface is random
      settings.seed = seed;
      ReferenceImager imager(scene_, settings);
      imager.image(test::at_rest(scene_));
      scan_ = imager.scan();
      power_.resize(imager.envelope().size());
      for (std::size_t i = 0; i < power_.size(); ++i) power_[i] += std::pow(double(imager.envelope()[i]), 2);
      labels_ = imager.label_map();
      picture_ = imager.geometry();
    }
  }

  /// Of the echo's middle on each line where the beam meets the surface within 20 degrees.
  /// @param distance  of a point (x, z) from the surface, positive behind it
  Residual echo(const std::function<double(const Eigen::Vector2d&)>& distance) const {
    Residual result;
    double sum_db = 0, sum_db2 = 0;
    int lines = 0;
    for (int l = 4; l < scan_.lines - 4; ++l) {
      int at = -1;
      for (int s = 8; s < scan_.samples && at < 0; ++s) {
        if (distance(scan_.position(l, s)) > 0) at = s;
      }
      if (at < 0) continue;
      const Eigen::Vector2d beam = scan_.direction(l);
      const Eigen::Vector2d surface = scan_.position(l, at);
      const double facing = (distance(surface + 1e-5 * beam) - distance(surface - 1e-5 * beam)) / 2e-5;
      if (facing < std::cos(20 * EIGEN_PI / 180)) continue;
      const int window = static_cast<int>(2e-3 / scan_.sample_pitch);
      double power = 0, moment = 0;
      for (int s = at - window; s <= at + window; ++s) {
        const double p = power_[static_cast<std::size_t>(s) * scan_.lines + l];
        power += p;
        moment += p * s;
      }
      const double off = distance(scan_.position(l, moment / power));
      result.most = std::max(result.most, std::abs(off));
      result.rms += off * off;
      const double db = reference::decibels(power);
      sum_db += db;
      sum_db2 += db * db;
      ++lines;
    }
    EXPECT_GT(lines, 60);
    result.rms = std::sqrt(result.rms / lines);
    result.brightness_db = std::sqrt(std::max(sum_db2 / lines - std::pow(sum_db / lines, 2), 0.0));
    return result;
  }

  /// Of the pixels on the wrong side, all round.
  Residual labels(const std::function<double(const Eigen::Vector2d&)>& distance) const {
    Residual result;
    int near = 0;
    for (int v = 0; v < picture_.height; ++v) {
      for (int u = 0; u < picture_.width; ++u) {
        const int label = labels_[static_cast<std::size_t>(v) * picture_.width + u];
        if (label != test::kBackground && label != test::kWall) continue;
        const Eigen::Vector2d p = picture_.position({u, v});
        const double off = distance(p);
        if (std::abs(p.x()) > 0.018 || p.y() > 0.095 || std::abs(off) > 1e-3) continue;
        ++near;
        if ((off > 0) == (label == test::kWall)) continue;
        result.most = std::max(result.most, std::abs(off));
        result.rms += off * off;
      }
    }
    EXPECT_GT(near, 1000);
    result.rms = std::sqrt(result.rms / near);
    return result;
  }

private:
  content::Scene scene_;
  ScanGeometry scan_;
  SectorGeometry picture_;
  std::vector<double> power_;  ///< [sample][line]
  std::vector<std::uint8_t> labels_;
};

void expect_smooth(const char* name, const mesh::TriangleMesh& solid,
                   const std::function<double(const Eigen::Vector2d&)>& distance) {
  SCOPED_TRACE(name);
  const SeenSolid stepped(solid, false), smooth(solid, true);
  const auto print = [name](const char* what, const Residual& before, const Residual& now) {
    std::printf("%s, %s: rms %.3f, at most %.3f mm, brightness +- %.1f dB; from voxels alone %.3f, %.3f, %.1f\n",
                name, what, 1e3 * now.rms, 1e3 * now.most, now.brightness_db, 1e3 * before.rms, 1e3 * before.most,
                before.brightness_db);
  };
  const Residual echo = smooth.echo(distance), stepped_echo = stepped.echo(distance);
  print("echo", stepped_echo, echo);
  EXPECT_LT(echo.most, kTolerance);
  EXPECT_LT(echo.rms, kTolerance / 2);
  EXPECT_GT(stepped_echo.most, kTolerance) << "steps would be seen";
  EXPECT_LT(echo.brightness_db, stepped_echo.brightness_db);
  const Residual labels = smooth.labels(distance), stepped_labels = stepped.labels(distance);
  print("labels", stepped_labels, labels);
  EXPECT_LT(labels.most, kTolerance);
  EXPECT_GT(stepped_labels.most, kTolerance);
}

TEST(Interface, EchoesLieOnASphereAndAnInclinedPlane) {
  const Eigen::Vector3d centre(0.0033, 0.0007, 0.0561);
  constexpr double kRadius = 0.0147;
  const double in_plane = std::sqrt(kRadius * kRadius - centre.y() * centre.y());
  expect_smooth("sphere", gltf::test::sphere(centre, kRadius, 48), [&](const Eigen::Vector2d& p) {
    return in_plane - (p - Eigen::Vector2d(centre.x(), centre.z())).norm();
  });
  constexpr double kSlope = 0.13, kTop = 0.0503;
  expect_smooth("plane", wedge({-0.04, -0.02, kTop}, {0.04, 0.02, 0.1}, kSlope),
                [&](const Eigen::Vector2d& p) { return (p.y() - kTop - kSlope * p.x()) / std::hypot(1, kSlope); });
}

}  // namespace
}  // namespace stylet::ultrasound
