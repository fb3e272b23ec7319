#include "tools/make_patient/ablation_case.h"

#include "tools/make_patient/contour.h"
#include "tools/make_patient/torso.h"

namespace stylet::patient {
namespace {

constexpr int kSpace = 8;
constexpr double kEntryAngle = 151;
constexpr double kProbeAngle = 118;
constexpr double kRadius = 8.0_mm;

/// 12 mm from the wall of the right hepatic vein, which is 6 mm wide there.
Vector3 centre() {
  return {-78.0_mm, torso::intercostal_height(kSpace, 4.0_mm), 4.0_mm};
}

double tumour(const Vector3& x) {
  const Vector3 n = (x - centre()).normalized();
  return sphere(x, centre(),
                kRadius * (1 + 0.05 * std::sin(3.3 * n.x() + 1.9 * n.y()) + 0.04 * std::sin(4.1 * n.z())));
}

}  // namespace

std::vector<Organ> make_ablation_tumour() {
  const Vector3 reach = Vector3::Constant(kRadius + 4.0_mm);
  return {{"ablation_tumour", "target", "tumour", "liver",
           contour(tumour, {centre() - reach, centre() + reach}, 1.8_mm)}};
}

Procedure make_ablation_procedure() {
  Procedure procedure;
  procedure.entry = torso::intercostal_skin_point(kSpace, kEntryAngle);
  procedure.target = centre();
  procedure.target_radius = kRadius;
  const Vector3 plane = torso::intercostal_plane_normal();
  const Vector3 skin = torso::intercostal_skin_point(kSpace, kProbeAngle);
  Vector3 inward = centre() - skin;
  inward = (inward - inward.dot(plane) * plane).normalized();
  Eigen::Matrix3d axes;
  axes.col(2) = inward;
  axes.col(1) = plane;
  axes.col(0) = axes.col(1).cross(axes.col(2));
  procedure.views.push_back(
      {"intercostal", "liver, tumour, right hepatic vein, electrode in plane", skin, Eigen::Quaterniond(axes)});
  return procedure;
}

}  // namespace stylet::patient
