// One attempt at a training session: the session itself, then what it leaves for the trainee.
#pragma once

#include "engine/content/scene.h"
#include "engine/headset/headset_runtime.h"
#include "engine/view/window.h"
#include "tools/stylet/link_session.h"
#include "tools/stylet/progress.h"
#include "tools/stylet/session_options.h"

#include <optional>
#include <string>

namespace stylet::tools {

struct TrainOptions {
  std::string scenario;
  std::string device;
  std::string view = "auto";
  bool stereo = false;
  bool lockstep = false;
  std::string coupling;
  double haptic_hz = 0;
  double seconds = 0;  ///< 0: as long as the stylus moves
  std::string record;
  std::string expert;
  bool film = true;
  std::string out = "out/session";
  std::string gpu;
  ScannerOptions scanner;
  LinkOptions link;
};

/// @param display  null: headless, or only in the headset
/// @return exit code; nothing: the trainee wants to begin anew
/// @throws files::ContentError, gpu::GpuError, haptic::hid::HidError, link::LinkError
std::optional<int> attempt(const TrainOptions& options, const content::Scene& scene, view::Display* display,
                           headset::HeadsetRuntime* headset, Progress& progress);

}  // namespace stylet::tools
