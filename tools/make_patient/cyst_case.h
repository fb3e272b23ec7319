// A simple cyst for the default patient, in the right lobe of the liver, and the way to it.
#pragma once

#include "tools/make_patient/patient.h"

namespace stylet::patient {

/// Its surface, to be put after those of the patient.
std::vector<Organ> make_cyst();

/// Needle and probe work in the space between the ribs 9 and 10: the needle from the side, image right.
Procedure make_cyst_procedure();

}  // namespace stylet::patient
