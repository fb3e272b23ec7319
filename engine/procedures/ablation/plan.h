// What a scenario says of its ablation.
#pragma once

#include "engine/content/exercise.h"

namespace stylet::procedures::ablation {

inline constexpr const char* kName = "ablation";

/// A monopolar radio-frequency electrode, and for how long it heats.
struct Plan final : content::ProcedurePlan {
  Plan() { kind = kName; }
  double exposed = 0.030;        ///< length of the bare tip, m
  double power_w = 100;          ///< most that goes into the tissue
  double max_temperature = 100;  ///< degrees Celsius that no tissue exceeds: power is taken back
  double duration_s = 720;       ///< of heating
  double time_factor = 60;       ///< seconds of heating in a second of the session
  double margin = 0.005;         ///< around the tumour that is to be destroyed too, m
};

/// Of an exercise of this kind.
inline const Plan& plan_of(const content::Exercise& exercise) {
  return static_cast<const Plan&>(*exercise.plan);
}

}  // namespace stylet::procedures::ablation
