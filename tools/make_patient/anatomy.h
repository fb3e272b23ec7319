// The solid organs of the default patient, as implicit functions: negative inside, about metres near the surface.
// Patient frame: +X left, +Y superior, +Z anterior; the origin lies in the middle of the trunk at the porta hepatis.
#pragma once

#include "tools/make_patient/implicit.h"
#include "tools/make_patient/vessels.h"

namespace stylet::patient::anatomy {

double liver(const Vector3& x);
double gallbladder(const Vector3& x);  ///< outer surface of the wall
double kidney(const Vector3& x);
double kidney_sinus(const Vector3& x);
double vena_cava(const Vector3& x);  ///< without ends
double tumour(const Vector3& x);
double peritoneal_space(const Vector3& x);
/// The right lung, over the diaphragm, whose sheet it reaches into.
double lung(const Vector3& x);

inline constexpr double kGallbladderWall = 2.0_mm;
inline constexpr double kTumourRadius = 11.3_mm;
inline constexpr int kNeedleSpace = 9;      ///< needle and probe work in the space below this rib
inline constexpr double kEntryAngle = 123;  ///< around the trunk, see torso.h
inline constexpr double kProbeAngle = 158;
Vector3 tumour_centre();
Vector3 vena_cava_centre(double y);

/// The vessels inside the liver. The hepatic veins come in two parts that open into the vena cava.
struct LiverVessels {
  std::vector<VesselSegment> portal;
  std::vector<VesselSegment> right_hepatic;
  std::vector<VesselSegment> middle_left_hepatic;
};
LiverVessels liver_vessels();

}  // namespace stylet::patient::anatomy
