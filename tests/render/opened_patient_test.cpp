// A patient of any shape under the drape, and what the window into him shows: no device is needed.
#include "engine/render/drape_mesh.h"
#include "engine/render/room_layout.h"
#include "engine/render/room_mesh.h"
#include "engine/render/window_sides.h"
#include "physics/needle/needle.h"
#include "tests/render/test_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

namespace stylet::render {
namespace {

using Eigen::Vector3d;

/// A trunk that is no ellipse and narrows to the head, as imported patients have it: everything about it is known.
struct OtherPatient {
  static Vector3d skin(double angle, double y) {
    const double narrow = 1 - 0.9 * (y + 0.18);  // from 1 at the feet's end to 0.7
    const double square =
        std::pow(std::pow(std::abs(std::sin(angle)), 3.0) + std::pow(std::abs(std::cos(angle)), 3.0), -1.0 / 3);
    return {0.195 * narrow * square * std::sin(angle) + 0.01, y, 0.130 * narrow * square * std::cos(angle) + 0.15};
  }
  /// Where a ray from the middle at an angle from straight up meets the skin.
  static Vector3d skin_towards(double direction, double y) {
    double best = 1e9;
    Vector3d found = Vector3d::Zero();
    for (int i = 0; i < 2000; ++i) {
      const Vector3d x = skin(2 * std::numbers::pi * i / 2000, y);
      const double off =
          std::abs(std::remainder(std::atan2(x.x() - 0.01, x.z() - 0.15) - direction, 2 * std::numbers::pi));
      if (off < best) best = off, found = x;
    }
    return found;
  }
  static constexpr double kFrom = -0.18, kTo = 0.15;
  static constexpr double kEntryAngle = -1.25, kEntryY = 0.08;

  explicit OtherPatient(double entry_angle = kEntryAngle) {
    scene.room_from_patient.linear() =
        Eigen::AngleAxisd(-std::numbers::pi / 2, Vector3d::UnitX()).toRotationMatrix();  // on the back
    content::Surface surface;
    surface.name = "skin";
    surface.tissue = 1;
    surface.role = content::SurfaceRole::visual;
    constexpr int kAround = 72, kAlong = 24;
    for (int j = 0; j <= kAlong; ++j)
      for (int i = 0; i < kAround; ++i) {
        const double angle = 2 * std::numbers::pi * i / kAround, y = kFrom + (kTo - kFrom) * j / kAlong;
        surface.positions.push_back(skin(angle, y).cast<float>());
        const Vector3d round = skin(angle + 1e-3, y) - skin(angle - 1e-3, y);
        const Vector3d along = skin(angle, y + 1e-3) - skin(angle, y - 1e-3);
        surface.normals.push_back(along.cross(round).normalized().cast<float>());
      }
    for (std::uint32_t j = 0; j < kAlong; ++j)
      for (std::uint32_t i = 0; i < kAround; ++i) {
        const std::uint32_t a = j * kAround + i, b = j * kAround + (i + 1) % kAround, c = a + kAround,
                            d = b + kAround;
        surface.indices.insert(surface.indices.end(), {a, d, b, a, c, d});
      }
    scene.surfaces = {surface};
    entry = skin(entry_angle, kEntryY);
    probe = skin(entry_angle + 0.28, kEntryY - 0.03);
    const Vector3d middle(0.01, kEntryY, 0.15);
    scene.targets.front().centre = entry + 0.4 * (middle - entry);
    const Vector3d way = (middle - entry).normalized();
    scene.motion.stylus.resize(1);
    scene.motion.stylus.front().pose = {.position = entry - 0.18 * way,
                                        .orientation = physics::orientation_along(way)};
    scene.probe.pose = {.position = probe, .orientation = physics::orientation_along((middle - probe).normalized())};
    scene.camera = {.eye = entry - 0.5 * way + Vector3d(0, -0.15, 0.15),
                    .look_at = entry,
                    .up = Vector3d::UnitZ(),
                    .vertical_fov = 0.5};
  }

