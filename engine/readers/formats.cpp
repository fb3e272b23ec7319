#include "engine/readers/formats.h"

#include "engine/content/tissue_table.h"
#include "engine/readers/calibration_file.h"
#include "engine/readers/device_profile_file.h"
#include "engine/readers/instruments.h"
#include "engine/readers/motion_file.h"
#include "engine/readers/patient_procedure.h"
#include "engine/readers/scenario_file.h"

namespace stylet::readers {

std::vector<files::FileFormat> formats() {
  return {scenario_format(), content::tissues_format(), needle_format(), probe_format(),
          device_format(),   calibration_format(),      motion_format(), procedure_format()};
}

}  // namespace stylet::readers
