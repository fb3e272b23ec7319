// After the session: its recording is replayed to check the hash, and the pictures are drawn from the replay.
#pragma once

#include "engine/content/scene.h"
#include "engine/debrief/film.h"
#include "engine/gpu/device.h"
#include "engine/session/force_trace.h"
#include "engine/session/output_directory.h"
#include "engine/session/recording.h"
#include "engine/session/replay.h"

#include <cstdint>
#include <functional>
#include <string>

namespace stylet::debrief {

struct DebriefSettings {
  StillSettings stills{};  ///< with the look of the film
};

struct Debrief {
  session::ReplayResult replay;
  std::uint64_t state_hash = 0;  ///< of the replay
  int video_frames = 0;
};

/// What is being done, and how much of it.
using DebriefProgress = std::function<void(const std::string& doing, double share)>;

/// Writes force.csv and force.png, with the recording's events.
/// @throws content::ContentError
void write_force(const session::OutputDirectory& out, const session::Recording& recording,
                 const session::ForceTrace& trace);

/// Writes the force, view.png and ultrasound.png (the moment the tip is closest to the target), session.mp4.
/// @throws content::ContentError, gpu::GpuError
Debrief write_debrief(const session::OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
                      const session::Recording& recording, const session::ForceTrace& trace,
                      const DebriefSettings& settings, const DebriefProgress& progress = {});

}  // namespace stylet::debrief
