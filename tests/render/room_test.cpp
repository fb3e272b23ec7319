// The room round the patient: light, shadow, cloth and screen are where geometry says, on any device.
#include "engine/render/room_mesh.h"

#include "engine/render/cable_mesh.h"
#include "engine/render/drape_mesh.h"
#include "engine/render/geometry.h"
#include "engine/render/renderer.h"
#include "engine/view/offscreen.h"
#include "tests/render/test_scene.h"
#include "tests/support/image_compare.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace stylet::render {
namespace {

using Eigen::Vector3d;
using picture::Picture;

struct Room : testing::Test {
  std::atomic<std::uint32_t> messages{0};
  gpu::Device device{{.validation = true, .message_counter = &messages}};
  content::Scene scene = tests::make_test_scene();
  state::FrameState state = tests::rest_state(scene);

  void TearDown() override { EXPECT_EQ(messages.load(), 0u); }

  Picture draw(Renderer& renderer, const content::Camera& camera, const ViewOptions& options = {}) {
    return view::read_picture(device, renderer.render(state, camera, options));
  }
};

/// A camera that looks straight at the field from outside.
content::Camera at_field(const RoomLayout& layout, double distance) {
  const Vector3d field = layout.trunk_point(layout.field_angle, layout.field_y);
  const Vector3d out(std::sin(layout.field_angle), 0, std::cos(layout.field_angle));
  return {layout.patient_from_table * (field + distance * out), layout.patient_from_table * field,
          layout.patient_from_table.linear().col(1), 0.6};
}

const std::uint8_t* pixel_at(const Renderer& renderer, const Picture& picture, const Vector3d& patient) {
  const Vector3d at = project(renderer.eyes()[0], patient, picture.width, picture.height);
  return picture.at(std::clamp(static_cast<int>(at.x()), 0, picture.width - 1),
                    std::clamp(static_cast<int>(at.y()), 0, picture.height - 1));
}

TEST(RoomLayout, StandsUprightWithTheFieldOverTheProbe) {
  content::Scene scene = tests::make_test_scene();
  scene.probe.pose.position = {-0.03, 0.02, 0.085};
  for (const double turn : {0.0, 0.7}) {  // of the room about its vertical
    scene.room_from_patient.linear() =
        (Eigen::AngleAxisd(turn, Vector3d::UnitY()) * Eigen::AngleAxisd(-std::numbers::pi / 2, Vector3d::UnitX()))
            .toRotationMatrix();
    const RoomLayout layout = room_layout(scene);
    const Eigen::Matrix3d room_from_table = scene.room_from_patient.linear() * layout.patient_from_table.linear();
    EXPECT_NEAR(room_from_table.determinant(), 1, 1e-12);
    EXPECT_LT((room_from_table.col(2) - Vector3d::UnitY()).norm(), 1e-12);
    EXPECT_LT((layout.patient_from_table.linear().col(1) - Vector3d::UnitY()).norm(), 1e-12) << "the head";
    const Vector3d probe = layout.patient_from_table.inverse() * scene.probe.pose.position;
    EXPECT_LT(layout.outside_field(layout.trunk_angle(probe), layout.field_y), -0.02);
    EXPECT_GT(layout.lamp.z(), 0.9);
    EXPECT_GT((layout.trunk_point(0, 0) - layout.lamp).dot(layout.lamp_axis), 0.8);
  }
}

TEST(CableMesh, LeadsFromTheProbeToTheMachineOverThePatient) {
  const RoomLayout layout = room_layout(tests::make_test_scene());
  CableMesh cable(layout);
  const Eigen::Isometry3d table_from_patient = layout.patient_from_table.inverse();
  for (const double lean : {-1.2, 0.0, 0.8}) {
    // On the trunk's top, the grip leaning across it.
    Eigen::Isometry3d table_from_probe = Eigen::Isometry3d::Identity();
    table_from_probe.translate(layout.trunk_point(0, layout.field_y));
    table_from_probe.rotate(Eigen::AngleAxisd(std::numbers::pi + lean, Vector3d::UnitY()));
    const auto vertices = cable.shape(layout.patient_from_table * table_from_probe);
    Vector3d first = Vector3d::Zero(), last = Vector3d::Zero();
    double lowest = 1e9;
    const std::size_t sides = 10;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const vec4& p = vertices[i].position;
      const Vector3d at = table_from_patient * Vector3d(p[0], p[1], p[2]);
      ASSERT_TRUE(at.allFinite());
      lowest = std::min(lowest, at.z());
      if (i < sides) first += at / sides;
      if (i >= vertices.size() - sides) last += at / sides;
      const double x = (at.x() - layout.trunk_centre.x()) / layout.trunk_half.x();
      const double z = (at.z() - layout.trunk_centre.y()) / layout.trunk_half.y();
      EXPECT_GT(x * x + z * z, 1) << "in the patient";
    }
    EXPECT_LT((first - table_from_probe * Vector3d(0, 0, -0.170)).norm(), 1e-5);
    EXPECT_LT((last - layout.cable_port).norm(), 1e-5);
    EXPECT_GT(lowest, layout.floor_z);
    int outward = 0;
    for (std::size_t i = 0; i < cable.indices().size(); i += 3) {
      Vector3d c[3];
      for (std::size_t k = 0; k < 3; ++k) {
        const vec4& p = vertices[cable.indices()[i + k]].position;
        c[k] = Vector3d(p[0], p[1], p[2]);
      }
      const vec4& n = vertices[cable.indices()[i]].normal;
      outward += (c[1] - c[0]).cross(c[2] - c[0]).dot(Vector3d(n[0], n[1], n[2])) > 0 ? 1 : 0;
    }
    EXPECT_EQ(outward, static_cast<int>(cable.indices().size() / 3)) << "seen from outside";
  }
}

