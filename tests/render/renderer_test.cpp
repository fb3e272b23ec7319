// The 3-D view: geometry where it should be, on any device; and how it looks, on lavapipe.
#include "engine/render/renderer.h"

#include "engine/content/picture_labels.h"
#include "engine/view/offscreen.h"
#include "tests/render/test_scene.h"
#include "tests/support/image_compare.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace stylet::render {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using picture::Picture;

struct Render3d : testing::Test {
  std::atomic<std::uint32_t> messages{0};
  gpu::Device device{{.validation = true, .message_counter = &messages}};
  content::Scene scene = tests::make_test_scene();

  /// Every test ends here: core and synchronisation validation had nothing to say.
  void TearDown() override { EXPECT_EQ(messages.load(), 0u); }

  Picture draw(Renderer& renderer, const state::FrameState& state, std::uint32_t layer = 0) {
    return view::read_picture(device, renderer.render(state, scene.camera), layer);
  }
  /// Nothing but one opaque ball of the colour green on a rigid or carried surface, no probe in sight.
  void leave_only_a_ball(const Vector3d& centre, double radius, int body);
};

void Render3d::leave_only_a_ball(const Vector3d& centre, double radius, int body) {
  // The tumour of the test scene is a ball of 11 mm: moved, scaled and painted.
  content::Surface ball = scene.surfaces.back();
  const Vector3d from = scene.targets.front().centre;
  for (auto& p : ball.positions) p = (centre + radius / 0.011 * (p.cast<double>() - from)).cast<float>();
  ball.body = body;
  if (body < 0) ball.embedding.clear();
  scene.tissues[4].colour = {0, 0.8F, 0, 1};
  scene.surfaces = {ball};
  scene.probe.pose.position = {0, 0, 10};  // behind the camera
}

/// Centroid of the pixels that `test` accepts; count in z.
Vector3d centroid(const Picture& picture, const std::function<bool(const std::uint8_t*)>& test) {
  Vector3d sum = Vector3d::Zero();
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x)
      if (test(picture.at(x, y))) sum += Vector3d(x + 0.5, y + 0.5, 1);
  if (sum.z() > 0) sum.head<2>() /= sum.z();
  return sum;
}
bool is_green(const std::uint8_t* p) {
  return p[1] > 50 && p[1] > p[0] + 30 && p[1] > p[2] + 30;
}

state::FrameState without_needle(state::FrameState state) {
  state.needle_positions.clear();
  state.needle_orientations.clear();
  return state;
}

TEST_F(Render3d, BallAppearsWhereTheCameraProjectsIt) {
  const Vector3d centre(0.03, -0.02, 0.05);
  leave_only_a_ball(centre, 0.006, -1);
  Renderer renderer(device, scene, {.width = 320, .height = 240, .room = false});
  const Picture picture = draw(renderer, without_needle(tests::rest_state(scene)));
  const Vector3d found = centroid(picture, is_green);
  // Oracle: similar triangles with the camera's own axes, no matrix of the renderer.
  const Vector3d forward = (scene.camera.look_at - scene.camera.eye).normalized();
  const Vector3d right = forward.cross(scene.camera.up).normalized(), up = right.cross(forward);
  const Vector3d d = centre - scene.camera.eye;
  const double focal = 120 / std::tan(scene.camera.vertical_fov / 2);
  EXPECT_GT(found.z(), 50);
  EXPECT_NEAR(found.x(), 160 + focal * d.dot(right) / d.dot(forward), 0.5);
  EXPECT_NEAR(found.y(), 120 - focal * d.dot(up) / d.dot(forward), 0.5);
  // And its size: a disc of the ball's angular radius.
  const double radius = focal * 0.006 / d.dot(forward);
  EXPECT_NEAR(found.z(), M_PI * radius * radius, M_PI * radius);  // half of the rim's pixels
}

