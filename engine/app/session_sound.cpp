#include "engine/app/session_sound.h"

#include "engine/training/ear.h"

namespace stylet::app {

void SessionSound::play(const sound::Cue& cue, double now_s) {
  if (cue.sound == sound::Sound::generator) power_ = cue.strength;
  if (sound::goes_on(cue.sound) || now_s - cue.time_s <= kLate) speaker_.play(cue);
}

void SessionSound::follow(const session::LiveSession& live, const training::TrainingSession& course) {
  if (const auto news = speaker_.news()) observer_.note(Note::notice, *news);
  for (const sound::Cue& cue : watch_.take()) play(cue, live.time_s());
  for (const recording::EventRecord& event : course.happened()) {
    if (const auto cue = training::cue_of(event)) play(*cue, live.time_s());
  }
  if (live.paused()) {
    hush();
  } else if (hushed_) {
    hushed_ = false;
    speaker_.play({.sound = sound::Sound::generator, .strength = power_});
  }
}

void SessionSound::hush() {
  if (hushed_) return;
  hushed_ = true;
  speaker_.play({.sound = sound::Sound::breath, .strength = 0});
  speaker_.play({.sound = sound::Sound::generator, .strength = 0});
}

}  // namespace stylet::app
