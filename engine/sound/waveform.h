// The sounds that come and go, as functions: no files, the same samples everywhere.
#pragma once

#include "engine/sound/cue.h"

#include <cstdint>
#include <vector>

namespace stylet::sound {

inline constexpr int kRate = 48'000;  ///< samples a second, of one channel

/// Samples in (-1, 1), the first and the last 0: a puncture is a low pop, bone a dull knock, a shot two sharp clicks.
/// Their energy rises with `strength`, which is cut to [0, 1]. Empty for a sound that goes_on().
std::vector<float> waveform(Sound sound, double strength);

/// White noise of sample n, in [-1, 1): the same for the same n.
float white_noise(std::uint64_t n);

}  // namespace stylet::sound
