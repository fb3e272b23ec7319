// Content for `stylet bench` as a test runs it: R1, with a sanitizer shorter and at a lower haptic rate.
#pragma once

#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <string>

namespace stylet::bench {

/// What goes before the command: nothing, or a content folder in `folder`. @param duration  s
inline std::string short_insertion(const support::TemporaryFolder& folder, double duration, double haptic_hz) {
  if (!support::kSanitized) return "";
  const std::filesystem::path shipped = std::filesystem::path(STYLET_SOURCE_DIR) / "content/reference/r1.json";
  std::ifstream in(shipped);
  nlohmann::json r1 = nlohmann::json::parse(in);
  r1["duration"] = duration;
  r1["haptic_hz"] = haptic_hz;
  std::filesystem::create_directory(folder / "reference");
  folder.write("reference/r1.json", r1.dump());
  return "STYLET_CONTENT='" + folder.path().string() + "' ";
}

}  // namespace stylet::bench
