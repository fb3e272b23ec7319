// What is nearest on a body's surface: as every face says, and whatever face it was a step ago.
#include "physics/contact/body_surface.h"

#include "physics/tissue/tissue_model.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace stylet::physics {
namespace {

using Eigen::Vector3d;

TEST(BodySurface, FindsWhatIsNearestOfAllFacesAndTheSameFromWhereverItBegins) {
  const TetMesh mesh = reference::kuhn_box({0, 0, 0}, {0.06, 0.05, 0.04}, {6, 5, 4});
  const std::vector<ElasticMaterial> materials(mesh.tets.size(), {5000, 0.45});
  const TissueModel model(mesh, materials,
                          reference::nodes_where(mesh, [](const Vector3d& p) { return p.z() == 0; }));
  BodySurface surface(model);
  Eigen::Matrix3Xd x = rest_positions(model);
  for (Eigen::Index n = 0; n < x.cols(); ++n) x(2, n) += 0.006 * std::sin(150 * x(0, n)) * std::cos(90 * x(1, n));
  surface.update(x);

  std::mt19937 engine(5);
  std::uniform_real_distribution<double> within(-0.01, 0.07), turn(-1, 1);
  std::uniform_int_distribution<int> any_face(0, surface.face_count() - 1);
  constexpr double kRange = 0.012;
  int found = 0, none = 0;
  for (int i = 0; i < 2000; ++i) {
    Vector3d at(within(engine), within(engine), within(engine));
    if (i % 4 == 0) {  // on it, as what rests there is: at a corner, or within rounding of one
      at = x.col(surface.face(any_face(engine))[0]);
      if (i % 8 == 0) at += 1e-17 * Vector3d(turn(engine), turn(engine), turn(engine));
    }
    const Vector3d facing(turn(engine), turn(engine), turn(engine));
    double least = kRange * kRange;
    bool there = false;
    for (int f = 0; f < surface.face_count(); ++f) {
      const auto& [a, b, c] = surface.face(f);
      const Vector3d p = x.col(a), q = x.col(b), r = x.col(c);
      if ((q - p).cross(r - p).dot(facing) >= 0) continue;
      const Vector3d w = closest_weights(at, p, q, r);
      const double squared = (w[0] * p + w[1] * q + w[2] * r - at).squaredNorm();
      there = there || squared <= least;
      least = std::min(least, squared);
    }
    const SurfacePoint point = surface.closest(at, facing, kRange);
    ASSERT_EQ(point.face >= 0, there);
    ++(there ? found : none);
    if (there) {
      EXPECT_NEAR(point.distance, std::sqrt(least), 1e-15);
      EXPECT_NEAR((point.position - at).norm(), point.distance, 1e-15);
    }
    for (int k = 0; k < 10; ++k) {
      const int near = k == 0 ? std::max(point.face, 0) : any_face(engine);
      const SurfacePoint again = surface.closest(at, facing, kRange, near);
      ASSERT_EQ(again.face, point.face) << "from face " << near;
      EXPECT_EQ(again.position, point.position);
      EXPECT_EQ(again.weights, point.weights);
      EXPECT_EQ(again.on_crease, point.on_crease);
    }
  }
  EXPECT_GT(found, 300);
  EXPECT_GT(none, 300);
}

}  // namespace
}  // namespace stylet::physics
