// A second tumour for the default patient, small and beside the right hepatic vein, and the way to it.
#pragma once

#include "tools/make_patient/patient.h"

namespace stylet::patient {

/// Its surface, to be put after those of the patient.
std::vector<Organ> make_ablation_tumour();

/// Needle and probe work in the space between the ribs 8 and 9: the needle from behind, image right.
Procedure make_ablation_procedure();

}  // namespace stylet::patient
