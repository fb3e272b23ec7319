// Needle and probe files (content/README.md, "stylet-needle" and "stylet-probe").
#pragma once

#include "engine/content/scene.h"
#include "engine/files/json_reader.h"

namespace stylet::readers {

/// Their keys.
const files::FileFormat& needle_format();
const files::FileFormat& probe_format();

/// Problems go to `file`; what comes out is in range even then.
content::Needle read_needle(files::JsonFile& file);

/// The probe without its pose, which the scenario gives.
content::Probe read_probe(files::JsonFile& file);

}  // namespace stylet::readers
