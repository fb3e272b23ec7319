// A running session in a headset, its controllers in the hands.
#pragma once

#include "engine/app/observer.h"
#include "engine/app/session_sound.h"
#include "engine/content/scene.h"
#include "engine/content/texts.h"
#include "engine/gpu/device.h"
#include "engine/headset/headset_runtime.h"
#include "engine/immersive/session_panel.h"
#include "engine/panels/trainee_choice.h"
#include "engine/scanner/live_scanner.h"
#include "engine/scanner/scanner_console.h"
#include "engine/session/held_breath.h"
#include "engine/session/held_probe.h"
#include "engine/session/live_session.h"
#include "engine/session/picture_watch.h"
#include "engine/session/puncture_watch.h"
#include "engine/training/training_session.h"
#include "haptic/hand_device.h"

#include <memory>

namespace stylet::app {

/// The runtime of a headset; none, and a note that says why, where none answers.
/// @param instead  what the session goes on with: "headless"
std::unique_ptr<headset::HeadsetRuntime> find_headset(const char* instead, Observer& observer);

struct HeadsetSessionSettings {
  haptic::HandDevice* hand = nullptr;            ///< led by the controller of the hand with the needle
  const haptic::Device* stylus = nullptr;        ///< its coming and going is noted
  const haptic::Device* probe_device = nullptr;  ///< the same of one that leads the probe; null: none
  session::HeldProbe* probe = nullptr;           ///< held by the other
  session::HeldBreath* breath = nullptr;         ///< held when a button asks for it; null: as the scene has it
  scanner::ScannerConsole* scanner = nullptr;    ///< as it stands at the start and, where the device is lost, then
  training::TrainingSession* course = nullptr;   ///< the menu button begins, pauses and resumes it
  scanner::ImageWatcher* images = nullptr;       ///< gets those of the scanner
  session::PictureWatch* pictures = nullptr;     ///< told of every picture shown
  immersive::PanelLevel* panel = nullptr;        ///< as it stands at the start, then as the trainee leaves it
  session::PunctureWatch* punctures = nullptr;   ///< felt in the hand with the needle
  SessionSound* sound = nullptr;                 ///< follows the session; null: nothing is heard
  bool left_handed = false;                      ///< the left hand holds the needle
  const char* if_lost = "";                      ///< what the session does then: "going on headless"
};

/// Shows the session until it is finished, the trainee ends it in the runtime's menu, or the observer asks for
/// the end.
/// @return false: headset or runtime have gone before, which is noted
/// Main thread. @throws gpu::GpuError
bool show_in_headset(headset::HeadsetRuntime& runtime, gpu::Device& device, const content::Scene& scene,
                     session::LiveSession& session, const HeadsetSessionSettings& settings, Observer& observer);

/// Asks in the headset who trains, beside the patient that is to come.
/// @param texts  in the language of whoever is asked
/// @return whether somebody, or nobody, was chosen; false: headset or runtime have gone before, which is noted, the
/// trainee has ended it in the runtime's menu, or the observer asks for the end
/// Main thread. @throws gpu::GpuError
bool chosen_in_headset(headset::HeadsetRuntime& runtime, gpu::Device& device, const content::Scene& scene,
                       panels::TraineeChoice& choice, const content::Texts& texts, bool left_handed,
                       Observer& observer);

}  // namespace stylet::app
