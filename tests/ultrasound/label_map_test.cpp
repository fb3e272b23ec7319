// Label maps: what the picture shows is what they say, where the phantom put it; and the GPU says what the CPU says.
#include "engine/content/picture_labels.h"
#include "engine/gpu/device.h"
#include "engine/ultrasound/imager.h"
#include "engine/ultrasound/reference_image.h"
#include "tests/ultrasound/phantom.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace stylet::ultrasound {
namespace {

constexpr ImagerSettings kCystImage{.width = 320, .height = 240, .looks = 1};
const Eigen::Vector2d kCyst(0.015, 0.070);
constexpr double kRadius = 0.012;

content::Scene cyst_phantom(bool convex = true) {
  content::Scene scene = test::block_phantom([](const Eigen::Vector3f& p) {
    if (p.z() < 0) return test::kOutside;
    return std::hypot(p.x() - kCyst.x(), p.z() - kCyst.y()) < kRadius ? test::kFluid : test::kBackground;
  });
  scene.probe.convex = convex;
  scene.probe.scan_lines = 96;
  scene.probe.samples = 384;
  return scene;
}

/// Every pixel more than 1.5 mm (a voxel and half a line) off the edge of the cyst has the label it must have.
void expect_cyst(const std::vector<std::uint8_t>& labels, const ReferenceImager& imager,
                 const Eigen::Vector2d& centre, const std::function<Eigen::Vector2d(const Eigen::Vector2d&)>& to_rest,
                 double growth) {
  const SectorGeometry& picture = imager.geometry();
  int inside = 0;
  int wrong = 0;
  for (int v = 0; v < picture.height; ++v) {
    for (int u = 0; u < picture.width; ++u) {
      const int label = labels[static_cast<std::size_t>(v) * picture.width + u];
      const Eigen::Vector2d p = picture.position({u, v});
      if ((p - centre).norm() > 0.03) continue;
      const double from_edge = (to_rest(p) - kCyst).norm() - kRadius;
      if (std::abs(from_edge) < 1.5e-3) continue;
      inside += from_edge < 0 ? 1 : 0;
      wrong += label != (from_edge < 0 ? test::kFluid : test::kBackground) ? 1 : 0;
    }
  }
  const double area = growth * std::numbers::pi * std::pow((kRadius - 1.5e-3) / picture.metres_per_pixel, 2);
  EXPECT_NEAR(inside, area, 0.05 * area);
  EXPECT_EQ(wrong, 0);
}

TEST(LabelMap, ACystHasItsLabelWhereItIs) {
  const content::Scene scene = cyst_phantom();
  ReferenceImager imager(scene, kCystImage);
  imager.image(test::at_rest(scene));
  const std::vector<std::uint8_t> labels = imager.label_map();
  expect_cyst(
      labels, imager, kCyst, [](const Eigen::Vector2d& p) { return p; }, 1);
  EXPECT_EQ(labels.front(), 0) << "the corner of the picture lies outside the sector";
}

TEST(LabelMap, ACystInADeformedBlockHasItsLabelWhereItHasGone) {
  content::Scene scene = cyst_phantom();
  test::make_deformable(scene, 6);
  state::FrameState state = test::at_rest(scene);
  // A shear and a squeeze: linear, so that tetrahedra carry it exactly.
  const auto deformed = [](const Eigen::Vector2d& p) { return Eigen::Vector2d(p.x() - 0.3 * p.y(), 0.95 * p.y()); };
  for (Eigen::Vector3f& p : state.bodies[0]) {
    const Eigen::Vector2d xz = deformed({p.x(), p.z()});
    p = {float(xz.x()), p.y(), float(xz.y())};
  }
  ReferenceImager imager(scene, kCystImage);
  imager.image(state);
  const auto to_rest = [](const Eigen::Vector2d& p) {
    return Eigen::Vector2d(p.x() + 0.3 * p.y() / 0.95, p.y() / 0.95);
  };
  expect_cyst(imager.label_map(), imager, deformed(kCyst), to_rest, 0.95);
}

/// Of a straight needle through the image plane, shifted out of it by y (m).
struct SeenShaft {
  int pixels = 0;
  double farthest = 0;  ///< from its axis, m
  double pixel = 0;     ///< m
};
constexpr double kShaft[4] = {-0.040, 0.024, 0.013, 0.061};  // x, z of hub and tip: no direction of the pixels

SeenShaft seen_shaft(float y) {
  static const content::Scene scene = cyst_phantom();
  static ReferenceImager imager(scene, kCystImage);
  state::FrameState state = test::at_rest(scene);
  test::place_needle(state, {float(kShaft[0]), y, float(kShaft[1])}, {float(kShaft[2]), y, float(kShaft[3])});
  imager.image(state);
  const std::vector<std::uint8_t> labels = imager.label_map();
  const int needle = content::PictureLabels(scene).needle;
  const Eigen::Vector2d along = Eigen::Vector2d(kShaft[2] - kShaft[0], kShaft[3] - kShaft[1]).normalized();
  SeenShaft seen{.pixel = imager.geometry().metres_per_pixel};
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] != needle) continue;
    ++seen.pixels;
    const std::size_t row = i / kCystImage.width;
    const std::size_t column = i % kCystImage.width;
    const Eigen::Vector2d p = imager.geometry().position({double(column), double(row)});
    const Eigen::Vector2d d = p - Eigen::Vector2d(kShaft[0], kShaft[1]);
    seen.farthest = std::max(seen.farthest, std::abs(d.x() * along.y() - d.y() * along.x()));
  }
  return seen;
}