  content::Scene scene = tests::make_test_scene();
  Vector3d entry, probe;
};

std::vector<Eigen::Vector3f> skin_of(const OtherPatient&) {
  std::vector<Eigen::Vector3f> skin;
  for (double y = OtherPatient::kFrom; y <= OtherPatient::kTo; y += 0.004)
    for (int i = 0; i < 400; ++i) skin.push_back(OtherPatient::skin(2 * std::numbers::pi * i / 400, y).cast<float>());
  return skin;
}

/// Whether a ray meets a triangle whose front it sees.
bool meets_front(const RoomMesh& mesh, const Vector3d& from, const Vector3d& way) {
  for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
    const Vector3d a = mesh.positions[mesh.indices[t]].cast<double>();
    const Vector3d ab = mesh.positions[mesh.indices[t + 1]].cast<double>() - a;
    const Vector3d ac = mesh.positions[mesh.indices[t + 2]].cast<double>() - a;
    const Vector3d p = way.cross(ac), to = from - a, q = to.cross(ab);
    const double det = ab.dot(p);
    if (det <= 1e-15) continue;
    const double u = to.dot(p) / det, v = way.dot(q) / det;
    if (u >= -1e-9 && v >= -1e-9 && u + v <= 1 + 1e-9 && ac.dot(q) > 0) return true;
  }
  return false;
}

TEST(DrapeMesh, LiesOnTheSkinOfAPatientOfAnyShapeWithTheFieldOverEntryAndProbe) {
  const OtherPatient patient;
  const RoomLayout layout = room_layout(patient.scene);
  const std::vector<Eigen::Vector3f> skin = skin_of(patient);
  const RoomMesh drape = room_meshes(layout, skin).drape;
  Vector3d middle = Vector3d::Zero();
  double nearest_middle = 1;
  int in_field = 0;
  for (std::size_t i = 0; i < drape.positions.size(); ++i) {
    const Eigen::Vector2d at(drape.coordinates[i][0], drape.coordinates[i][1]);
    if ((at.cwiseAbs().array() > layout.field_half.array()).any()) continue;
    ++in_field;
    const Eigen::Vector3f cloth = (layout.patient_from_table * drape.positions[i].cast<double>()).cast<float>();
    float distance = 1;
    for (const Eigen::Vector3f& p : skin) distance = std::min(distance, (p - cloth).norm());
    EXPECT_LT(distance, 0.014F) << at.transpose();
    if (at.norm() < nearest_middle) nearest_middle = at.norm(), middle = cloth.cast<double>();
  }
  EXPECT_GT(in_field, 15);
  for (const Eigen::Vector3f& p : room_meshes(layout, skin).cavity.positions) {
    const Vector3d at = layout.patient_from_table * p.cast<double>();
    if (at.y() < OtherPatient::kFrom || at.y() > OtherPatient::kTo) continue;
    const double angle = std::atan2(at.x() - 0.01, at.z() - 0.15);
    const Vector3d on = OtherPatient::skin_towards(angle, at.y());
    EXPECT_LT(std::hypot(at.x() - 0.01, at.z() - 0.15), std::hypot(on.x() - 0.01, on.z() - 0.15) - 0.004)
        << "below the skin";
  }
  EXPECT_LT((middle - 0.5 * (patient.entry + patient.probe)).norm(), 0.020);
  for (const Vector3d& site : {patient.entry, patient.probe}) {
    const Vector3d at = layout.patient_from_table.inverse() * site;
    EXPECT_LT(layout.outside_field(layout.trunk_angle(at), at.y()), -0.025) << "open skin round it";
  }
}

// Down the flank the field ends where the cloth leaves the skin: what hangs beside the table stays whole.
TEST(DrapeMesh, IsOpenOnTheSkinOnlyHoweverLowOneGoesIn) {
  for (const double entry_angle : {-1.5, -1.75, -2.0, 1.5}) {
    const OtherPatient patient(entry_angle);
    const RoomLayout layout = room_layout(patient.scene);
    const std::vector<Eigen::Vector3f> skin = skin_of(patient);
    const RoomMesh drape = room_meshes(layout, skin).drape;
    int open = 0;
    for (std::size_t i = 0; i < drape.positions.size(); ++i) {
      const Eigen::Vector2d at(drape.coordinates[i][0], drape.coordinates[i][1]);
      if ((at.cwiseAbs().array() > layout.field_half.array()).any()) continue;
      ++open;
      const Eigen::Vector3f cloth = (layout.patient_from_table * drape.positions[i].cast<double>()).cast<float>();
      float distance = 1;
      for (const Eigen::Vector3f& p : skin) distance = std::min(distance, (p - cloth).norm());
      EXPECT_LT(distance, 0.014F) << at.transpose();
    }
    EXPECT_GT(open, 5);
    // The opening is cut by the coordinates between the vertices, too: they go on round the patient without a jump.
    for (std::size_t t = 0; t + 2 < drape.indices.size(); t += 3)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto a = drape.indices[t + k], b = drape.indices[t + (k + 1) % 3];
        EXPECT_LT(std::abs(drape.coordinates[a][0] - drape.coordinates[b][0]), 0.10F)
            << drape.positions[a].transpose();
      }
  }
}

