// Biopsy: cores by a spring-loaded side-notch needle.
#pragma once

#include "engine/procedures/interface/procedure.h"

namespace stylet::procedures::biopsy {

const Kind& kind();

}  // namespace stylet::procedures::biopsy
