// `stylet bench line-compliance`: calibrates sub-grid compliance (physics/README.md eq. 19-21) against a needle
// resolved down to its radius, and shows what it makes of the dependence on the mesh.
#pragma once

#include "tools/bench/report.h"

#include <filesystem>

namespace stylet::bench {

struct LineComplianceOptions {
  /// The reference insertion R1 (content/reference/README.md): cube and needle.
  std::filesystem::path reference_insertion;
  /// Where the figure goes as PNG and CSV; empty: no files.
  std::filesystem::path out;
  /// Coarse resolved needle and fewer meshes: a check that it works.
  bool quick = false;
};

/// @throws std::runtime_error if the experiment cannot be read or a file not be written
Report bench_line_compliance(const LineComplianceOptions& options);

}  // namespace stylet::bench