TEST(RoomMeshes, TrianglesFaceOutwardsAndAreSmall) {
  const RoomLayout layout = room_layout(tests::make_test_scene());
  RoomMesh box;
  add_box(box, Eigen::Isometry3d::Identity(), {0.3, 0.2, 0.1}, 0.02);
  double volume = 0;
  for (std::size_t i = 0; i < box.indices.size(); i += 3) {
    const auto corner = [&](std::size_t k) -> Eigen::Vector3f { return box.positions[box.indices[i + k]]; };
    volume += static_cast<double>(corner(0).dot(corner(1).cross(corner(2)))) / 6;
  }
  // Minus the rounded edges: (1 - pi / 4) r^2 along each, and the corners.
  const double r = 0.02, edges = 4 * (0.26 + 0.16 + 0.06);
  const double expected =
      0.3 * 0.2 * 0.1 - (1 - std::numbers::pi / 4) * r * r * edges - (8 - 4 * std::numbers::pi / 3) * r * r * r;
  EXPECT_NEAR(volume, expected, 0.01 * expected);
  for (const RoomMesh& mesh : {room_meshes(layout, {}).mattress, room_meshes(layout, {}).drape}) {
    float longest = 0;
    for (std::size_t i = 0; i + 1 < mesh.indices.size(); ++i)
      if (i % 3 != 2)
        longest = std::max(longest, (mesh.positions[mesh.indices[i]] - mesh.positions[mesh.indices[i + 1]]).norm());
    EXPECT_LT(longest, 0.12F);
  }
}

TEST_F(Room, ScreenShowsThePictureGiven) {
  Renderer renderer(device, scene, {.width = 480, .height = 360});
  const RoomLayout& layout = renderer.layout();
  content::Camera camera = layout.standing_camera();
  camera.look_at = layout.patient_from_table * layout.table_from_screen.translation();
  // Four quarters of different colours, as bytes that mean sRGB.
  const std::array<std::array<std::uint8_t, 3>, 4> colours{
      {{200, 40, 40}, {40, 180, 60}, {50, 60, 220}, {128, 128, 128}}};
  std::vector<std::uint8_t> pixels;
  for (int v = 0; v < 48; ++v)
    for (int u = 0; u < 64; ++u) {
      const auto& c = colours[(v < 24 ? 0U : 2U) + (u < 32 ? 0U : 1U)];
      pixels.insert(pixels.end(), {c[0], c[1], c[2], 255});
    }
  const std::array<Vector3d, 4> corners = layout.screen_corners();
  const Vector3d middle = (corners[0] + corners[2]) / 2;
  for (const VkFormat format : {VK_FORMAT_R8G8B8A8_UNORM, VK_FORMAT_R8G8B8A8_SRGB}) {
    const gpu::Image image(device, {.width = 64, .height = 48, .format = format});
    gpu::run_now(device, [&](gpu::Commands& commands) { commands.upload(image, std::as_bytes(std::span(pixels))); });
    const Picture picture = draw(renderer, camera, {.screen = &image});
    for (std::size_t corner = 0; corner < 4; ++corner) {
      const auto& c = colours[corner < 2 ? corner : 5 - corner];  // corners go round
      const std::uint8_t* found = pixel_at(renderer, picture, (corners[corner] + middle) / 2);
      for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(found[k], c[k], 2) << "corner " << corner << " channel " << k;
    }
  }
  const Picture dark = draw(renderer, camera);
  EXPECT_LT(pixel_at(renderer, dark, middle)[1], 40);
}

