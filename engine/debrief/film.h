// The film and the stills of a session, drawn from what was kept of it.
#pragma once

#include "engine/content/scene.h"
#include "engine/debrief/debrief_data.h"
#include "engine/debrief/footage.h"
#include "engine/figures/canvas.h"
#include "engine/figures/force_trace.h"
#include "engine/figures/video.h"
#include "engine/files/output_directory.h"
#include "engine/gpu/device.h"
#include "engine/session/run_statistics.h"
#include "engine/stills/pictures.h"

#include <limits>
#include <vector>

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

/// What of the session a film has, under the name that Film gives it.
DebriefFilm film_of(const FrameHistory& frames, const FilmSettings& settings);

/// session.mp4 with what is heard of the session, a frame at a time. Thread: the device's.
class Film {
public:
  /// Keeps references to all of them. @throws files::ContentError, gpu::GpuError
  Film(const files::OutputDirectory& out, const content::Scene& scene, gpu::Device& device, Footage& footage,
       const figures::ForceTrace& force, const FilmSettings& settings);
  /// Draws the next frame. @return false: that was the last, the film is complete and staged
  /// @throws files::ContentError, gpu::GpuError
  bool draw_next();
  /// Of it drawn, [0, 1].
  double share() const { return static_cast<double>(next_) / count_; }
  /// At least one.
  int frames() const { return count_; }

private:
  const content::Scene& scene_;
  Footage& footage_;
  const figures::ForceTrace& force_;
  FilmSettings settings_;
  figures::Font font_;
  stills::Pictures pictures_;
  std::vector<float> sound_;
  figures::VideoWriter video_;
  state::FrameState frame_;
  double from_s_ = 0;
  double step_s_ = 0;
  int count_ = 1;
  int next_ = 0;
};

/// All of it at once. @return its frames. @throws files::ContentError, gpu::GpuError
int write_film(const files::OutputDirectory& out, const content::Scene& scene, gpu::Device& device, Footage& footage,
               const figures::ForceTrace& force, const FilmSettings& settings,
               const session::RunProgress& progress = {});

struct StillSettings {
  int view_width = 1600;  ///< both eyes of a stereo view are this wide
  int view_height = 1000;
  FilmSettings film{};  ///< session.png looks as a frame of it
};

/// Writes view.png, ultrasound.png and session.png, which has both and the force, of one moment of the session.
/// @throws files::ContentError, gpu::GpuError
void write_stills(const files::OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
                  Footage& footage, double time_s, const figures::ForceTrace& force, const StillSettings& settings);

}  // namespace stylet::debrief