TEST_F(Render3d, CarriedVerticesFollowTheNodes) {
  const Vector3d centre(0.012, 0.01, 0.014);
  leave_only_a_ball(centre, 0.006, 0);
  // embedding() of the scene belongs to the unmoved ball: place the ball where it was.
  scene = tests::make_test_scene();
  scene.tissues[4].colour = {0, 0.8F, 0, 1};
  scene.surfaces = {scene.surfaces.back()};
  const Vector3d rest_centre = scene.targets.front().centre;
  Renderer renderer(device, scene, {.width = 320, .height = 240, .room = false});
  state::FrameState state = without_needle(tests::rest_state(scene));
  state.probe_position = {0, 0, 10};
  // An affine motion is exact for linear tetrahedra: x' = A x + b, with a stretch, a shear and a rotation.
  Eigen::Matrix3d a = Eigen::AngleAxisd(0.4, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  a *= (Eigen::Matrix3d() << 1.1, 0.15, 0, 0, 0.95, 0, 0, 0.1, 1).finished();
  const Vector3d b(-0.03, 0.02, 0.01);
  for (auto& x : state.bodies[0]) x = (a * x.cast<double>() + b).cast<float>();
  const Vector3d found = centroid(draw(renderer, state), is_green);
  const Vector3d expected = project(renderer.eyes()[0], a * rest_centre + b, 320, 240);
  ASSERT_GT(found.z(), 50);
  EXPECT_NEAR(found.x(), expected.x(), 0.7);
  EXPECT_NEAR(found.y(), expected.y(), 0.7);
}

TEST_F(Render3d, WhatBreathesGoesWithTheBreath) {
  const Vector3d centre(0.03, -0.02, 0.05), breath(0.004, -0.015, 0.002);
  leave_only_a_ball(centre, 0.006, -1);
  state::FrameState state = without_needle(tests::rest_state(scene));
  state.breath = breath.cast<float>();
  for (const bool breathes : {false, true}) {
    scene.surfaces[0].breathes = breathes;
    Renderer renderer(device, scene, {.width = 320, .height = 240, .room = false});
    const Vector3d found = centroid(draw(renderer, state), is_green);
    const Vector3d moved = breathes ? Vector3d(centre + breath) : centre;
    const Vector3d expected = project(renderer.eyes()[0], moved, 320, 240);
    ASSERT_GT(found.z(), 50);
    EXPECT_NEAR(found.x(), expected.x(), 0.5) << breathes;
    EXPECT_NEAR(found.y(), expected.y(), 0.5) << breathes;
  }
}

TEST_F(Render3d, AblatedZoneIsSeenWarmWhereItsTissueHasGone) {
  scene.surfaces.clear();
  auto plan = std::make_shared<content::ProcedurePlan>();
  plan->destroys = true;
  scene.exercise.plan = plan;
  const auto zone = std::make_shared<content::HeatedZone>();
  zone->version = 1;
  zone->surface = tests::make_test_scene().surfaces.back();
  const Vector3d rest_centre = scene.targets.front().centre;
  Renderer renderer(device, scene, {.width = 320, .height = 240, .room = false});
  state::FrameState state = without_needle(tests::rest_state(scene));
  state.probe_position = {0, 0, 10};
  const auto show = [&](const std::shared_ptr<const content::HeatedZone>& shown) {
    state.zone = shown;
    return view::read_picture(device, renderer.render(state, scene.camera, {}));
  };
  const auto is_warm = [](const std::uint8_t* p) { return p[0] > 60 && p[0] > p[1] + 25 && p[1] > p[2] + 5; };
  const Picture without = show(nullptr);
  EXPECT_EQ(centroid(without, is_warm).z(), 0);
  for (auto& x : state.bodies[0]) x += Eigen::Vector3f(-0.03F, 0.02F, 0.01F);
  const Vector3d expected = project(renderer.eyes()[0], rest_centre + Vector3d(-0.03, 0.02, 0.01), 320, 240);
  const Vector3d found = centroid(show(zone), is_warm);
  ASSERT_GT(found.z(), 50);
  EXPECT_NEAR(found.x(), expected.x(), 1.0);
  EXPECT_NEAR(found.y(), expected.y(), 1.0);
  // Its surface is taken anew when the version is another one; no zone is none.
  zone->surface.indices.resize(zone->surface.indices.size() / 6 * 3);
  EXPECT_NEAR(centroid(show(zone), is_warm).z(), found.z(), 0);
  zone->version = 2;
  EXPECT_LT(centroid(show(zone), is_warm).z(), found.z() - 20);
  EXPECT_EQ(show(nullptr).rgba, without.rgba);
}

TEST_F(Render3d, CoresAreSeenWhereTheyLay) {
  scene.surfaces.clear();
  Renderer renderer(device, scene, {.width = 320, .height = 240, .room = false});
  state::FrameState state = without_needle(tests::rest_state(scene));
  state.probe_position = {0, 0, 10};
  const Picture without = draw(renderer, state);
  const Vector3d from(0.01, -0.02, 0.03), to(0.03, 0.01, 0.05);
  state.cores = {{.from = from.cast<float>(), .to = to.cast<float>(), .radius = 0.002F}, {}};
  const Picture with = draw(renderer, state);
  Vector3d sum = Vector3d::Zero();
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x)
      if (std::abs(with.at(x, y)[0] - without.at(x, y)[0]) > 20) sum += Vector3d(x + 0.5, y + 0.5, 1);
  ASSERT_GT(sum.z(), 30);
  const Vector3d middle = project(renderer.eyes()[0], 0.5 * (from + to), 320, 240);
  EXPECT_NEAR(sum.x() / sum.z(), middle.x(), 1.0);
  EXPECT_NEAR(sum.y() / sum.z(), middle.y(), 1.0);
  state.cores.clear();
  EXPECT_EQ(draw(renderer, state).rgba, without.rgba);
}