TEST_F(Room, PanelHangsThereWhileItHasAPictureAndShowsIt) {
  Renderer renderer(device, scene, {.width = 480, .height = 360});
  const RoomLayout& layout = renderer.layout();
  content::Camera camera = layout.standing_camera();
  const std::array<Vector3d, 4> corners = layout.panel_corners();
  const Vector3d middle = (corners[0] + corners[2]) / 2;
  camera.look_at = middle;
  const Picture without = draw(renderer, camera);
  std::vector<std::uint8_t> pixels;
  for (int v = 0; v < 16; ++v)
    for (int u = 0; u < 32; ++u)
      pixels.insert(pixels.end(), {static_cast<std::uint8_t>(u < 16 ? 220 : 30), 90,
                                   static_cast<std::uint8_t>(v < 8 ? 200 : 60), 255});
  const gpu::Image image(device, {.width = 32, .height = 16, .format = VK_FORMAT_R8G8B8A8_SRGB});
  gpu::run_now(device, [&](gpu::Commands& commands) { commands.upload(image, std::as_bytes(std::span(pixels))); });
  const Picture with = draw(renderer, camera, {.panel = &image});
  for (std::size_t corner = 0; corner < 4; ++corner) {
    const std::uint8_t* found = pixel_at(renderer, with, (corners[corner] + middle) / 2);
    EXPECT_NEAR(found[0], corner == 0 || corner == 3 ? 220 : 30, 2) << corner;
    EXPECT_NEAR(found[1], 90, 2) << corner;
    EXPECT_NEAR(found[2], corner < 2 ? 200 : 60, 2) << corner;
  }
  EXPECT_LT(pixel_at(renderer, with, layout.patient_from_table * layout.table_from_screen.translation())[1], 40)
      << "the scanner's screen is dark still";
  EXPECT_EQ(draw(renderer, camera).rgba, without.rgba) << "nothing of it is left";
}

TEST_F(Room, DrapeLeavesTheFieldOpenAndHidesTheRest) {
  state.needle_positions.clear();
  state.needle_orientations.clear();
  state.probe_position = {0, 0, 10};
  Renderer renderer(device, scene, {.width = 320, .height = 320});
  const RoomLayout& layout = renderer.layout();
  const Picture picture = draw(renderer, at_field(layout, 0.6), {.see_through = SeeThrough::closed});
  const auto cloth = [&](double angle, double y) {
    const std::uint8_t* p =
        pixel_at(renderer, picture, layout.patient_from_table * layout.trunk_point(angle, y, 0.005));
    return p[2] > p[0] + 20;  // skin is red, the drape blue
  };
  const double round = (layout.trunk_half.x() + layout.trunk_half.y()) / 2;
  const double half = layout.field_half.x() / round;
  EXPECT_FALSE(cloth(layout.field_angle, layout.field_y));
  for (const double side : {-1.0, 1.0}) {
    EXPECT_FALSE(cloth(layout.field_angle + 0.7 * side * half, layout.field_y));
    EXPECT_FALSE(cloth(layout.field_angle, layout.field_y + 0.7 * side * layout.field_half.y()));
    EXPECT_TRUE(cloth(layout.field_angle + side * (half + 0.03 / round), layout.field_y));
    EXPECT_TRUE(cloth(layout.field_angle, layout.field_y + side * (layout.field_half.y() + 0.03)));
  }
}

TEST_F(Room, TheWindowOpensTheClothOverThePatientAndNotBesideHim) {
  state.needle_positions.clear();
  state.needle_orientations.clear();
  state.probe_position = {0, 0, 10};
  Renderer renderer(device, scene, {.width = 320, .height = 320, .antialias = false, .window_radius = 1});
  const RoomLayout& layout = renderer.layout();
  const RoomMesh sheet = drape_mesh(layout, {});
  // From the side, as one who stands at the table: the wide window takes in the sheet on the mattress.
  const double side = layout.trainee_side;
  const Vector3d on(side * layout.trunk_half.x(), layout.field_y, 0.03);
  const content::Camera camera{layout.patient_from_table * (on + Vector3d(side * 0.5, 0, 0.5)),
                               layout.patient_from_table * on, layout.patient_from_table.linear().col(2), 0.9};
  const Picture closed = draw(renderer, camera, {.see_through = SeeThrough::closed});
  const Picture open = draw(renderer, camera, {.see_through = SeeThrough::window});
  int beside = 0, opened = 0;
  for (std::size_t i = 0; i < sheet.positions.size(); ++i) {
    const Vector3d p = sheet.positions[i].cast<double>();
    if (side * p.x() < 0 || std::abs(p.y() - layout.field_y) > 0.08) continue;
    const bool over = layout.trunk_angle(p) * side < 1.4 && side * p.x() < layout.trunk_half.x() + 0.01;
    const bool on_mattress = side * p.x() > layout.trunk_half.x() + 0.02 && p.z() < 0.05 && p.z() > 0.0;
    const Vector3d at = layout.patient_from_table * p;
    const std::uint8_t* cloth = pixel_at(renderer, closed, at);
    const std::uint8_t* seen = pixel_at(renderer, open, at);
    if (cloth[2] < cloth[0] + 20) continue;  // the field, or something before it
    if (on_mattress) {
      ++beside;
      EXPECT_GT(seen[2], seen[0] + 20) << "x " << p.x() << " y " << p.y();
    }
    if (over && seen[2] <= seen[0] + 20) ++opened;
  }
  EXPECT_GT(beside, 10);
  EXPECT_GT(opened, 10);
}

