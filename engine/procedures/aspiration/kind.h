// Aspiration: a cyst is emptied through the needle by a syringe.
#pragma once

#include "engine/procedures/interface/procedure.h"

namespace stylet::procedures::aspiration {

const Kind& kind();

}  // namespace stylet::procedures::aspiration
