// The film and the stills of a session, drawn from what was kept of it.
#pragma once

#include "engine/content/scene.h"
#include "engine/debrief/session_replay.h"
#include "engine/figures/force_trace.h"
#include "engine/files/output_directory.h"
#include "engine/gpu/device.h"
#include "engine/session/run_statistics.h"

#include <limits>

namespace stylet::debrief {

struct FilmSettings {
  int width = 1280;  ///< even
  int height = 720;
  int frames_per_second = 30;  ///< half as many where the processor draws
  double from_s = 0;           ///< session time
  double to_s = std::numeric_limits<double>::infinity();
  double speed = 1;  ///< session time over film time: 0.25 is slow motion
  bool stereo = false;
};

/// Writes session.mp4. @return its frames; at least one
/// @throws files::ContentError, gpu::GpuError
int write_film(const files::OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
               SessionReplay& replay, const figures::ForceTrace& force, const FilmSettings& settings,
               const session::RunProgress& progress = {});

struct StillSettings {
  int view_width = 1600;  ///< both eyes of a stereo view are this wide
  int view_height = 1000;
  FilmSettings film{};  ///< session.png looks as a frame of it
};

/// Writes view.png, ultrasound.png and session.png, which has both and the force, of one moment of the session.
/// @throws files::ContentError, gpu::GpuError
void write_stills(const files::OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
                  SessionReplay& replay, double time_s, const figures::ForceTrace& force,
                  const StillSettings& settings);

}  // namespace stylet::debrief
