// A picture of an imported scenario to judge it by: cuts through tissues and tetrahedra, with needle and probe.
#pragma once

#include "engine/content/scene.h"
#include "engine/import/scene_import.h"
#include "engine/picture/picture.h"

namespace stylet::import {

/// Four cuts through the target: axial (seen from the feet, the patient's right on the left, the front up), coronal
/// (from the front), sagittal (from the left), and the plane of the ultrasound image. Labels in the colours of their
/// tissues, edges of the tetrahedra, the planned needle and the probe's face. Drawn on the CPU; the same scene gives
/// the same pixels.
picture::Picture scene_picture(const ImportedScene& imported, const content::Scene& scene, int panel = 620);

}  // namespace stylet::import
