// A picture of an imported organ to judge it by: its surface, and a cut through its tetrahedra.
#pragma once

#include "engine/import/organ_import.h"
#include "engine/picture/picture.h"

namespace stylet::import {

/// Left: the surface from the front (patient's right on the left, head up). Right: the tetrahedra behind a frontal
/// plane through the middle, edges drawn, the cut ones coloured by their smallest dihedral angle (red: 12 degrees and
/// less, green: 45 and more). With scale and figures. Drawn on the CPU; the same organ gives the same pixels.
picture::Picture organ_picture(const ImportedOrgan& organ, int width = 1400, int height = 700);

}  // namespace stylet::import
