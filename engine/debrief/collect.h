// From a session to what its debrief shows.
#pragma once

#include "engine/content/scene.h"
#include "engine/debrief/debrief_data.h"
#include "engine/debrief/footage.h"
#include "engine/gpu/device.h"
#include "engine/recording/recording.h"
#include "engine/stills/pictures.h"
#include "engine/training/metrics.h"
#include "engine/training/score.h"
#include "engine/training/trace.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace stylet::debrief {

/// Somebody to compare with: a motion that the scenario brings, or another recording of it.
struct Expert {
  std::string name{};
  std::vector<PathPoint> path{};
  std::vector<training::Metric> metrics{};
};

/// The way of the tip in at most about 3000 moments; of each spell that with the greatest force stays.
std::vector<PathPoint> path_of(const training::Trace& trace);

/// What happened, in words. Names that are not known here stand for themselves.
/// Whether an event says what came of a step of the procedure.
bool is_result(const recording::EventRecord& event);

std::vector<DebriefEvent> events_of(const std::vector<recording::EventRecord>& events);

/// A moment whose ultrasound image is worth a look.
struct KeyMoment {
  double time_s = 0;
  std::string title{};
};
/// First puncture, that into the organ of the target, the arrival at the target, each core and ablation: times
/// ascending, at most 8.
std::vector<KeyMoment> key_moments(const content::Scene& scene, const recording::Recording& recording,
                                   const training::Trace& trace);

DebriefScore score_of(const training::Score& score);

/// Everything but the pictures.
/// @param metrics  of the session; those of cores and ablations as it set them
DebriefData collect(const content::Scene& scene, const recording::Recording& recording, Footage& footage,
                    const std::vector<training::Metric>& metrics, const std::optional<Expert>& expert);

/// Ultrasound images of the key moments, one after the other: a window goes on meanwhile. Thread: the device's.
class KeyMomentPictures {
public:
  /// Keeps references to all of them. @throws gpu::GpuError
  KeyMomentPictures(const content::Scene& scene, gpu::Device& device, const recording::Recording& recording,
                    Footage& footage);
  /// Draws the next. @return false: there is none left. @throws gpu::GpuError
  bool draw_next();
  /// Of them drawn, [0, 1].
  double share() const;
  std::vector<DebriefPicture> take() { return std::move(drawn_); }

private:
  const content::Scene& scene_;
  Footage& footage_;
  stills::Pictures pictures_;
  std::vector<KeyMoment> moments_;
  std::size_t next_ = 0;
  state::FrameState frame_;
  std::vector<DebriefPicture> drawn_;
};

}  // namespace stylet::debrief