// Out of a scan the widest place may be at the hips, low down: the back lies on the mattress for all that.
TEST(RoomLayout, AWholeTrunkLiesOnTheMattressWhereverItIsWidest) {
  OtherPatient patient;
  const double before = room_layout(patient.scene).trunk_half.y();
  for (Eigen::Vector3f& p : patient.scene.surfaces.front().positions)
    p.x() += 0.25F * (p.x() - 0.01F) * (0.15F - p.z()) / 0.13F;
  const RoomLayout layout = room_layout(patient.scene);
  double bottom = 1, top = -1;
  for (const Eigen::Vector3f& p : patient.scene.surfaces.front().positions) {
    const Vector3d at = layout.patient_from_table.inverse() * p.cast<double>();
    bottom = std::min(bottom, at.z());
    top = std::max(top, at.z());
  }
  EXPECT_NEAR(layout.trunk_half.y(), before, 0.002);
  EXPECT_NEAR(bottom, 0, 0.008);
  EXPECT_NEAR(layout.trunk_point(0, 0).z(), top, 0.001);
}

// A patient may have skin where the procedure is and nowhere else, and gaps in it: what one sees there is skin, too.
TEST(RoomMeshes, UnderTheClothThereIsSkinEverywhereAndBelowTheirs) {
  const OtherPatient patient;
  const RoomLayout layout = room_layout(patient.scene);
  const std::vector<Eigen::Vector3f> whole = skin_of(patient);
  const Eigen::Isometry3d table_from_patient = layout.patient_from_table.inverse();
  std::vector<Eigen::Vector3f> half;
  for (const Eigen::Vector3f& p : whole)
    if (layout.trunk_angle(table_from_patient * p.cast<double>()) < 0.3) half.push_back(p);
  for (const bool only_half : {false, true}) {
    const RoomMesh lining = room_meshes(layout, only_half ? half : whole).lining;
    double lowest = 0;
    for (std::size_t i = 0; i < lining.positions.size(); i += 3) {
      const Vector3d at = layout.patient_from_table * lining.positions[i].cast<double>();
      const double trunk_angle = layout.trunk_angle(lining.positions[i].cast<double>());
      if (at.y() < OtherPatient::kFrom || at.y() > OtherPatient::kTo || (only_half && trunk_angle > 0.28)) continue;
      const double angle = std::atan2(at.x() - 0.01, at.z() - 0.15);
      const Vector3d on = OtherPatient::skin_towards(angle, at.y());
      const double height = std::hypot(at.x() - 0.01, at.z() - 0.15) - std::hypot(on.x() - 0.01, on.z() - 0.15);
      EXPECT_LT(height, -0.5e-3) << "theirs is what one sees, " << angle << " " << at.y();
      lowest = std::min(lowest, height);
    }
    EXPECT_LT(lowest, -0.5e-3) << "it is there";
    EXPECT_GT(lowest, -0.012) << "no pit under a gap";
    for (double y = layout.trunk_y[0] - 0.08; y < layout.trunk_y[1] + 0.08; y += 0.04)
      for (double angle = -1.7; angle < 1.75; angle += 0.2) {
        const Vector3d centre(layout.trunk_centre.x(), y, layout.trunk_centre.y());
        const Vector3d outside = centre + 2 * (layout.trunk_point(angle, y) - centre);
        EXPECT_TRUE(meets_front(lining, outside, centre - outside)) << "angle " << angle << " y " << y;
      }
  }
}

