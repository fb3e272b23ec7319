// Procedure files (content/organs/README.md, "stylet-procedure"): what a generated patient offers to whoever writes a
// scenario or a motion for it.
#pragma once

#include "engine/files/json_reader.h"
#include "physics/messages/messages.h"

#include <Eigen/Core>

#include <filesystem>
#include <string>
#include <vector>

namespace stylet::readers {

/// A pose of the probe on the skin, patient from probe.
struct ProcedureView {
  std::string name{};
  std::string shows{};
  physics::RigidPose pose{};
};

/// Patient frame, m.
struct Procedure {
  std::filesystem::path organs{};
  Eigen::Vector3d entry = Eigen::Vector3d::Zero();   ///< on the skin
  std::string target_name{};                         ///< a node of the organs
  Eigen::Vector3d target = Eigen::Vector3d::Zero();  ///< its centre
  double target_radius = 0;
  Eigen::Vector3d needle_direction = Eigen::Vector3d::UnitZ();  ///< unit, from entry to target
  std::vector<ProcedureView> views{};
};

/// Its keys.
const files::FileFormat& procedure_format();

/// Problems go to `file`; what comes out is in range even then.
Procedure read_procedure(files::JsonFile& file);

}  // namespace stylet::readers