/// Fired at 5 s. @param size  of throw and notch, over 22 and 17 mm
state::FrameState fired(state::FrameState state, float size = 1) {
  state.probe_position = {0, 0, 10};
  state.cores = {{.to = {0, 0, 0.017F * size}, .fired_s = 5, .throw_length = 0.022F * size}};
  return state;
}

TEST_F(Render3d, AFiredNeedleIsSeenAheadOfItsTipWhileItIsOut) {
  scene.surfaces.clear();
  Renderer renderer(device, scene, {.width = 640, .height = 480, .room = false});
  state::FrameState state = fired(tests::rest_state(scene));
  const auto at = [&](double time_s) {
    state.time_s = time_s;
    return draw(renderer, state);
  };
  const int needle = content::PictureLabels(scene).needle;
  const auto labelled = [&] { return std::ranges::count(renderer.read_labels(0).labels, needle); };
  const Picture before = at(4.9);
  const auto shaft = labelled();
  const Vector3d tip = state.needle_positions.back().cast<double>();
  const Vector3d ahead = (state.needle_orientations.back() * Eigen::Vector3f::UnitZ()).cast<double>();
  const Vector2d from = project(renderer.eyes()[0], tip, 640, 480).head<2>();
  const Vector2d along = project(renderer.eyes()[0], tip + 0.022 * ahead, 640, 480).head<2>() - from;
  ASSERT_GT(along.norm(), 20) << "pixels";
  // How far ahead of the tip something has changed, of the throw.
  const auto reach = [&](const Picture& now) {
    double share = 0;
    for (int y = 0; y < 480; ++y)
      for (int x = 0; x < 640; ++x)
        if (std::abs(now.at(x, y)[0] - before.at(x, y)[0]) > 30)
          share = std::max(share, (Vector2d(x + 0.5, y + 0.5) - from).dot(along) / along.squaredNorm());
    return share;
  };
  EXPECT_NEAR(reach(at(5.02)), 0.25, 0.12) << "half way in time";
  EXPECT_NEAR(reach(at(5.1)), 1, 0.12);
  EXPECT_GT(labelled(), shaft + 10);
  EXPECT_NEAR(reach(at(5.5)), 1, 0.12);
  EXPECT_EQ(at(6).rgba, before.rgba) << "drawn back";
  EXPECT_EQ(labelled(), shaft);
}

TEST_F(Render3d, AFiredNeedleIsSeenInAnOpaqueTarget) {
  scene.surfaces = {scene.surfaces.back()};
  ASSERT_EQ(scene.surfaces[0].role, content::SurfaceRole::target);
  Renderer renderer(device, scene, {.width = 640, .height = 480, .room = false});
  const state::FrameState rest = tests::rest_state(scene);
  const auto draw_at = [&](float size, double time_s) {
    state::FrameState state = fired(rest, size);
    state.time_s = time_s;
    return draw(renderer, state);
  };
  const Picture without = draw_at(1e-4F, 5.1), with = draw_at(1, 5.1);
  // The tip is in the middle of the ball of 11 mm.
  const Vector3d inside =
      (rest.needle_positions.back() + 0.006F * (rest.needle_orientations.back() * Eigen::Vector3f::UnitZ()))
          .cast<double>();
  const Vector3d pixel = project(renderer.eyes()[0], inside, 640, 480);
  int most = 0;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const int x = static_cast<int>(pixel.x()) + dx, y = static_cast<int>(pixel.y()) + dy;
      most = std::max(most, std::abs(with.at(x, y)[1] - without.at(x, y)[1]));
    }
  EXPECT_GT(most, 15);
  EXPECT_EQ(draw_at(1, 6).rgba, draw_at(1, 4.9).rgba) << "opaque again";
}

