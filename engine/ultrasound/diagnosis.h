// Why an ultrasound image is black: told in one line to whoever looks at it.
#pragma once

#include "engine/ultrasound/scan_model.h"

#include <string>

namespace stylet::ultrasound {

/// What hides the patient from the image of the model's last update(): no contact, a probe or patient in wrong units,
/// turned away or elsewhere, bone or gas in front of everything, nothing that scatters, too little gain. One line
/// with what to do; empty: the image shows something. Follows some of the scan lines through the tissues, without
/// echoes.
std::string diagnose(const ScanModel& model);

}  // namespace stylet::ultrasound