// A patient who was cut out of a scan: what is seen there is the tissue that the scan goes through, at the cut.
TEST(RoomMeshes, TheCavityEndsWhereThePatientDoes) {
  const OtherPatient patient;
  const RoomLayout layout = room_layout(patient.scene);
  const RoomMeshes room = room_meshes(layout, skin_of(patient));
  double least = 1, most = -1;
  for (const Eigen::Vector3f& p : room.cavity.positions) {
    const double y = (layout.patient_from_table * p.cast<double>()).y();
    least = std::min(least, y);
    most = std::max(most, y);
  }
  EXPECT_NEAR(least, OtherPatient::kFrom, 1e-5);
  EXPECT_NEAR(most, OtherPatient::kTo, 1e-5);
  // The ends are closed: from the middle along the table, and from anywhere to within 2 cm of the skin.
  for (const double y : {OtherPatient::kFrom, OtherPatient::kTo}) {
    for (int i = 0; i < 24; ++i) {
      const Vector3d skin = OtherPatient::skin(0.1 + 2 * std::numbers::pi * i / 24, y), middle(0.01, y, 0.15);
      for (const double share : {0.02, 0.5, 1 - 0.02 / (skin - middle).norm()}) {
        const Vector3d end = layout.patient_from_table.inverse() * Vector3d(middle + share * (skin - middle));
        const Vector3d inside(end.x(), 0, end.z());
        EXPECT_TRUE(meets_front(room.cut, inside, end - inside)) << y << " " << i << " " << share;
      }
    }
  }
}

TEST(WindowSides, EachLineOfSightBetweenThemEndsInTheTrunk) {
  const OtherPatient patient;
  const RoomLayout layout = room_layout(patient.scene);
  const std::vector<Eigen::Vector3f> skin = skin_of(patient);
  const RoomMeshes room = room_meshes(layout, skin);
  const Vector3d focus = layout.patient_from_table.inverse() * patient.scene.targets.front().centre;
  constexpr double kRadius = 0.082;
  constexpr std::size_t kEach = std::size_t{3} * 7;  // triangle of the cloth's that is looked through
  // At the side, low at the side, from the feet, over the patient, at the head.
  for (const Vector3d& from : {Vector3d(-0.5, -0.3, 0.3), Vector3d(-0.55, 0.05, 0.02), Vector3d(-0.1, -0.6, 0.25),
                               Vector3d(0.02, 0, 0.6), Vector3d(-0.2, 0.5, 0.4)}) {
    const Vector3d eye = focus + from;
    const WindowSides sides = window_sides(layout, room.cavity.positions, eye, focus, kRadius);
    int open = 0, closed = 0, seen = 0;
    for (std::size_t t = 0; t + 2 < room.drape.indices.size(); t += kEach) {
      Vector3d on = Vector3d::Zero();
      for (std::size_t k = 0; k < 3; ++k) on += room.drape.positions[room.drape.indices[t + k]].cast<double>() / 3;
      // Where the window is, on the near side.
      const Vector3d axis = (eye - focus).normalized(), to = on - focus;
      const double along = to.dot(axis);
      if (along < -0.02 || (to - along * axis).norm() > 1.12 * kRadius) continue;
      bool between = on.y() > sides.along[0] && on.y() < sides.along[1];
      for (const Eigen::Vector4d& plane : sides.planes) {
        between = between && plane.head<3>().dot(on) + plane.w() < 0;
        EXPECT_LT(plane.head<3>().dot(focus) + plane.w(), 0) << "what the window is for";
      }
      ++seen;
      const bool ends = meets_front(room.cavity, eye, on - eye) || meets_front(room.cut, eye, on - eye);
      if (between) {
        ++open;
        EXPECT_TRUE(ends) << "from " << from.transpose() << " through " << on.transpose();
      } else {
        closed += ends ? 1 : 0;
      }
    }
    EXPECT_GT(seen, 20) << from.transpose();
    EXPECT_GT(open, 0.4 * (open + closed)) << "open where there is something to see, from " << from.transpose();
  }
}

}  // namespace
}  // namespace stylet::render
