#include "tools/make_patient/patient.h"

#include "tools/make_patient/anatomy.h"
#include "tools/make_patient/contour.h"
#include "tools/make_patient/sheet.h"
#include "tools/make_patient/torso.h"

#include <nlohmann/json.hpp>

#include <cmath>

namespace stylet::patient {
namespace {

Eigen::AlignedBox3d box(const Vector3& low, const Vector3& high) {
  return {low, high};
}

mesh::TriangleMesh vena_cava_surface() {
  std::vector<Ring> rings;
  constexpr int kRings = 40;
  const double bottom = -114.0_mm;
  const double top = 70.0_mm;
  for (int i = 0; i <= kRings; ++i) {
    const double y = bottom + (top - bottom) * (0.5 - 0.5 * std::cos(radians(180.0 * i / kRings)));
    const double cap = std::min({1.0, (y - bottom) / 10.0_mm, (top - y) / 10.0_mm});
    const double end = std::max(0.15, std::sqrt(1 - (1 - cap) * (1 - cap)));
    rings.push_back({anatomy::vena_cava_centre(y), Vector3(0, 0, end * 9.0_mm), Vector3(end * 12.0_mm, 0, 0)});
  }
  return tube(rings, 28);
}

mesh::TriangleMesh vessel_surface(const std::vector<VesselSegment>& segments, int triangles) {
  const VesselTree tree(segments, 1.2_mm);
  const auto solid = [&](const Vector3& x) { return std::max(tree(x), 0.25_mm - anatomy::vena_cava(x)); };
  return contour(solid, tree.bounds(), 1.25_mm, triangles);
}

Eigen::Quaterniond frame(const Vector3& lateral, const Vector3& into_body) {
  Eigen::Matrix3d axes;
  axes.col(2) = into_body.normalized();
  axes.col(1) = axes.col(2).cross(lateral).normalized();
  axes.col(0) = axes.col(1).cross(axes.col(2));
  return Eigen::Quaterniond(axes);
}

}  // namespace

std::vector<Organ> make_organs() {
  const std::string wall = "abdominal_wall";
  const std::string liver = "liver";
  std::vector<Organ> organs;
  organs.push_back({"peritoneal_fat", "region", "peritoneal_fat", "",
                    contour(anatomy::peritoneal_space, box(mm(-150, -120, -110), mm(90, 95, 90)), 11.0_mm, 4000)});
  organs.push_back({"lung_right", "region", "outside", "",
                    contour(anatomy::lung, box(mm(-150, 10, -110), mm(90, 95, 90)), 5.0_mm, 6000)});
  organs.push_back({"intercostal_muscle", "region", "muscle", "", torso::intercostal_muscle()});
  organs.push_back({wall, "boundary", "muscle", wall, torso::wall_layer(0)});
  organs.push_back({"skin", "region", "skin", wall, torso::wall_layer(0, torso::kSkinEnd)});
  organs.push_back({"fat", "region", "fat", wall, torso::wall_layer(torso::kSkinEnd, torso::kFatEnd)});
  organs.push_back({"muscle", "region", "muscle", wall, torso::wall_layer(torso::kFatEnd)});
  for (int rib = torso::kFirstRib; rib <= torso::kLastRib; ++rib) {
    organs.push_back({"rib_right_" + std::to_string(rib), "boundary", "bone", "", torso::rib(rib)});
  }
  organs.push_back({"costal_cartilage", "boundary", "cartilage", "", torso::costal_cartilage()});
  organs.push_back({"diaphragm", "boundary", "diaphragm", "", torso::diaphragm()});
  organs.push_back({"kidney_right", "boundary", "kidney_cortex", "",
                    contour(anatomy::kidney, box(mm(-125, -125, -95), mm(-10, 10, 0)), 4.5_mm)});
  organs.push_back({"kidney_sinus_right", "region", "kidney_sinus", "",
                    contour(anatomy::kidney_sinus, box(mm(-125, -125, -95), mm(-10, 10, 0)), 3.2_mm)});
  organs.push_back({"inferior_vena_cava", "vessel", "caval_blood", "", vena_cava_surface()});
  organs.push_back({liver, "boundary", "liver", liver,
                    contour(anatomy::liver, box(mm(-140, -120, -98), mm(78, 85, 84)), 3.2_mm, 15000)});
  organs.push_back({"gallbladder", "region", "gallbladder_wall", liver,
                    contour(anatomy::gallbladder, box(mm(-70, -90, -5), mm(-15, -5, 75)), 3.2_mm)});
  organs.push_back({"gallbladder_lumen", "region", "bile", liver,
                    contour([](const Vector3& x) { return anatomy::gallbladder(x) + anatomy::kGallbladderWall; },
                            box(mm(-70, -90, -5), mm(-15, -5, 75)), 3.2_mm)});
  const anatomy::LiverVessels vessels = anatomy::liver_vessels();
  organs.push_back({"portal_vein", "vessel", "portal_blood", liver, vessel_surface(vessels.portal, 15000)});
  Organ hepatic{"hepatic_veins", "vessel", "hepatic_blood", liver,
                vessel_surface(vessels.middle_left_hepatic, 10000)};
  append(hepatic.mesh, vessel_surface(vessels.right_hepatic, 7000));
  organs.push_back(std::move(hepatic));
  organs.push_back({"tumour", "target", "tumour", liver, tumour_surface()});
  return organs;
}

std::vector<std::byte> patient_glb(const gltf::TissueColours& colours) {
  return gltf::write_glb(
      make_organs(), colours,
      {.generator = "stylet-make-patient", .copyright = "Apache-2.0, Stylet contributors", .scene = "abdomen"});
}

mesh::TriangleMesh tumour_surface() {
  const Vector3 reach = Vector3::Constant(15.0_mm);
  return contour(anatomy::tumour, {anatomy::tumour_centre() - reach, anatomy::tumour_centre() + reach}, 2.2_mm);
}

Procedure make_procedure() {
  Procedure procedure;
  procedure.entry = torso::intercostal_skin_point(anatomy::kNeedleSpace, anatomy::kEntryAngle);
  procedure.target = anatomy::tumour_centre();
  procedure.target_radius = anatomy::kTumourRadius;

  // In the intercostal plane, face on the skin, beam along the skin's normal within the plane; the needle comes from
  // the front, image left.
  const Vector3 plane = torso::intercostal_plane_normal();
  const Vector3 intercostal = torso::intercostal_skin_point(anatomy::kNeedleSpace, anatomy::kProbeAngle);
  Vector3 inward = -torso::normal(anatomy::kProbeAngle, intercostal.y());
  inward = (inward - inward.dot(plane) * plane).normalized();
  procedure.views.push_back({"intercostal",
                             "liver, tumour, needle in plane, hepatic veins, vena cava, upper pole of the kidney",
                             intercostal, frame(plane.cross(inward), inward)});

  // Sagittal below the costal margin, tilted up a little: liver against kidney (Morison's pouch). Image left is
  // cranial.
  const Vector3 lateral_skin = torso::point(131, -66.0_mm, 0);
  const Vector3 to_kidney = (mm(-66, -46, -50) - lateral_skin).normalized();
  procedure.views.push_back(
      {"liver_kidney", "liver, right kidney, diaphragm", lateral_skin, frame(Vector3(0, -1, 0), to_kidney)});

  // Oblique under the costal margin through the gallbladder towards the porta hepatis.
  const Vector3 subcostal_skin = torso::point(108, -60.0_mm, 0);
  const Vector3 to_porta = (mm(-28, -8, 4) - subcostal_skin).normalized();
  const Vector3 along_gallbladder = (mm(-26, -20, 10) - mm(-47, -64, 50)).normalized();
  const Vector3 view_normal = to_porta.cross(along_gallbladder).normalized();
  procedure.views.push_back({"subcostal_gallbladder", "gallbladder along its length, portal vein", subcostal_skin,
                             frame(view_normal.cross(to_porta), to_porta)});
  return procedure;
}

std::string procedure_json(const Procedure& procedure, const std::string& organs, const std::string& target) {
  const auto triple = [](const Vector3& x) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (int axis = 0; axis < 3; ++axis) list.push_back(std::round(x[axis] * 1e6) / 1e6);
    return list;
  };
  nlohmann::ordered_json json;
  json["format"] = "stylet-procedure";
  json["version"] = 1;
  json["organs"] = organs;
  json["entry"] = triple(procedure.entry);
  json["target"] = {{"name", target},
                    {"centre", triple(procedure.target)},
                    {"radius", std::round(procedure.target_radius * 1e6) / 1e6}};
  json["needle_direction"] = triple((procedure.target - procedure.entry).normalized());
  json["views"] = nlohmann::ordered_json::array();
  for (const View& view : procedure.views) {
    nlohmann::ordered_json orientation = nlohmann::ordered_json::array();
    for (const double q : {view.orientation.x(), view.orientation.y(), view.orientation.z(), view.orientation.w()}) {
      orientation.push_back(std::round(q * 1e6) / 1e6);
    }
    json["views"].push_back({{"name", view.name},
                             {"shows", view.shows},
                             {"position", triple(view.position)},
                             {"orientation_xyzw", orientation}});
  }
  return json.dump(2) + "\n";
}

}  // namespace stylet::patient