TEST_F(Render3d, LabelsAndDepthsAreThoseOfTheNearestSurface) {
  const Vector3d centre(0.03, -0.02, 0.05);
  const double radius = 0.006;
  leave_only_a_ball(centre, radius, -1);
  // Twice the ball, as glass and twice as large, behind: the nearer one hides it where they overlap.
  content::Surface behind = scene.surfaces[0];
  const Vector3d along = (centre - scene.camera.eye).normalized();
  for (auto& p : behind.positions) {
    p = (centre + 0.05 * along + 2 * (p.cast<double>() - centre)).cast<float>();
  }
  behind.tissue = 3;
  scene.tissues[3].colour = {0.5F, 0.2F, 0.1F, 0.7F};
  scene.surfaces.push_back(behind);
  Renderer renderer(device, scene, {.width = 320, .height = 240, .views = 2, .room = false});
  renderer.render(without_needle(tests::rest_state(scene)), scene.camera);
  for (const std::uint32_t layer : {0u, 1u}) {
    const ViewLabels view = renderer.read_labels(layer);
    ASSERT_EQ(view.labels.size(), std::size_t{320 * 240});
    const Eye& eye = renderer.eyes()[layer];
    const Vector3d forward = (scene.camera.look_at - scene.camera.eye).normalized();
    int wrong = 0;
    int near_pixels = 0;
    for (int i = 0; i < 320 * 240; ++i) {
      // Oracle: how far the pixel is from the projected centres, in radii.
      const auto radii = [&](const Vector3d& c, double r) {
        const Vector3d at = project(eye, c, 320, 240);
        return std::hypot(at.x() - (i % 320 + 0.5), at.y() - (int(i / 320) + 0.5)) /
               (120 / std::tan(scene.camera.vertical_fov / 2) * r / at.z());
      };
      const double near_ball = radii(centre, radius);
      const double far_ball = radii(centre + 0.05 * along, 2 * radius);
      if (std::abs(near_ball - 1) < 0.15 || std::abs(far_ball - 1) < 0.15) continue;  // facets and perspective
      const int expected = near_ball < 1 ? scene.surfaces[0].tissue : far_ball < 1 ? 3 : 0;
      near_pixels += near_ball < 1 ? 1 : 0;
      wrong += view.labels[i] != expected || (view.depth[i] == 0) != (expected == 0) ? 1 : 0;
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_GT(near_pixels, 50);
    const Vector3d at = project(eye, centre, 320, 240);
    const std::size_t middle = static_cast<std::size_t>(at.y()) * 320 + static_cast<std::size_t>(at.x());
    const Vector3d d = centre - eye.position;
    const double depth = (d.norm() - radius) * d.dot(forward) / d.norm();
    EXPECT_NEAR(view.depth[middle] * double(kDepthUnit), depth, 3e-4);  // half a pixel and the facets
  }
}

TEST_F(Render3d, LabelsDistinguishNeedleAndProbeFromTissues) {
  const int tissues = static_cast<int>(scene.tissues.size());
  Renderer renderer(device, scene, {.width = 320, .height = 240, .room = false});
  renderer.render(tests::rest_state(scene), scene.camera);
  const auto count = [&](int label) {
    const ViewLabels view = renderer.read_labels();
    return std::count(view.labels.begin(), view.labels.end(), label);
  };
  EXPECT_GT(count(tissues + 2), 20) << "needle";
  EXPECT_GT(count(tissues + 3), 20) << "probe";
  renderer.render(without_needle(tests::rest_state(scene)), scene.camera);
  EXPECT_EQ(count(tissues + 2), 0);
}

TEST_F(Render3d, NormalsTurnWithTheTissue) {
  // A half turn about the vertical of an embedded ball must light it as before: the light stays with the camera.
  // Normals left in rest space would show the dark side.
  scene.tissues[4].colour = {0, 0.8F, 0, 1};
  scene.surfaces = {scene.surfaces.back()};
  const Vector3d centre = scene.targets.front().centre;
  Renderer renderer(device, scene, {.width = 320, .height = 240, .room = false});
  state::FrameState state = without_needle(tests::rest_state(scene));
  state.probe_position = {0, 0, 10};
  const Picture before = draw(renderer, state);
  const Eigen::Matrix3d half_turn = Eigen::AngleAxisd(M_PI, Vector3d::UnitY()).toRotationMatrix();
  for (auto& x : state.bodies[0]) x = (half_turn * (x.cast<double>() - centre) + centre).cast<float>();
  const Picture after = draw(renderer, state);
  double difference = 0, level = 0;
  for (int y = 0; y < before.height; ++y)
    for (int x = 0; x < before.width; ++x) {
      if (!is_green(before.at(x, y)) || !is_green(after.at(x, y))) continue;
      difference += std::abs(before.at(x, y)[1] - after.at(x, y)[1]);
      level += before.at(x, y)[1];
    }
  ASSERT_GT(level, 0);
  EXPECT_LT(difference / level, 0.02);
}

TEST_F(Render3d, DisparityIsFocalTimesSeparationOverDepth) {
  const double separation = 0.02;
  const Vector3d forward = (scene.camera.look_at - scene.camera.eye).normalized();
  const double distance = (scene.camera.look_at - scene.camera.eye).norm();
  const double focal = 240 / std::tan(scene.camera.vertical_fov / 2);
  for (double depth : {0.7 * distance, distance, 1.5 * distance}) {
    scene = tests::make_test_scene();
    leave_only_a_ball(scene.camera.eye + depth * forward, 0.006, -1);
    scene.targets.clear();
    Renderer renderer(
        device, scene,
        {.width = 480, .height = 480, .views = 2, .stereo = {.eye_separation = separation}, .room = false});
    const auto state = without_needle(tests::rest_state(scene));
    const Vector3d left = centroid(draw(renderer, state, 0), is_green);
    const Vector3d right = centroid(view::read_picture(device, renderer.image(), 1), is_green);
    ASSERT_GT(left.z(), 50);
    ASSERT_GT(right.z(), 50);
    // Nearer than the window: the left eye sees it further right (crossed, positive); behind it: the other way.
    EXPECT_NEAR(left.x() - right.x(), focal * separation * (1 / depth - 1 / distance), 0.4) << "at depth " << depth;
    EXPECT_NEAR(left.y(), right.y(), 0.2);
  }
}

TEST_F(Render3d, EyesOfAHeadsetSeeABallWhereTheirAnglesSay) {
  // Oracle: the picture is a plane at distance 1 before the eye, its edges at the tangents of the angles.
  const double separation = 0.064;
  std::vector<EyeView> eyes(2);
  eyes[0] = {.left = -0.75, .right = 0.45, .up = 0.40, .down = -0.55};
  eyes[1] = {.left = -0.45, .right = 0.75, .up = 0.40, .down = -0.55};
  const Eigen::Isometry3d head = Eigen::Translation3d(0.1, 0.05, 0.3) * Eigen::AngleAxisd(0.3, Vector3d::UnitY()) *
                                 Eigen::AngleAxisd(-0.2, Vector3d::UnitX());
  for (std::size_t i = 0; i < 2; ++i)
    eyes[i].patient_from_eye = head * Eigen::Translation3d((i == 0 ? -0.5 : 0.5) * separation, 0, 0);
  const Vector3d in_head(0.02, -0.05, -0.35);
  leave_only_a_ball(head * in_head, 0.008, -1);
  scene.targets.clear();
  Renderer renderer(device, scene, {.width = 400, .height = 320, .views = 2, .room = false});
  renderer.render(without_needle(tests::rest_state(scene)), eyes);
  std::vector<Vector3d> found;
  for (std::uint32_t i : {0u, 1u}) {
    found.push_back(centroid(view::read_picture(device, renderer.image(), i), is_green));
    ASSERT_GT(found[i].z(), 50) << "eye " << i;
    const EyeView& eye = eyes[i];
    const double x = (in_head.x() + (i == 0 ? 0.5 : -0.5) * separation) / 0.35, y = in_head.y() / 0.35;
    EXPECT_NEAR(found[i].x(), 400 * (x - std::tan(eye.left)) / (std::tan(eye.right) - std::tan(eye.left)), 0.5);
    EXPECT_NEAR(found[i].y(), 320 * (std::tan(eye.up) - y) / (std::tan(eye.up) - std::tan(eye.down)), 0.5);
    const Vector3d projected = project(renderer.eyes()[i], head * in_head, 400, 320);
    EXPECT_NEAR(found[i].x(), projected.x(), 0.5);
    EXPECT_NEAR(projected.z(), 0.35, 1e-9);
  }
  // In angles: the left eye sees what is near further to the right.
  const auto tangent = [&](std::size_t i) {
    return std::tan(eyes[i].left) + found[i].x() / 400 * (std::tan(eyes[i].right) - std::tan(eyes[i].left));
  };
  EXPECT_NEAR(tangent(0) - tangent(1), separation / 0.35, 0.004);
}

TEST_F(Render3d, InvalidEyesAreRefused) {
  Renderer renderer(device, scene, {.width = 64, .height = 64, .room = false});
  const auto state = tests::rest_state(scene);
  EXPECT_THROW(renderer.render(state, std::vector<EyeView>(2)), gpu::GpuError);
  EXPECT_THROW(renderer.render(state, std::vector{EyeView{.left = 0.5, .right = -0.5}}), gpu::GpuError);
  EXPECT_THROW(renderer.render(state, std::vector{EyeView{.up = 1.7}}), gpu::GpuError);
}

TEST_F(Render3d, NearerSurfaceHidesTheFarther) {
  const Vector3d forward = (scene.camera.look_at - scene.camera.eye).normalized();
  for (bool green_in_front : {true, false}) {
    scene = tests::make_test_scene();
    leave_only_a_ball(scene.camera.look_at, 0.008, -1);
    content::Surface other = scene.surfaces[0];
    other.tissue = 3;
    scene.tissues[3].colour = {0.9F, 0, 0, 1};
    for (auto& p : other.positions) p += ((green_in_front ? 0.05 : -0.05) * forward).cast<float>();
    for (bool other_first : {true, false}) {
      auto surfaces = std::vector{scene.surfaces[0], other};
      if (other_first) std::swap(surfaces[0], surfaces[1]);
      content::Scene both = scene;
      both.surfaces = surfaces;
      Renderer renderer(device, both, {.width = 160, .height = 120, .room = false});
      const Picture picture = draw(renderer, without_needle(tests::rest_state(both)));
      EXPECT_EQ(is_green(picture.at(80, 60)), green_in_front) << "drawn first: " << other_first;
    }
  }
}

TEST_F(Render3d, GlassShowsWhatIsInsideButNotThroughSolids) {
  Renderer renderer(device, scene, {.width = 320, .height = 240, .room = false});
  const auto state = without_needle(tests::rest_state(scene));
  const Picture with = draw(renderer, state);
  const Vector3d pixel = project(renderer.eyes()[0], scene.targets.front().centre, 320, 240);
  content::Scene no_tumour = scene;
  no_tumour.surfaces.pop_back();
  Renderer other(device, no_tumour, {.width = 320, .height = 240, .room = false});
  const Picture without = view::read_picture(device, other.render(state, scene.camera));
  const auto at = [&](const Picture& picture) {
    return picture.at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
  };
  EXPECT_GT(at(with)[1], at(without)[1] + 25) << "the tumour must be seen through liver and skin";
  scene.tissues[2].colour[3] = 1;  // a liver of wood
  Renderer solid(device, scene, {.width = 320, .height = 240, .room = false});
  scene.surfaces.pop_back();
  Renderer solid_without(device, scene, {.width = 320, .height = 240, .room = false});
  const Picture a = draw(solid, state), b = draw(solid_without, state);
  EXPECT_EQ(at(a)[1], at(b)[1]);
}

TEST_F(Render3d, NeedleIsDrawnAlongItsBentShaft) {
  scene.surfaces.clear();
  Renderer renderer(device, scene, {.width = 640, .height = 480, .room = false});
  state::FrameState state = tests::rest_state(scene);
  tests::deform(state);
  state.probe_position = {0, 0, 10};
  const Picture with = draw(renderer, state);
  const Picture without = draw(renderer, without_needle(state));
  const auto differs = [&](int x, int y) {
    int most = 0;
    for (int c = 0; c < 3; ++c) most = std::max(most, std::abs(with.at(x, y)[c] - without.at(x, y)[c]));
    return most > 12;
  };
  const auto& eye = renderer.eyes()[0];
  for (std::size_t i = 0; i + 1 < state.needle_positions.size(); ++i) {  // the tip itself is thinner than a pixel
    const auto& node = state.needle_positions[i];
    const Vector3d pixel = project(eye, node.cast<double>(), 640, 480);
    bool found = false;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx)
        found = found || differs(static_cast<int>(pixel.x()) + dx, static_cast<int>(pixel.y()) + dy);
    EXPECT_TRUE(found) << "no needle at its node near pixel " << pixel.transpose();
  }
  // The chord from hub to tip is not the needle: the bow is 14 mm.
  const Vector3d mid = 0.5 * (state.needle_positions.front() + state.needle_positions.back()).cast<double>();
  const Vector3d pixel = project(eye, mid, 640, 480);
  const Vector3d bow = project(eye, state.needle_positions[4].cast<double>(), 640, 480);
  if ((pixel - bow).head<2>().norm() > 4) {
    EXPECT_FALSE(differs(static_cast<int>(pixel.x()), static_cast<int>(pixel.y())));
  }
}

