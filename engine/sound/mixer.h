// All that sounds at once becomes one stream of samples.
#pragma once

#include "engine/sound/cue.h"
#include "engine/sound/waveform.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace stylet::sound {

/// Never over full scale: as it is up to kLinear, from there on ever closer to 1.
float limited(float sum);
inline constexpr float kLinear = 0.7F;

/// Samples are a function of the cues, of where between the samples they came, and of nothing else. One thread.
class Mixer {
public:
  /// Begins, or changes, with the next sample.
  void start(const Cue& cue);
  /// Fades out within kFade, then gives zeros; what sounds goes on unheard.
  void mute(bool muted) { muted_ = muted; }
  /// The next samples, of kRate.
  void render(std::span<float> out);

  static constexpr double kFade = 0.005;           ///< s
  static constexpr std::size_t kMostVoices = 128;  ///< at once; more begin unheard

private:
  struct Voice {
    std::vector<float> samples;
    std::size_t next = 0;
  };
  /// Air that passes the nose: noise between two frequencies, lower on the way out.
  struct Air {
    float once = 0, twice = 0, low = 0;  // one-pole filters, which begin at rest
  };
  float breath();
  float generator();

  std::vector<Voice> voices_;
  Air air_;
  float flow_ = 0;        // wanted
  float flow_heard_ = 0;  // follows it
  float power_ = 0;       // of the generator, wanted
  float power_heard_ = 0;
  bool muted_ = false;
  float open_ = 1;  // 0: mute
  std::uint64_t sample_ = 0;
};

/// A session's sound from one time of it to another: of what began before, what goes_on() alone.
/// @param cues  times ascending
std::vector<float> track(std::span<const Cue> cues, double from_s, double to_s);

}  // namespace stylet::sound
