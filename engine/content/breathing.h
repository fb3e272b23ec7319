// The patient's breath over time: quiet breathing, and spells in which it is held for the needle.
#pragma once

#include "engine/content/scene.h"

namespace stylet::content {

/// Breaths drawn until a time: whole at end-expiration. Continuous with its first derivative, never falling. Without
/// holds time / period. Before, between and after holds the breath starts and stops within a quarter of a period;
/// what fits best between two are whole breaths, a little longer or shorter than the period, or none. Those after the
/// last hold have the period again. It depends on nothing but its arguments, so replay sees the same breath.
/// @param time_s  since the session began
double breaths(const Breathing& breathing, double time_s);

/// Share of a full inspiration at a time: 0 at end-expiration, where a quiet breath rests longest; times the scene's
/// amplitude. Lujan et al. 1999: sin^4 of the breath's phase.
double inspiration(const Breathing& breathing, double time_s);

}  // namespace stylet::content
