// What a procedure showed while it ran, so that a picture of any moment can be drawn without running it again.
#pragma once

#include "engine/procedures/interface/procedure.h"
#include "engine/state/frame_state.h"

#include <vector>

namespace stylet::training {

/// One thread at a time.
class ShownHistory {
public:
  static constexpr double kShortest = 0.04;  ///< s between two moments kept

  /// What `procedure` shows at a time; kept where it is other than before.
  void add(double time_s, const procedures::Procedure& procedure);
  /// Adds to a frame what was shown at that time.
  void show_at(double time_s, state::FrameState& frame) const;

private:
  struct Shown {
    double time_s = 0;
    std::shared_ptr<const content::HeatedZone> zone;
    std::vector<state::CoreTrack> cores;
    std::vector<float> cavity_shares;
    std::optional<state::SyringeState> syringe;
  };
  std::vector<Shown> shown_;  // times ascending
};

}  // namespace stylet::training