TEST(LabelMap, TheShaftIsLabelledWhereItIsInTheSlice) {
  const SeenShaft in_plane = seen_shaft(0);
  const double radius = std::max(0.5 * content::Needle().outer_diameter, 0.75 * in_plane.pixel);
  const double length = std::hypot(kShaft[2] - kShaft[0], kShaft[3] - kShaft[1]);
  EXPECT_LE(in_plane.farthest, radius + 1e-6);
  EXPECT_NEAR(in_plane.pixels * in_plane.pixel * in_plane.pixel, 2 * radius * length, 0.08 * 2 * radius * length);
  // At 1.2 mm from the plane of a slice of 3 mm it is still there, thinner; at 3 mm gone.
  EXPECT_GT(seen_shaft(0.0012F).pixels, 0);
  EXPECT_LT(seen_shaft(0.0012F).pixels, 0.9 * in_plane.pixels);
  EXPECT_EQ(seen_shaft(0.003F).pixels, 0);
}

TEST(LabelMap, NamesEveryIndexItUses) {
  const content::Scene scene = cyst_phantom();
  ReferenceImager imager(scene, kCystImage);
  state::FrameState state = test::at_rest(scene);
  test::place_needle(state, {-0.04F, 0, 0.02F}, {0.01F, 0, 0.07F});
  imager.image(state);
  const content::PictureLabels legend(scene);
  std::vector<int> found(legend.names.size(), 0);
  for (const std::uint8_t label : imager.label_map()) ++found.at(label);
  for (const int label : {0, int(test::kFluid), int(test::kBackground), legend.outside, legend.needle}) {
    EXPECT_GT(found[label], 0) << legend.names[label];
  }
  EXPECT_EQ(found[test::kBone] + found[legend.probe] + found[legend.gap], 0);
}

TEST(LabelMap, OnTheGpuIsThatOfTheReference) {
  gpu::Device device;
  for (const bool convex : {true, false}) {
    SCOPED_TRACE(convex);
    content::Scene scene = cyst_phantom(convex);
    for (std::size_t i = 0; i < scene.labels.labels.size(); ++i) {
      if (i % 7 == 0 && scene.labels.labels[i] == test::kBackground) scene.labels.labels[i] = test::kDark;
    }
    test::make_deformable(scene, 4);
    state::FrameState state = test::tour_state(scene);
    for (Eigen::Vector3f& p : state.bodies[0]) p.x() += 0.004F * std::sin(40 * p.z());
    ReferenceImager reference(scene, kCystImage);
    reference.image(state);
    const std::vector<std::uint8_t> expected = reference.label_map();
    Imager imager(device, scene, kCystImage);
    imager.image(state);
    const std::vector<std::uint8_t> actual = imager.read_label_map();
    ASSERT_EQ(actual.size(), expected.size());
    // The rounding of atan and of positions decides between two voxels or samples here and there: one in a thousand.
    std::size_t different = 0;
    for (std::size_t i = 0; i < actual.size(); ++i) different += actual[i] != expected[i] ? 1 : 0;
    EXPECT_LE(different, actual.size() / 1000);
    EXPECT_EQ(imager.read_label_map(), actual) << "asked again";
  }
}

}  // namespace
}  // namespace stylet::ultrasound