// One opening: where one looks in, cloth ends in the hem that it has round the field.
TEST_F(Room, AHemGoesRoundFieldAndWindow) {
  state.needle_positions.clear();
  state.needle_orientations.clear();
  state.probe_position = {0, 0, 10};
  scene.targets.front().centre += Vector3d(-0.05, 0, 0.02);  // the window lies beside the field
  constexpr int kSize = 400;
  Renderer renderer(device, scene, {.width = kSize, .height = kSize, .antialias = false, .window_radius = 0.035});
  const RoomLayout& layout = renderer.layout();
  content::Camera camera = at_field(layout, 0.5);
  const Picture closed = draw(renderer, camera, {.see_through = SeeThrough::closed});
  const Picture open = draw(renderer, camera, {.see_through = SeeThrough::window});
  const auto cloth = [](const Picture& picture, int x, int y) {
    const std::uint8_t* p = picture.at(x, y);
    return p[2] > p[0] + 12;
  };
  int opened = 0, border = 0, hem = 0;
  for (int y = 2; y < kSize - 2; ++y)
    for (int x = 2; x < kSize - 2; ++x) {
      if (!cloth(closed, x, y)) continue;
      if (!cloth(open, x, y)) {
        ++opened;
        continue;
      }
      // Cloth two pixels beside what the window has opened.
      bool beside = false;
      for (const auto& [dx, dy] : {std::pair{2, 0}, {-2, 0}, {0, 2}, {0, -2}})
        beside = beside || (cloth(closed, x + dx, y + dy) && !cloth(open, x + dx, y + dy));
      if (!beside) continue;
      ++border;
      hem += open.at(x, y)[0] > 90 ? 1 : 0;  // pale, where the cloth is a deep blue
    }
  EXPECT_GT(opened, 1000);
  EXPECT_GT(border, 80);
  EXPECT_GT(hem, 0.97 * border);
}

TEST_F(Room, SeeThroughShowsOrHidesTheTumour) {
  scene.tissues[4].colour = {0, 0.8F, 0, 1};
  Renderer renderer(device, scene, {.width = 320, .height = 240});
  const auto green = [&](SeeThrough see_through) {
    const Picture picture = draw(renderer, scene.camera, {.see_through = see_through});
    int count = 0;
    for (std::size_t i = 0; i < picture.rgba.size(); i += 4)
      count += picture.rgba[i + 1] > picture.rgba[i] + 30 && picture.rgba[i + 1] > picture.rgba[i + 2] + 30 ? 1 : 0;
    return count;
  };
  EXPECT_EQ(green(SeeThrough::closed), 0);
  EXPECT_GT(green(SeeThrough::window), 50);
  EXPECT_GT(green(SeeThrough::glass), 10);
}

