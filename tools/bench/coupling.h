// `stylet bench coupling`: what the coupling `stylet` gains over the paper's, one number (and figure) a claim.
#pragma once

#include "tools/bench/report.h"

#include <filesystem>

namespace stylet::bench {

struct CouplingOptions {
  /// The reference insertion R1 (content/reference/README.md).
  std::filesystem::path reference_insertion;
  /// Where figures go as PNG and CSV; empty: no files.
  std::filesystem::path out;
  /// Short runs and small meshes, for tests: the same names as far as they go.
  bool quick = false;
};

/// All parts, one after the other (coupling_parts.h). Prints its progress to stderr.
/// @throws std::runtime_error if the experiment cannot be read or a file not be written
Report bench_coupling(const CouplingOptions& options);

}  // namespace stylet::bench
