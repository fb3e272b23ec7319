// `stylet bench paper`: the tables and figures of Martin, Zeng and Courtecuisse (IROS 2023), measured here, beside
// the paper's own numbers.
#pragma once

#include "tools/bench/report.h"

#include <filesystem>

namespace stylet::bench {

struct PaperOptions {
  /// The reference insertion R1 (content/reference/README.md).
  std::filesystem::path reference_insertion;
  /// Where figures go as PNG and CSV; empty: no files.
  std::filesystem::path out;
  /// Short runs and small meshes, for tests: seconds, not minutes. The same names as far as they go.
  bool quick = false;
  /// Also a cube of 50,653 nodes: minutes more.
  bool full = false;
  /// Also solve the same haptic problems as SOFA's LCPForceFeedback does.
  bool sofa_style_peer = false;
};

/// Everything below, one after the other. Prints its progress to stderr.
/// @throws std::runtime_error if the experiment cannot be read or a file not be written
Report bench_paper(const PaperOptions& options);

/// Table I: time of the haptic step and its stages, with and without constraints; speed by rows; machine's limit.
Report paper_table1(const PaperOptions& options);

/// The same haptic problems by Gauss-Seidel on a frozen linearisation (Peterlik 2011) beside ours.
Report paper_peer(const PaperOptions& options);

}  // namespace stylet::bench
