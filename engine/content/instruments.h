// Needle and probe files (content/README.md, "stylet-needle" and "stylet-probe").
#pragma once

#include "engine/content/json_reader.h"
#include "engine/content/scene.h"

namespace stylet::content {

/// Problems go to `file`; what comes out is in range even then.
Needle read_needle(JsonFile& file);

/// The probe without its pose, which the scenario gives.
Probe read_probe(JsonFile& file);

}  // namespace stylet::content
