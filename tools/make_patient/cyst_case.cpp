#include "tools/make_patient/cyst_case.h"

#include "tools/make_patient/contour.h"
#include "tools/make_patient/torso.h"

#include <cmath>

namespace stylet::patient {
namespace {

constexpr int kCystSpace = 9;
constexpr double kCystEntryAngle = 172;
constexpr double kCystProbeAngle = 148;
const Vector3 kCystHalfAxes = mm(21.5, 24.0, 21.5);

/// Where the vessels of the right lobe, 22 mm away on three sides, leave most room: nothing is crossed on the way.
Vector3 cyst_centre() {
  return {-98.0_mm, torso::intercostal_height(kCystSpace, -27.0_mm), -27.0_mm};
}

double cyst(const Vector3& x) {
  return ellipsoid(x, cyst_centre(), kCystHalfAxes);
}

}  // namespace

std::vector<Organ> make_cyst() {
  const Vector3 reach = kCystHalfAxes + Vector3::Constant(4.0_mm);
  return {{"cyst", "target", "cyst_fluid", "liver",
           contour(cyst, {cyst_centre() - reach, cyst_centre() + reach}, 2.4_mm)}};
}

Procedure make_cyst_procedure() {
  Procedure procedure;
  procedure.entry = torso::intercostal_skin_point(kCystSpace, kCystEntryAngle);
  procedure.target = cyst_centre();
  procedure.target_radius = std::cbrt(kCystHalfAxes.prod());
  const Vector3 plane = torso::intercostal_plane_normal();
  const Vector3 skin = torso::intercostal_skin_point(kCystSpace, kCystProbeAngle);
  Vector3 inward = cyst_centre() - skin;
  inward = (inward - inward.dot(plane) * plane).normalized();
  Eigen::Matrix3d axes;
  axes.col(2) = inward;
  axes.col(1) = plane;
  axes.col(0) = axes.col(1).cross(axes.col(2));
  procedure.views.push_back({"intercostal", "liver, cyst, needle in plane", skin, Eigen::Quaterniond(axes)});
  return procedure;
}

}  // namespace stylet::patient
