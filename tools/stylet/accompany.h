// Those who are present at a session in real time: the trainee in a headset or at a window, clients of a link,
// nobody.
#pragma once

#include "engine/content/scene.h"
#include "engine/headset/headset_runtime.h"
#include "engine/session/held_probe.h"
#include "engine/session/live_session.h"
#include "engine/training/training_session.h"
#include "engine/view/window.h"
#include "tools/stylet/graphics.h"
#include "tools/stylet/link_session.h"
#include "tools/stylet/progress.h"
#include "tools/stylet/session_options.h"

namespace stylet::tools {

struct Company {
  Graphics& graphics;
  view::Display* display;            ///< null: no window
  headset::HeadsetRuntime* headset;  ///< null: no headset
  Stylus& stylus;
  session::HeldProbe& probe;
  training::TrainingSession& course;
  LinkSession& link;
};

/// From start() to the end of the course: in the headset, in the window, or with nobody looking on. Where the device
/// is lost the session goes on with another; where there is no other, or none that lasts, headless, or to its end
/// where nobody could lead it any more. Main thread.
/// @param duration_s  of the session, for the progress
/// @throws gpu::GpuError  but for a lost device
void accompany(session::LiveSession& live, const content::Scene& scene, const Company& with, bool stereo,
               double duration_s, Progress& progress);

}  // namespace stylet::tools
