// What a running session means to those who watch it: the live force curve, where the tip is, and what to warn of.
#pragma once

#include "engine/content/scene.h"
#include "engine/figures/force_trace.h"
#include "engine/panels/session_facts.h"
#include "engine/state/frame_state.h"

namespace stylet::panels {

/// Collects the frames shown. Thread: the one that draws.
class SessionWatch {
public:
  /// Keeps a reference to `scene`.
  explicit SessionWatch(const content::Scene& scene);

  /// Takes in a frame; one that is no later than the last, or not finite, is passed over.
  void look(const state::FrameState& frame);
  /// Fills in what follows from the frames: depth, forces, distances, warnings, curve. Points into this.
  void fill(SessionFacts& facts) const;

private:
  void warn(SessionFacts& facts) const;

  const content::Scene& scene_;
  figures::ForceTrace trace_;
  state::FrameState frame_;
  double out_of_plane_ = 0;  ///< m, tip from the image plane, along the probe's +Y
  double bend_ = 0;          ///< m, of the tip from the line of the hub
  bool seen_ = false;
};

}  // namespace stylet::panels
