#include "engine/sound/mixer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::sound {
namespace {

constexpr float kFlowFollows = 0.05F;  // s
constexpr float kBreathLoud = 0.3F;    // of the noise as it is filtered: 0.02 rms at the flow of a quiet breath
constexpr float kInAbove = 400, kInBelow = 1600;  // Hz
constexpr float kOutAbove = 200, kOutBelow = 800;
constexpr float kUnheard = 1e-4F;  // of full flow or power

constexpr double kGeneratorHz = 330;
constexpr float kGeneratorLoud = 0.02F;
constexpr float kPowerFollows = 0.03F;  // s

/// Share of the way to its input that a one-pole filter goes in a sample.
float pole(float hz) {
  return 1 - std::exp(-2 * std::numbers::pi_v<float> * hz / kRate);
}

/// Goes on towards `wanted`, and is there where nobody hears the difference.
void follow(float& heard, float wanted, float within_s) {
  heard += (wanted - heard) / (within_s * kRate);
  if (wanted == 0 && std::abs(heard) < kUnheard) heard = 0;
}

}  // namespace

float limited(float sum) {
  constexpr float kRoom = 1 - kLinear;
  const float over = std::abs(sum) - kLinear;
  if (!(over > 0)) return sum;
  // x / (1 + x): leaves the line without a corner.
  return std::copysign(kLinear + kRoom * over / (kRoom + over), sum);
}

void Mixer::start(const Cue& cue) {
  if (!std::isfinite(cue.strength)) return;
  if (cue.sound == Sound::breath) {
    flow_ = static_cast<float>(std::clamp(cue.strength, -1.0, 1.0));
  } else if (cue.sound == Sound::generator) {
    power_ = static_cast<float>(std::clamp(cue.strength, 0.0, 1.0));
  } else if (voices_.size() < kMostVoices) {
    voices_.push_back({.samples = waveform(cue.sound, cue.strength)});
  }
}

float Mixer::breath() {
  static const float kPoles[2][2] = {{pole(kOutAbove), pole(kOutBelow)}, {pole(kInAbove), pole(kInBelow)}};
  follow(flow_heard_, flow_, kFlowFollows);
  if (flow_heard_ == 0) return 0;
  const float* poles = kPoles[flow_heard_ > 0 ? 1 : 0];
  const float noise = white_noise(sample_);
  air_.once += poles[1] * (noise - air_.once);
  air_.twice += poles[1] * (air_.once - air_.twice);
  air_.low += poles[0] * (air_.twice - air_.low);
  return kBreathLoud * std::abs(flow_heard_) * (air_.twice - air_.low);
}

float Mixer::generator() {
  follow(power_heard_, power_, kPowerFollows);
  if (power_heard_ == 0) return 0;
  const double turns = std::fmod(kGeneratorHz / kRate * static_cast<double>(sample_), 1.0);
  const auto angle = static_cast<float>(2 * std::numbers::pi * turns);
  return kGeneratorLoud * power_heard_ * (std::sin(angle) + 0.3F * std::sin(2 * angle));
}

void Mixer::render(std::span<float> out) {
  const float step = 1 / static_cast<float>(kFade * kRate);
  for (float& sample : out) {
    float sum = breath() + generator();
    for (Voice& voice : voices_) {
      if (voice.next < voice.samples.size()) sum += voice.samples[voice.next++];
    }
    open_ = std::clamp(open_ + (muted_ ? -step : step), 0.0F, 1.0F);
    sample = open_ * limited(sum);
    ++sample_;
  }
  std::erase_if(voices_, [](const Voice& voice) { return voice.next >= voice.samples.size(); });
}

std::vector<float> track(std::span<const Cue> cues, double from_s, double to_s) {
  std::vector<float> out(static_cast<std::size_t>(std::lround(std::max(0.0, to_s - from_s) * kRate)));
  Mixer mixer;
  std::size_t made = 0;
  const auto make_until = [&](std::size_t end) {
    mixer.render(std::span(out).subspan(made, end - made));
    made = end;
  };
  for (const Cue& cue : cues) {
    if (cue.time_s >= to_s) break;
    if (cue.time_s < from_s && !goes_on(cue.sound)) continue;
    const double at = std::max(0.0, cue.time_s - from_s) * kRate;
    make_until(std::clamp(static_cast<std::size_t>(std::lround(at)), made, out.size()));
    mixer.start(cue);
  }
  make_until(out.size());
  return out;
}

}  // namespace stylet::sound
