// What a scenario says of its aspiration.
#pragma once

#include "engine/content/exercise.h"
#include "engine/procedures/aspiration/flow.h"

namespace stylet::procedures::aspiration {

inline constexpr const char* kName = "aspiration";

struct Plan final : content::ProcedurePlan {
  Plan() { kind = kName; }
  Syringe syringe{};
  Fluid fluid{};  ///< what the cyst is full of
};

/// Of an exercise of this kind.
inline const Plan& plan_of(const content::Exercise& exercise) {
  return static_cast<const Plan&>(*exercise.plan);
}

}  // namespace stylet::procedures::aspiration