TEST_F(Render3d, ImagingPlaneShowsTheUltrasoundImage) {
  scene.surfaces.clear();
  scene.camera = {.eye = {0, 0, 0.5}, .look_at = {0, 0, 0}, .up = Vector3d::UnitY(), .vertical_fov = 0.5};
  state::FrameState state = without_needle(tests::rest_state(scene));
  // The probe looks down (-Y) from above; its lateral axis is the picture's x, its elevation towards the camera.
  state.probe_position = {0, 0.06F, 0};
  Eigen::Matrix3f axes;
  axes.col(0) = Eigen::Vector3f::UnitX();
  axes.col(2) = -Eigen::Vector3f::UnitY();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  state.probe_orientation = Eigen::Quaternionf(axes);
  // An image of 100 x 120 mm, black but for a white square 60...70 mm deep and 10...20 mm to the right.
  std::vector<std::uint8_t> pixels(100 * 120 * 4, 0);
  for (int v = 60; v < 70; ++v)
    for (int u = 60; u < 70; ++u)
      for (int c = 0; c < 3; ++c) pixels[(v * 100 + u) * 4 + c] = 255;
  const gpu::Image image(device, {.width = 100, .height = 120});
  gpu::run_now(device, [&](gpu::Commands& commands) { commands.upload(image, std::as_bytes(std::span(pixels))); });
  Renderer renderer(device, scene, {.width = 320, .height = 240, .room = false});
  const auto with_image = [&] {
    return view::read_picture(device,
                              renderer.render(state, scene.camera, {.plane = {&image, Vector2d(-0.05, 0), 0.001}}));
  };
  Picture picture = with_image();
  std::fill(pixels.begin(), pixels.end(), std::uint8_t{0});
  gpu::run_now(device, [&](gpu::Commands& commands) { commands.upload(image, std::as_bytes(std::span(pixels))); });
  const Picture black = with_image();
  for (std::size_t i = 0; i < picture.rgba.size(); ++i)
    picture.rgba[i] = picture.rgba[i] > black.rgba[i] + 40 ? 255 : 0;
  const Vector3d found = centroid(picture, [](const std::uint8_t* p) { return p[0] > 0; });
  const Vector3d expected = project(renderer.eyes()[0], {0.015, 0.06 - 0.065, 0}, 320, 240);
  ASSERT_GT(found.z(), 10);
  EXPECT_NEAR(found.x(), expected.x(), 1);
  EXPECT_NEAR(found.y(), expected.y(), 1);
}

