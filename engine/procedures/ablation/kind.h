// Ablation: tissue destroyed by the heat of a radio-frequency electrode.
#pragma once

#include "engine/procedures/interface/procedure.h"

namespace stylet::procedures::ablation {

const Kind& kind();

}  // namespace stylet::procedures::ablation
