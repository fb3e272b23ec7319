// What is to be heard, and when.
#pragma once

#include <cstdint>

namespace stylet::sound {

enum class Sound : std::uint8_t {
  puncture,   ///< the needle breaks through a surface
  bone,       ///< the tip meets bone
  shot,       ///< of a spring-loaded needle: stylet, then cannula
  warning,    ///< two tones
  breath,     ///< goes on; its strength is the flow, > 0: in, < 0: out
  generator,  ///< goes on: the tone of an electrode under power
};

/// Goes on until it is told another strength.
constexpr bool goes_on(Sound sound) {
  return sound == Sound::breath || sound == Sound::generator;
}

struct Cue {
  double time_s = 0;  ///< session time
  Sound sound = Sound::warning;
  double strength = 1;  ///< [0, 1]; of a breath [-1, 1]
};

}  // namespace stylet::sound