// The imaging plane is a window into the patient: beside it there is nothing to see, and it would hang in the air.
TEST_F(Render3d, ImagingPlaneEndsWhereThePatientDoes) {
  scene.surfaces.clear();
  scene.camera = {.eye = {0, 0, 0.6}, .look_at = {0, 0, 0}, .up = Vector3d::UnitY(), .vertical_fov = 0.5};
  state::FrameState state = without_needle(tests::rest_state(scene));
  state.probe_position = {0, 0.06F, 0};
  Eigen::Matrix3f axes;
  axes.col(0) = Eigen::Vector3f::UnitX();
  axes.col(2) = -Eigen::Vector3f::UnitY();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  state.probe_orientation = Eigen::Quaternionf(axes);
  const auto seen = [&](const Vector3d& at) {
    Renderer renderer(device, scene, {.width = 320, .height = 320, .room = false});
    const picture::Picture with = view::read_picture(device, renderer.render(state, scene.camera));
    state::FrameState away = state;
    away.probe_position = {0, 0, 10};
    const picture::Picture without = view::read_picture(device, renderer.render(away, scene.camera));
    const Vector3d pixel = project(renderer.eyes()[0], at, 320, 320);
    int difference = 0;
    for (int c = 0; c < 3; ++c) {
      difference +=
          std::abs(with.at(int(pixel.x()), int(pixel.y()))[c] - without.at(int(pixel.x()), int(pixel.y()))[c]);
    }
    return difference > 3;
  };
  const Vector3d shallow(0, 0.03, 0), deep(0, -0.045, 0), aside(-0.04, -0.005, 0);
  for (const Vector3d& at : {shallow, deep, aside}) EXPECT_TRUE(seen(at)) << "as far as is known all is patient";
  // A slab of tissue: 80 mm down, with a gap of gas in it, and 25 mm to the left.
  content::LabelVolume& labels = scene.labels;
  labels.origin = {-0.12F, -0.12F, -0.02F};
  labels.spacing = 0.002F;
  labels.size = {121, 121, 21};
  for (int z = 0; z < 21; ++z) {
    for (int y = 0; y < 121; ++y) {
      for (int x = 0; x < 121; ++x) {
        const double depth = 0.06 - (y * 0.002 - 0.12), left = -(x * 0.002 - 0.12);
        const bool gas = depth > 0.02 && depth < 0.04;
        labels.labels.push_back(depth >= 0 && depth < 0.08 && left < 0.025 && !gas ? 1 : 0);
      }
    }
  }
  EXPECT_TRUE(seen(shallow)) << "in the gas, with tissue behind";
  EXPECT_FALSE(seen(deep));
  EXPECT_FALSE(seen(aside));
}