TEST_F(Room, NeedleThrowsItsShadowAwayFromTheLamp) {
  // A plate of skin, the needle upright over it.
  content::Surface plate;
  plate.name = "plate";
  plate.tissue = 1;
  constexpr int kCells = 20;
  for (int j = 0; j <= kCells; ++j)
    for (int i = 0; i <= kCells; ++i) {
      plate.positions.emplace_back(0.02F * float(i) - 0.2F, 0.0F, 0.02F * float(j) - 0.2F);
      plate.normals.push_back(Eigen::Vector3f::UnitY());
    }
  for (std::uint32_t j = 0; j < kCells; ++j)
    for (std::uint32_t i = 0; i < kCells; ++i) {
      const std::uint32_t a = j * (kCells + 1) + i, b = a + kCells + 1;
      plate.indices.insert(plate.indices.end(), {a, b, b + 1, a, b + 1, a + 1});
    }
  scene.surfaces = {plate};
  const Vector3d tip(0.02, 0.03, -0.01);
  for (std::size_t i = 0; i < state.needle_positions.size(); ++i) {
    const double along = scene.needle.length * (1 - double(i) / double(scene.needle.beams));
    state.needle_positions[i] = (tip + Vector3d(0, along, 0)).cast<float>();
    state.needle_orientations[i] = Eigen::AngleAxisf(std::numbers::pi_v<float> / 2, Eigen::Vector3f::UnitX());
  }
  state.probe_position = {0, 0, 10};
  for (const bool shadows : {true, false}) {
    Renderer renderer(device, scene, {.width = 480, .height = 480, .room = false, .shadows = shadows});
    const content::Camera above{{0, 0.7, 0.25}, {0, 0, 0}, Vector3d::UnitY(), 0.6};
    const Picture with = draw(renderer, above, {.see_through = SeeThrough::closed});
    const Vector3d lamp = renderer.layout().patient_from_table * renderer.layout().lamp;
    state::FrameState bare = state;
    bare.needle_positions.clear();
    bare.needle_orientations.clear();
    const Picture without =
        view::read_picture(device, renderer.render(bare, above, {.see_through = SeeThrough::closed}));
    const auto darker = [&](const Vector3d& at) {
      return int{pixel_at(renderer, without, at)[1]} - int{pixel_at(renderer, with, at)[1]};
    };
    for (const double height : {0.045, 0.07, 0.10}) {
      const Vector3d shaft(tip.x(), height, tip.z());
      // Oracle: the ray from the lamp through the shaft, down to the plate.
      const Vector3d shadow = shaft + (shaft - lamp) * height / (lamp.y() - height);
      if (shadows)
        EXPECT_GT(darker(shadow), 6) << "height " << height;
      else
        EXPECT_EQ(darker(shadow), 0);
      const Vector3d aside = shadow + 0.008 * (shadow - tip).cross(Vector3d::UnitY()).normalized();
      EXPECT_LE(std::abs(darker(aside)), 1);
    }
  }
}

TEST_F(Room, TheNeedleDrawnIsTheOneLatched) {
  Renderer renderer(device, scene, {.width = 320, .height = 240, .room = false});
  const state::FrameState early = state;
  for (Eigen::Vector3f& p : state.needle_positions) p += Eigen::Vector3f(0.012F, 0.004F, 0);
  const std::vector<Eigen::Vector3f> late = state.needle_positions;
  const Picture expected = draw(renderer, scene.camera);
  state = early;
  const Picture before = draw(renderer, scene.camera);
  int asked = 0;
  const ViewOptions latched{.latch_needle = [&](NeedlePose pose) {
    ++asked;
    EXPECT_TRUE(std::ranges::equal(pose.positions, early.needle_positions));
    EXPECT_EQ(pose.orientations.size(), late.size());
    std::ranges::copy(late, pose.positions.begin());
  }};
  EXPECT_EQ(draw(renderer, scene.camera, latched).rgba, expected.rgba);
  EXPECT_NE(before.rgba, expected.rgba);
  EXPECT_EQ(asked, 1);
  EXPECT_EQ(draw(renderer, scene.camera).rgba, before.rgba);
}

// What lies under another picture is spared, and the rest is the same to the bit.
TEST_F(Room, WhatIsHiddenIsNotDrawnAndChangesNothingElse) {
  for (const bool antialias : {false, true}) {
    Renderer renderer(device, scene, {.width = 200, .height = 150, .antialias = antialias});
    const VkRect2D hidden{{90, 20}, {80, 70}};
    const Picture all = draw(renderer, scene.camera);
    const Picture part = draw(renderer, scene.camera, {.hidden = hidden});
    int drawn_there = 0, differ_elsewhere = 0, something = 0;
    for (int y = 0; y < 150; ++y) {
      for (int x = 0; x < 200; ++x) {
        const bool inside = x >= 90 && x < 170 && y >= 20 && y < 90;
        const bool same = std::equal(all.at(x, y), all.at(x, y) + 3, part.at(x, y));
        something += inside && all.at(x, y)[0] + all.at(x, y)[1] + all.at(x, y)[2] > 0 ? 1 : 0;
        drawn_there += inside && part.at(x, y)[0] + part.at(x, y)[1] + part.at(x, y)[2] > 0 ? 1 : 0;
        differ_elsewhere += !inside && !same ? 1 : 0;
      }
    }
    EXPECT_EQ(something, 80 * 70);
    EXPECT_EQ(drawn_there, 0);
    EXPECT_EQ(differ_elsewhere, 0);
  }
}

