#include "tools/make_patient/anatomy.h"

#include "tools/make_patient/torso.h"

#include <array>
#include <cmath>

namespace stylet::patient::anatomy {
namespace {

// Height of the liver's visceral surface: lowest at the anterior inferior edge, rising to the back and to the left,
// hollow around the porta hepatis.
double visceral_height(const Vector3& x) {
  const double edge = -26.0_mm + 0.56 * x.x();
  const double rise = 0.24 + 0.30 * smoothstep(-85.0_mm, -15.0_mm, x.x());
  const double dx = (x.x() + 20.0_mm) / 34.0_mm;
  const double dz = (x.z() - 4.0_mm) / 30.0_mm;
  return edge + rise * (71.0_mm - x.z()) + 7.0_mm * std::exp(-dx * dx - dz * dz);
}

struct KidneyFrame {
  Vector3 along;  // to the upper pole
  Vector3 hilum;  // medial and a little anterior
  Vector3 across;
};

KidneyFrame kidney_frame() {
  KidneyFrame frame;
  frame.along = Vector3(0.22, 0.95, -0.20).normalized();
  const Vector3 medial(1, 0, 0.35);
  frame.hilum = (medial - medial.dot(frame.along) * frame.along).normalized();
  frame.across = frame.along.cross(frame.hilum);
  return frame;
}

// Coordinates along the bent axis, across, and towards the hilum.
Vector3 kidney_coordinates(const Vector3& x) {
  static const KidneyFrame frame = kidney_frame();
  const Vector3 p = x - mm(-66, -58, -50);
  const double along = p.dot(frame.along);
  return {along, p.dot(frame.across), p.dot(frame.hilum) - along * along / (2 * 95.0_mm)};
}

}  // namespace

Vector3 tumour_centre() {
  return {-89.0_mm, torso::intercostal_height(kNeedleSpace, 17.0_mm), 17.0_mm};
}

Vector3 vena_cava_centre(double y) {
  return {-22.0_mm + 3.0_mm * std::sin(y / 60.0_mm), y, -29.0_mm + 2.0_mm * std::cos(y / 45.0_mm)};
}

double vena_cava(const Vector3& x) {
  const Vector3 p = x - vena_cava_centre(x.y());
  const double a = 12.0_mm;
  const double b = 9.0_mm;
  const double k0 = std::hypot(p.x() / a, p.z() / b);
  const double k1 = std::hypot(p.x() / (a * a), p.z() / (b * b));
  return k1 > 0 ? k0 * (k0 - 1) / k1 : -b;
}

double gallbladder(const Vector3& x) {
  // Pear on a gently bent axis from the fundus, at the liver's edge, to the neck at the porta hepatis.
  struct Knot {
    Vector3 centre;
    double radius;
  };
  static const std::array<Knot, 7> axis{{{mm(-48, -57, 51), 12.0_mm},
                                         {mm(-46, -53, 46), 14.5_mm},
                                         {mm(-43, -46, 39), 15.5_mm},
                                         {mm(-39, -37, 31), 14.0_mm},
                                         {mm(-35, -28, 23), 10.5_mm},
                                         {mm(-31, -20, 15), 7.0_mm},
                                         {mm(-26, -13, 9), 4.0_mm}}};
  double d = 1;
  for (std::size_t i = 0; i + 1 < axis.size(); ++i) {
    d = smooth_min(d, round_cone(x, axis[i].centre, axis[i + 1].centre, axis[i].radius, axis[i + 1].radius), 2.0_mm);
  }
  return d;
}

double kidney(const Vector3& x) {
  const Vector3 p = kidney_coordinates(x + waves(x, 0.8_mm, 45.0_mm));
  const double body = ellipsoid(p, Vector3::Zero(), mm(55, 22, 27));
  return smooth_cut(body, ellipsoid(p, mm(0, 0, 33), mm(15, 9, 15)), 6.0_mm);
}

double kidney_sinus(const Vector3& x) {
  const Vector3 p = kidney_coordinates(x);
  double d = ellipsoid(p, mm(0, 0, 8), mm(24, 8, 12));
  for (const double along : {-24.0, -9.0, 9.0, 24.0}) {  // calyces
    d = smooth_min(d, round_cone(p, mm(0.55 * along, 0, 6), mm(along, 0, -6 + 0.012 * along * along), 6.0_mm, 4.0_mm),
                   5.0_mm);
  }
  return smooth_max(d, kidney(x) + 0.6_mm, 1.5_mm);
}

double tumour(const Vector3& x) {
  const Vector3 p = x - tumour_centre();
  const double r = p.norm();
  if (r < 1e-9) return -kTumourRadius;
  const Vector3 n = p / r;
  const double bumps = 0.045 * std::sin(3.1 * n.x() + 2.2 * n.y() + 0.4) +
                       0.035 * std::sin(4.3 * n.z() - 2.7 * n.x()) + 0.02 * std::sin(7.0 * n.y() + 3.0 * n.z());
  return r - kTumourRadius * (1 + bumps);
}

double liver(const Vector3& point) {
  const Vector3 x = point + waves(point, 1.3_mm, 90.0_mm);
  // The diaphragm shapes the liver from above, at the sides and behind; nothing of it is warped away from it.
  double d = torso::subphrenic(point);
  const double rise = 0.55;
  const double visceral = (visceral_height(x) - x.y()) / std::sqrt(1 + 0.57 * 0.57 + rise * rise);
  d = smooth_max(d, visceral, 6.5_mm);
  // Spine with crura and aorta behind, stomach under the left lobe.
  d = smooth_cut(d, std::hypot(x.x() - 10.0_mm, x.z() + 74.0_mm) - 47.0_mm, 10.0_mm);
  d = smooth_cut(d, sphere(x, mm(66, 0, -42), 54.0_mm), 10.0_mm);
  // Fissure of the ligamentum teres between the left lateral and medial sections.
  d = smooth_cut(d, round_cone(x, mm(12, -24, 70), mm(4, 8, 26), 5.0_mm, 3.0_mm), 5.0_mm);
  // Neighbours press into it.
  d = smooth_cut(d, kidney(point) - 2.5_mm, 5.0_mm);
  d = smooth_cut(d, gallbladder(point) - 1.0_mm, 3.0_mm);
  return smooth_cut(d, vena_cava(point) - 1.2_mm, 3.0_mm);
}

double peritoneal_space(const Vector3& x) {
  const double box = std::max({x.x() - 80.0_mm, x.y() - 92.0_mm, -117.0_mm - x.y(), -98.0_mm - x.z()});
  return smooth_max(torso::inner_distance(x, 23.0_mm), box, 8.0_mm);
}

double lung(const Vector3& x) {
  constexpr double kInDiaphragm = 3.0_mm;  // the middle of its sheet, 1.3 to 4.8 mm over the subphrenic space
  constexpr double kBase = 15.0_mm;        // quiet breathing leaves the recess beside the liver empty
  return std::max({peritoneal_space(x), kInDiaphragm - torso::subphrenic(x), kBase - x.y()});
}

LiverVessels liver_vessels() {
  struct Trunk {
    std::vector<Vector3> knots;
    std::vector<double> radii;
    bool grows = true;
  };
  // Portal vein: main trunk, then right (anterior and posterior sections) and left (to the umbilical part).
  const std::array<Trunk, 5> portal{{
      {{mm(2, -22, -16), mm(-13, 0, -9), mm(-25, 14, -3)}, {6.2_mm, 6.0_mm, 5.6_mm}, false},
      {{mm(-25, 14, -3), mm(-38, 18, 0), mm(-50, 17, 2)}, {5.0_mm, 4.7_mm, 4.5_mm}, false},
      {{mm(-50, 17, 2), mm(-60, 17, 10), mm(-70, 13, 18)}, {3.8_mm, 3.6_mm, 3.4_mm}},
      {{mm(-50, 17, 2), mm(-62, 13, -10), mm(-73, 7, -26)}, {3.7_mm, 3.5_mm, 3.3_mm}},
      {{mm(-25, 14, -3), mm(-12, 24, 3), mm(2, 28, 14), mm(12, 25, 30)}, {4.4_mm, 4.0_mm, 3.6_mm, 3.0_mm}},
  }};
  const Trunk right_hepatic{{mm(-26, 54, -28), mm(-40, 50, -20), mm(-62, 39, -10), mm(-88, 16, 0)},
                            {4.8_mm, 4.4_mm, 3.6_mm, 2.9_mm}};
  const std::array<Trunk, 2> middle_left{{
      {{mm(-20, 56, -26), mm(-22, 52, -12), mm(-34, 40, 10), mm(-48, 22, 32)}, {5.0_mm, 4.6_mm, 3.7_mm, 2.9_mm}},
      {{mm(-22, 52, -12), mm(-8, 49, -2), mm(8, 44, 10), mm(20, 39, 20)}, {3.8_mm, 3.4_mm, 3.0_mm, 2.5_mm}},
  }};

  LiverVessels vessels;
  std::vector<Vector3> portal_tangents;
  portal_tangents.reserve(portal.size());
  for (const Trunk& t : portal) portal_tangents.push_back(add_trunk(vessels.portal, t.knots, t.radii));
  const Vector3 right_tangent = add_trunk(vessels.right_hepatic, right_hepatic.knots, right_hepatic.radii);
  std::vector<Vector3> middle_tangents;
  middle_tangents.reserve(middle_left.size());
  for (const Trunk& t : middle_left) {
    middle_tangents.push_back(add_trunk(vessels.middle_left_hepatic, t.knots, t.radii));
  }

  const Vector3 entry = torso::intercostal_skin_point(kNeedleSpace, kEntryAngle);
  const Vector3 target = tumour_centre();
  // Room besides what any vessel must keep from: capsule, gallbladder, tumour, the needle's path, other vessels.
  const auto clear_of = [&](const std::vector<const std::vector<VesselSegment>*>& others) {
    return [&, others](const Vector3& x, double radius) {
      double room = -liver(x) - radius;
      room = std::min(room, tumour(x) - radius);
      room = std::min(room, round_cone(x, entry, target, 5.0_mm, 5.0_mm) - radius + 2.0_mm);
      for (const auto* tree : others) {
        for (const VesselSegment& s : *tree) {
          room = std::min(room, round_cone(x, s.a, s.b, s.radius_a, s.radius_b) - radius);
        }
      }
      return room;
    };
  };
  const GrowthRule rule;
  const Clearance portal_clearance = clear_of({&vessels.right_hepatic, &vessels.middle_left_hepatic});
  for (std::size_t i = 0; i < portal.size(); ++i) {
    if (!portal[i].grows) continue;
    grow(vessels.portal, portal[i].knots.back(), portal_tangents[i], portal[i].radii.back(), rule, portal_clearance);
  }
  for (std::size_t i = 1; i < portal.size(); ++i) {
    grow_sides(vessels.portal, portal[i].knots, portal[i].radii, rule, portal_clearance);
  }
  const Clearance right_clearance = clear_of({&vessels.portal, &vessels.middle_left_hepatic});
  grow(vessels.right_hepatic, right_hepatic.knots.back(), right_tangent, right_hepatic.radii.back(), rule,
       right_clearance);
  grow_sides(vessels.right_hepatic, right_hepatic.knots, right_hepatic.radii, rule, right_clearance);
  const Clearance middle_clearance = clear_of({&vessels.portal, &vessels.right_hepatic});
  for (std::size_t i = 0; i < middle_left.size(); ++i) {
    grow(vessels.middle_left_hepatic, middle_left[i].knots.back(), middle_tangents[i], middle_left[i].radii.back(),
         rule, middle_clearance);
  }
  for (const Trunk& t : middle_left) {
    grow_sides(vessels.middle_left_hepatic, t.knots, t.radii, rule, middle_clearance);
  }
  return vessels;
}

}  // namespace stylet::patient::anatomy