// Where the patient ends is known to a voxel or two: a bright line there would be a jagged one.
TEST_F(Render3d, ImagingPlaneFadesTowardsWhereThePatientEnds) {
  scene.surfaces.clear();
  scene.camera = {.eye = {0, 0, 0.4}, .look_at = {0, 0, 0}, .up = Vector3d::UnitY(), .vertical_fov = 0.5};
  // Tissue as far as 73 mm below the probe, between two marks of the scale; the image would reach 120 mm.
  constexpr double kEnd = -0.013;
  content::LabelVolume& labels = scene.labels;
  labels.origin = {-0.12F, -0.12F, -0.02F};
  labels.spacing = 0.002F;
  labels.size = {121, 121, 21};
  for (int z = 0; z < 21; ++z)
    for (int y = 0; y < 121; ++y)
      for (int x = 0; x < 121; ++x) labels.labels.push_back(y * 0.002 - 0.12 > kEnd ? 1 : 0);
  state::FrameState state = without_needle(tests::rest_state(scene));
  state.probe_position = {0, 0.06F, 0};
  Eigen::Matrix3f axes;
  axes.col(0) = Eigen::Vector3f::UnitX();
  axes.col(2) = -Eigen::Vector3f::UnitY();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  state.probe_orientation = Eigen::Quaternionf(axes);
  Renderer renderer(device, scene, {.width = 480, .height = 480, .room = false});
  const Picture picture = draw(renderer, state);
  for (const double x : {-0.02, 0.003, 0.02}) {
    const auto light = [&](double above) {
      const Vector3d pixel = project(renderer.eyes()[0], {x, kEnd + above, 0}, 480, 480);
      return int{picture.at(int(pixel.x()), int(pixel.y()))[2]};
    };
    const int inside = light(0.012);
    EXPECT_GT(inside, light(-0.006) + 3) << "there is a plane";
    for (double above = 0.010; above > -0.006; above -= 0.0005) {
      EXPECT_LE(light(above), inside + 2) << "x " << x << ", " << above << " m before the end";
    }
  }
}

