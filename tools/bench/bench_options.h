// What every `stylet bench` is asked for.
#pragma once

#include <filesystem>
#include <string>

namespace stylet::bench {

struct BenchOptions {
  /// The reference insertion R1 (content/reference/README.md).
  std::filesystem::path reference_insertion{};
  /// Where figures go as PNG and CSV; empty: no files.
  std::filesystem::path out{};
  /// Short runs and small meshes: a check that it works, seconds, not minutes. The same names as far as they go.
  bool quick = false;
  /// Also the largest mesh, 50,653 nodes: minutes more. `paper` only.
  bool full = false;
  /// Also the same haptic problems as SOFA's LCPForceFeedback solves them. `paper` only.
  bool sofa_style_peer = false;
  /// The one part to run, empty: all. `coupling`, `mechanics`, `tissue`.
  std::string part{};
  /// hid, haply, force_dimension or openhaptics. `haptic` only.
  std::string device_kind = "hid";
};

}  // namespace stylet::bench
