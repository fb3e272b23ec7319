// What a scenario says of its biopsy.
#pragma once

#include "engine/content/exercise.h"

namespace stylet::procedures::biopsy {

inline constexpr const char* kName = "biopsy";

/// A spring-loaded side-notch needle: fired, its stylet shoots ahead by `throw_length`, and the cannula cuts off what
/// has fallen into the notch behind the stylet's point.
struct Gun {
  double throw_length = 0.022;  ///< m
  double notch = 0.017;         ///< length of the core, m
  double bore = 0.0011;         ///< diameter of the core, m

  static constexpr double kStyletPoint = 0.005;  ///< m; the notch ends so far behind the stylet's tip at least
};

struct Plan final : content::ProcedurePlan {
  Plan() { kind = kName; }
  int samples = 1;  ///< cores wanted, at most one a target where there are several
  Gun gun{};
};

/// Of an exercise of this kind.
inline const Plan& plan_of(const content::Exercise& exercise) {
  return static_cast<const Plan&>(*exercise.plan);
}

}  // namespace stylet::procedures::biopsy
