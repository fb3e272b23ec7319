#include "engine/app/debrief_recording.h"

#include "engine/app/expert_choice.h"
#include "engine/app/recorded_session.h"
#include "engine/debrief/debrief.h"
#include "engine/debrief/session_replay.h"
#include "engine/files/output_directory.h"

namespace stylet::app {

DebriefedRecording debrief_recording(const DebriefRecordingSettings& settings, Observer& observer) {
  const auto [recording, steps, scene] = open_recording(settings.recording, settings.scenario, observer);
  gpu::Device gpu({.gpu = settings.gpu});
  files::OutputDirectory out(settings.out);
  debrief::SessionReplay replay(scene, recording);
  replay.run([&observer](double share) { show_progress(observer, "Replaying", share); });
  const std::optional<debrief::Expert> expert = chosen_expert(settings.expert, false, scene, observer);
  observer.progress("Writing the debrief", 0);
  debrief::write_page(out, scene, gpu, recording, replay, {.expert = expert});
  out.commit("debrief.html");
  observer.task_done();
  return {.folder = out.destination(), .identical = replay.result().identical()};
}

}  // namespace stylet::app
