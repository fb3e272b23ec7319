// Plays what is heard of a session as it runs.
#pragma once

#include "engine/app/observer.h"
#include "engine/session/live_session.h"
#include "engine/sound/speaker.h"
#include "engine/training/sound_watch.h"
#include "engine/training/training_session.h"

namespace stylet::app {

/// Main thread.
class SessionSound {
public:
  /// Keeps references to all of them.
  SessionSound(sound::Speaker& speaker, training::SoundWatch& watch, Observer& observer)
      : speaker_(speaker), watch_(watch), observer_(observer) {}

  /// Once a frame, after the course was polled: plays what happened since the last one.
  void follow(const session::LiveSession& live, const training::TrainingSession& course);
  /// Ends what goes on: the session is over, or stands.
  void hush();
  sound::Speaker& speaker() { return speaker_; }

  /// What came so long ago, s, is not played any more: no picture was shown meanwhile.
  static constexpr double kLate = 0.5;

private:
  void play(const sound::Cue& cue, double now_s);

  sound::Speaker& speaker_;
  training::SoundWatch& watch_;
  Observer& observer_;
  double power_ = 0;  // of a generator
  bool hushed_ = true;
};

}  // namespace stylet::app
