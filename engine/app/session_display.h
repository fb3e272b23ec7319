// A running session as it is shown: in a headset, in a window, to clients of a link alone, or to nobody.
#pragma once

#include "engine/app/graphics.h"
#include "engine/app/link_session.h"
#include "engine/app/observer.h"
#include "engine/app/session_sound.h"
#include "engine/app/session_window.h"
#include "engine/app/stylus.h"
#include "engine/content/scene.h"
#include "engine/headset/headset_runtime.h"
#include "engine/session/held_breath.h"
#include "engine/session/held_probe.h"
#include "engine/session/live_session.h"
#include "engine/session/picture_watch.h"
#include "engine/session/puncture_watch.h"
#include "engine/training/training_session.h"

#include <memory>

namespace stylet::app {

/// What a running session consists of.
struct SessionParts {
  Graphics& graphics;
  Screen* screen;                    ///< null: no window
  headset::HeadsetRuntime* headset;  ///< null: no headset
  Stylus& stylus;
  session::HeldProbe& probe;
  session::HeldBreath* breath;  ///< null: the scene's
  training::TrainingSession& course;
  LinkSession& link;
  session::PictureWatch& pictures;
  session::PunctureWatch& punctures;
  SessionSound* sound;          ///< null: nothing is heard
  scanner::SavedImages& saved;  ///< by the trainee
  bool left_handed = false;
  const haptic::Device* probe_device = nullptr;  ///< that leads the probe; null: none
};

/// Of a window: what opens it anew where its device was lost.
std::unique_ptr<SessionWindow> open_session_window(session::LiveSession& live, const content::Scene& scene,
                                                   const SessionParts& parts, bool stereo);

/// How a session came to its end.
struct SessionShown {
  std::unique_ptr<SessionWindow> window{};  ///< that it ended in; null: in none, or it was closed
  bool could_finish = true;                 ///< else leaving was its end: in a headset, headless
};

/// From start() to the end of the course. Where the device is lost the session goes on with another; where there is
/// no other, or none that lasts, headless, or to its end where nobody could lead it any more. Main thread.
/// @param duration_s  of the session, for the progress
/// @throws gpu::GpuError  but for a lost device
SessionShown show_to_end(session::LiveSession& live, const content::Scene& scene, const SessionParts& parts,
                         bool stereo, double duration_s, Observer& observer);

}  // namespace stylet::app