TEST_F(Render3d, DrawsTheSameBitsEveryTime) {
  state::FrameState bent = tests::rest_state(scene);
  tests::deform(bent);
  Renderer first(device, scene, {.width = 320, .height = 240, .room = false});
  const Picture once = draw(first, bent);
  draw(first, tests::rest_state(scene));  // another frame between must leave no trace
  EXPECT_EQ(draw(first, bent).rgba, once.rgba);
  Renderer second(device, scene, {.width = 320, .height = 240, .room = false});
  EXPECT_EQ(draw(second, bent).rgba, once.rgba);
}

TEST_F(Render3d, StereoEyesAreTheMonoViewSeenFromTheSides) {
  const auto state = tests::rest_state(scene);
  Renderer stereo(device, scene,
                  {.width = 320, .height = 240, .views = 2, .stereo = {.eye_separation = 1e-9}, .room = false});
  Renderer mono(device, scene, {.width = 320, .height = 240, .room = false});
  const Picture left = draw(stereo, state, 0);
  const Picture right = view::read_picture(device, stereo.image(), 1);
  const Picture one = draw(mono, state);
  EXPECT_TRUE(tests::compare(one, left).passes()) << tests::compare(one, left).text();
  EXPECT_TRUE(tests::compare(one, right).passes()) << tests::compare(one, right).text();
}

TEST_F(Render3d, FramesWithoutAntialiasingOrNeedleOrBodiesAreDrawn) {
  Renderer renderer(device, scene, {.width = 64, .height = 48, .antialias = false, .room = false});
  const Picture picture = draw(renderer, {});
  EXPECT_GT(centroid(picture, [](const std::uint8_t* p) { return p[0] > 60; }).z(), 20);
}

TEST_F(Render3d, ImpossibleSizesAreRefused) {
  EXPECT_THROW(Renderer(device, scene, {.width = 0}), gpu::GpuError);
  EXPECT_THROW(Renderer(device, scene, {.views = 3}), gpu::GpuError);
  EXPECT_THROW(Renderer(device, scene, {.width = 1 << 20}), gpu::GpuError);
}

TEST_F(Render3d, DrawsTheTestScene) {
  if (const auto why = tests::no_golden_for(device.identity())) GTEST_SKIP() << *why;
  Renderer renderer(device, scene, {.width = 320, .height = 240, .room = false});
  state::FrameState state = tests::rest_state(scene);
  tests::deform(state);
  EXPECT_TRUE(tests::matches_golden(device.identity(), draw(renderer, state), "render_scene"));
}

TEST_F(Render3d, DrawsTheTestSceneForTwoEyes) {
  if (const auto why = tests::no_golden_for(device.identity())) GTEST_SKIP() << *why;
  Renderer renderer(device, scene, {.width = 180, .height = 180, .views = 2, .room = false});
  state::FrameState state = tests::rest_state(scene);
  tests::deform(state);
  Picture both(360, 180);
  const Picture left = draw(renderer, state, 0), right = view::read_picture(device, renderer.image(), 1);
  for (int y = 0; y < 180; ++y) {
    std::copy_n(left.at(0, y), 720, both.at(0, y));
    std::copy_n(right.at(0, y), 720, both.at(180, y));
  }
  EXPECT_TRUE(tests::matches_golden(device.identity(), both, "render_scene_stereo"));
}

}  // namespace
}  // namespace stylet::render