// A shadow map that is kept is the one that would be drawn; whatever throws a shadow and moves draws it anew.
TEST_F(Room, ShadowsAreDrawnAgainOnlyWhereSomethingThatThrowsThemHasMoved) {
  const RenderSettings settings{.width = 200, .height = 150};
  Renderer renderer(device, scene, settings);
  const auto drawn = [&](const content::Camera& camera) {
    const std::uint64_t before = renderer.shadows_drawn();
    const Picture kept = draw(renderer, camera);
    Renderer anew(device, scene, settings);
    EXPECT_EQ(kept.rgba, draw(anew, camera).rgba);
    return renderer.shadows_drawn() - before;
  };
  EXPECT_EQ(drawn(scene.camera), 1U);
  EXPECT_EQ(drawn(scene.camera), 0U);
  content::Camera turned = scene.camera;
  turned.eye.x() += 0.05;
  EXPECT_EQ(drawn(turned), 0U) << "the lamp hangs where it hung";
  for (Eigen::Vector3f& node : state.needle_positions) node.x() += 0.01F;
  EXPECT_EQ(drawn(turned), 1U);
  state.probe_position.x() += 0.01F;
  EXPECT_EQ(drawn(turned), 1U);
  state.bodies.front()[3].z() += 0.01F;
  EXPECT_EQ(drawn(turned), 1U);
  EXPECT_EQ(drawn(turned), 0U);
}

// A picture that is kept is the one that would be drawn; whatever is seen and changes has it drawn anew.
TEST_F(Room, AFrameThatShowsWhatIsShownIsNotDrawnAgain) {
  const RenderSettings settings{.width = 200, .height = 150};
  Renderer renderer(device, scene, settings);
  const gpu::Image screen(device, {.width = 16, .height = 16});
  const auto upload = [&](std::uint8_t grey) {
    const picture::Picture bytes(16, 16, {grey, grey, grey, 255});
    gpu::run_now(device,
                 [&](gpu::Commands& commands) { commands.upload(screen, std::as_bytes(std::span(bytes.rgba))); });
  };
  upload(40);
  content::Camera camera = room_layout(scene).standing_camera();
  ViewOptions options{.screen = &screen, .pictures = 1};
  const auto drawn = [&] {
    const std::uint64_t before = renderer.frames_drawn();
    const Picture kept = draw(renderer, camera, options);
    Renderer anew(device, scene, settings);
    EXPECT_EQ(kept.rgba, draw(anew, camera, options).rgba);
    EXPECT_EQ(renderer.stage_times().empty(), renderer.frames_drawn() == before);
    return renderer.frames_drawn() - before;
  };
  EXPECT_EQ(drawn(), 1U);
  EXPECT_EQ(drawn(), 0U);
  upload(200);
  options.pictures = 2;
  EXPECT_EQ(drawn(), 1U) << "the screen shows another picture";
  EXPECT_EQ(drawn(), 0U);
  camera.eye.x() += 0.05;
  EXPECT_EQ(drawn(), 1U);
  for (Eigen::Vector3f& node : state.needle_positions) node.x() += 0.01F;
  EXPECT_EQ(drawn(), 1U);
  state.probe_position.x() += 0.01F;
  EXPECT_EQ(drawn(), 1U);
  state.bodies.front()[3].z() += 0.01F;
  EXPECT_EQ(drawn(), 1U);
  state.breath.z() += 0.01F;
  EXPECT_EQ(drawn(), 1U);
  state.cores.push_back({.from = {0, 0, 0.08F}, .to = {0, 0, 0.1F}, .radius = 0.001F});
  EXPECT_EQ(drawn(), 1U);
  EXPECT_EQ(drawn(), 0U);
  state.cores.back().throw_length = 0.02F;
  state.cores.back().fired_s = state.time_s - 0.01;
  EXPECT_EQ(drawn(), 1U) << "the needle shoots";
  state.time_s += 0.01;
  EXPECT_EQ(drawn(), 1U) << "and is further out";
  state.time_s += 0.2;
  EXPECT_EQ(drawn(), 1U);
  state.time_s += 2;
  EXPECT_EQ(drawn(), 1U) << "and drawn back";
  state.time_s += 2;
  EXPECT_EQ(drawn(), 0U);
  options.see_through = SeeThrough::closed;
  EXPECT_EQ(drawn(), 1U);
  options.hidden = {{10, 10}, {20, 20}};
  EXPECT_EQ(drawn(), 1U);
  EXPECT_EQ(drawn(), 0U);
  options.pictures.reset();
  EXPECT_EQ(drawn(), 1U) << "who does not say whether pictures changed has all of it drawn";
}

