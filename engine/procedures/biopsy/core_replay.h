// The cores of a recorded session, where they lay: from its events and the needle of its replay.
#pragma once

#include "engine/procedures/biopsy/plan.h"
#include "engine/procedures/interface/procedure.h"

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

namespace stylet::procedures::biopsy {

/// What the notch takes when the gun is fired now: core_points().
std::vector<std::uint8_t> points_ahead(const Step& step, const Gun& gun, std::size_t tissues);
/// Where the notch takes its core when the gun is fired now; its pieces are still to be found. Patient frame.
state::CoreTrack core_track(const Step& step, const Gun& gun, double target_share);

class CoreReplay final : public ProcedureReplay {
public:
  /// @param scene   of this kind; outlives this
  /// @param events  of the recording
  CoreReplay(const content::Scene& scene, std::span<const recording::EventRecord> events);

  void observe(const Step& step, const Situation& now) override;
  void show_at(double time_s, state::FrameState& frame) override;

private:
  struct Taken {
    double time_s = 0;
    std::uint64_t haptic_step = 0;
    state::CoreTrack track{};
    bool seen = false;  // by the replay
  };
  const Gun& gun_;
  std::vector<bool> target_tissue_;  // [Scene::tissues]
  std::mutex mutex_;                 // of taken_
  std::vector<Taken> taken_;
};

}  // namespace stylet::procedures::biopsy
