// After the session: its recording is replayed to check the hash, and the pictures are drawn from the replay.
#pragma once

#include "engine/content/scene.h"
#include "engine/gpu/device.h"
#include "engine/session/force_trace.h"
#include "engine/session/output_directory.h"
#include "engine/session/recording.h"
#include "engine/session/replay.h"

#include <cstdint>
#include <functional>
#include <string>

namespace stylet::session {

struct DebriefSettings {
  bool stereo = false;
  int frames_per_second = 30;  ///< half as many where the processor draws
  int view_width = 1600;       ///< of view.png; both eyes of a stereo view are this wide
  int view_height = 1000;
  int video_width = 1280;  ///< of session.mp4, even
  int video_height = 720;
};

struct Debrief {
  ReplayResult replay;
  std::uint64_t state_hash = 0;  ///< of the replay
  int video_frames = 0;
};

/// What is being done, and how much of it.
using DebriefProgress = std::function<void(const std::string& doing, double share)>;

/// Writes view.png and ultrasound.png (the moment the tip is closest to the target), session.mp4, force.csv,
/// force.png.
/// @throws content::ContentError, gpu::GpuError
Debrief write_debrief(const OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
                      const Recording& recording, const ForceTrace& trace, const DebriefSettings& settings,
                      const DebriefProgress& progress = {});

}  // namespace stylet::session
