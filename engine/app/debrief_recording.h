// The debrief of a recording written again, with another expert or after a crash.
#pragma once

#include "engine/app/observer.h"

#include <filesystem>
#include <string>

namespace stylet::app {

struct DebriefRecordingSettings {
  std::string recording{};  ///< file or folder
  std::string scenario{};   ///< instead of the one named in the recording; empty: that
  std::string expert{};     ///< as of chosen_expert()
  std::filesystem::path out = "out/debrief";
  std::string gpu{};  ///< by a part of its name or its number; empty: the best
};

struct DebriefedRecording {
  std::filesystem::path folder{};  ///< holds debrief.html, debrief.json, debrief.csv, path.csv
  bool identical = false;          ///< the replay that it was drawn from gave the same bits
};

/// @throws files::ContentError, gpu::GpuError, Stopped
DebriefedRecording debrief_recording(const DebriefRecordingSettings& settings, Observer& observer);

}  // namespace stylet::app