// The newest pose of the needle counts, not that of the state.
TEST_F(Room, ANeedleThatIsLatchedElsewhereIsDrawnAgain) {
  Renderer renderer(device, scene, {.width = 200, .height = 150});
  float along = 0;
  const ViewOptions options{.pictures = 1, .latch_needle = [&](NeedlePose pose) {
                              for (Eigen::Vector3f& position : pose.positions) position.x() += along;
                            }};
  const auto drawn = [&] {
    const std::uint64_t before = renderer.frames_drawn();
    draw(renderer, scene.camera, options);
    return renderer.frames_drawn() - before;
  };
  EXPECT_EQ(drawn(), 1U);
  EXPECT_EQ(drawn(), 0U);
  along = 0.01F;
  EXPECT_EQ(drawn(), 1U);
}

TEST_F(Room, ResizedItDrawsAsOneThatWasMadeInThatSize) {
  for (const bool antialias : {false, true}) {
    Renderer renderer(device, scene, {.width = 200, .height = 150, .antialias = antialias});
    draw(renderer, scene.camera, {.pictures = 1});
    renderer.resize(120, 100);
    Renderer anew(device, scene, {.width = 120, .height = 100, .antialias = antialias});
    EXPECT_EQ(draw(renderer, scene.camera, {.pictures = 1}).rgba, draw(anew, scene.camera).rgba);
    EXPECT_EQ(renderer.read_labels().labels, anew.read_labels().labels);
    EXPECT_THROW(renderer.resize(0, 100), gpu::GpuError);
  }
}

// In fewer triangles all stands where it stood, in the same colors: half a pixel at an edge is all that differs.
TEST_F(Room, ThinnedSurfacesLookAsTheyDid) {
  constexpr double kError = 0.4e-3;
  const RoomLayout layout = room_layout(scene);
  const Geometry all(scene, &layout), few(scene, &layout, {.error = kError});
  EXPECT_LT(few.indices.size(), 0.75 * static_cast<double>(all.indices.size()));
  EXPECT_LT(few.rest.size(), 0.75 * static_cast<double>(all.rest.size()));
  Renderer whole(device, scene, {.width = 640, .height = 480});
  Renderer thin(device, scene, {.width = 640, .height = 480, .detail = {.error = kError}});
  tests::deform(state);
  for (const content::Camera& camera : {scene.camera, layout.standing_camera()}) {
    const tests::Difference difference = tests::compare(draw(whole, camera), draw(thin, camera));
    EXPECT_GT(difference.ssim, 0.985) << difference.text();
    EXPECT_LT(difference.above_3, 0.05) << difference.text();
  }
}

// Seen through, the patient has no drape on: nor lies its shadow on table, skin and probe.
TEST_F(Room, ADrapeThatIsNotDrawnThrowsNoShadow) {
  const RenderSettings settings{.width = 200, .height = 150};
  Renderer renderer(device, scene, settings);
  const auto glass = [&](Renderer& drawing) {
    return draw(drawing, scene.camera, {.see_through = SeeThrough::glass});
  };
  draw(renderer, scene.camera, {.see_through = SeeThrough::closed});  // with its shadow
  const Picture with_room = glass(renderer);
  // A room whose table is bare from the start.
  Renderer unshadowed(device, scene, {.width = 200, .height = 150, .shadows = false});
  state.needle_positions.clear();
  state.needle_orientations.clear();
  state.probe_position = {0, 0, 10};
  const Picture lit = glass(renderer), expected = glass(unshadowed);
  int darker = 0;
  for (std::size_t i = 0; i < lit.rgba.size(); i += 4) darker += lit.rgba[i + 1] + 12 < expected.rgba[i + 1] ? 1 : 0;
  EXPECT_LT(darker, 10) << "neither needle nor probe is there";
  EXPECT_NE(with_room.rgba, lit.rgba);
}

TEST_F(Room, BothEyesSeeTheWholeRoom) {
  const auto camera = room_layout(scene).standing_camera();
  Renderer stereo(device, scene, {.width = 256, .height = 192, .views = 2, .stereo = {.eye_separation = 1e-9}});
  Renderer mono(device, scene, {.width = 256, .height = 192});
  const Picture one = draw(mono, camera);
  const Picture left = draw(stereo, camera);
  const Picture right = view::read_picture(device, stereo.image(), 1);
  EXPECT_TRUE(tests::compare(one, left).passes()) << tests::compare(one, left).text();
  EXPECT_TRUE(tests::compare(one, right).passes()) << tests::compare(one, right).text();
}

