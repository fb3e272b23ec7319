// How full the cavities and the syringe of a recorded session were: from the steps of its replay.
#pragma once

#include "engine/procedures/interface/procedure.h"

#include <mutex>
#include <vector>

namespace stylet::procedures::aspiration {

/// What is in the syringe is what the cavities lost. Blood is in no step of a recording: it is left out.
class DrainingReplay final : public ProcedureReplay {
public:
  /// @param scene  of this kind; outlives this
  explicit DrainingReplay(const content::Scene& scene) : scene_(scene) {}

  void observe(const Step& step, const Situation& now) override;
  void show_at(double time_s, state::FrameState& frame) override;

private:
  struct Moment {
    double time_s = 0;
    std::vector<float> shares;  // [cavities]
    state::SyringeState syringe;
  };
  const content::Scene& scene_;
  std::mutex mutex_;  // of moments_
  std::vector<Moment> moments_;
};

}  // namespace stylet::procedures::aspiration