TEST_F(Room, WhatAnEyeSeesIsNotInTheOther) {
  // Lamp, table and drape reach beyond the picture: what is clipped must not end up in the other eye.
  const auto camera = room_layout(scene).standing_camera();
  const auto eye = [&](double side) {
    const Eigen::Vector3d back = (camera.eye - camera.look_at).normalized();
    const Eigen::Vector3d right = camera.up.cross(back).normalized();
    EyeView view{.left = -0.3, .right = 0.3, .up = 0.3, .down = -0.3};
    view.patient_from_eye = Eigen::Isometry3d::Identity();
    view.patient_from_eye.linear() << right, back.cross(right), back;
    view.patient_from_eye.translation() = camera.eye + side * right;
    return view;
  };
  const std::array eyes{eye(-0.25), eye(0.25)};
  Renderer stereo(device, scene, {.width = 160, .height = 160, .views = 2});
  Renderer mono(device, scene, {.width = 160, .height = 160});
  const ViewOptions closed{.see_through = SeeThrough::closed};  // the window is cut between the eyes
  stereo.render(state, eyes, closed);
  for (std::uint32_t side = 0; side < 2; ++side) {
    mono.render(state, std::span(&eyes[side], 1), closed);
    const auto difference =
        tests::compare(view::read_picture(device, mono.image(), 0), view::read_picture(device, stereo.image(), side));
    EXPECT_TRUE(difference.passes()) << side << ": " << difference.text();
  }
}

TEST_F(Room, ClothHidesLabelsAndHasNone) {
  Renderer renderer(device, scene, {.width = 160, .height = 160});
  state.needle_positions.clear();
  state.needle_orientations.clear();
  state.probe_position = {0, 0, 10};
  renderer.render(state, at_field(renderer.layout(), 0.6), {.see_through = SeeThrough::closed});
  const ViewLabels view = renderer.read_labels();
  const auto skin = std::count(view.labels.begin(), view.labels.end(), std::uint8_t{1});
  const auto none = std::count(view.labels.begin(), view.labels.end(), std::uint8_t{0});
  EXPECT_GT(skin, 160 * 160 / 100);
  EXPECT_GE(skin + none, 160 * 160 - 4)
      << "in the field skin (with a hole at the pole of its mesh), round it nothing";
  EXPECT_EQ(view.labels[80 * 160 + 80], 1);
}

// Where the patient's surfaces leave a gap one sees skin, not his inside; seen through, he is what he is.
TEST_F(Room, AGapInTheSkinShowsSkin) {
  state.needle_positions.clear();
  state.needle_orientations.clear();
  state.probe_position = {0, 0, 10};
  const RoomLayout layout = room_layout(scene);
  const content::Camera camera = at_field(layout, 0.6);
  const auto in_the_middle = [&](SeeThrough see_through) {
    Renderer renderer(device, scene, {.width = 160, .height = 160});
    renderer.render(state, camera, {.see_through = see_through});
    const ViewLabels view = renderer.read_labels();
    return std::pair(int{view.labels[80 * 160 + 80]}, kDepthUnit * static_cast<double>(view.depth[80 * 160 + 80]));
  };
  const double whole = in_the_middle(SeeThrough::closed).second;
  for (content::Surface& surface : scene.surfaces) {
    if (scene.tissues[surface.tissue].name != kSkin) continue;
    std::vector<std::uint32_t> kept;
    for (std::size_t t = 0; t + 2 < surface.indices.size(); t += 3) {
      const Vector3d at = surface.positions[surface.indices[t]].cast<double>();
      const Vector3d way = (camera.look_at - camera.eye).normalized(), from_eye = at - camera.eye;
      if ((from_eye - from_eye.dot(way) * way).norm() < 0.02) continue;
      kept.insert(kept.end(), surface.indices.begin() + static_cast<std::ptrdiff_t>(t),
                  surface.indices.begin() + static_cast<std::ptrdiff_t>(t) + 3);
    }
    EXPECT_LT(kept.size(), surface.indices.size());
    surface.indices = kept;
  }
  const auto [label, depth] = in_the_middle(SeeThrough::closed);
  EXPECT_EQ(label, 1);
  EXPECT_NEAR(depth, whole, 0.012);
  EXPECT_NE(in_the_middle(SeeThrough::glass).first, 1);
  const Geometry geometry(scene, &layout);
  ASSERT_EQ(geometry.lining.size(), 1U);
  EXPECT_TRUE(Geometry(scene).lining.empty()) << "without a room";
}

TEST_F(Room, DrawsTheTestSceneInItsRoom) {
  if (const auto why = tests::no_golden_for(device.identity())) GTEST_SKIP() << *why;
  Renderer renderer(device, scene, {.width = 320, .height = 180});
  EXPECT_TRUE(
      tests::matches_golden(device.identity(), draw(renderer, renderer.layout().standing_camera()), "render_room"));
}

}  // namespace
}  // namespace stylet::render
