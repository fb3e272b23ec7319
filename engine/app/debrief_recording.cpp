#include "engine/app/debrief_recording.h"

#include "engine/app/expert_choice.h"
#include "engine/app/recorded_session.h"
#include "engine/app/saved_images.h"
#include "engine/debrief/debrief.h"
#include "engine/debrief/session_replay.h"
#include "engine/files/output_directory.h"

#include <filesystem>
#include <system_error>

namespace stylet::app {

namespace {

/// Where the other results of a recording's session lie.
std::filesystem::path folder_of(const std::filesystem::path& recording) {
  std::error_code error;
  return std::filesystem::is_directory(recording, error) ? recording
                                                         : std::filesystem::absolute(recording, error).parent_path();
}

/// Where the page goes into the folder of its session, the session's film lies beside it.
bool film_beside(const std::filesystem::path& session, const std::filesystem::path& folder) {
  std::error_code error;
  return std::filesystem::exists(folder / "session.mp4", error) &&
         std::filesystem::equivalent(session, folder, error);
}

}  // namespace

DebriefedRecording debrief_recording(const DebriefRecordingSettings& settings, Observer& observer) {
  const auto [recording, steps, scene] = open_recording(settings.recording, settings.scenario, observer);
  gpu::Device gpu({.gpu = settings.gpu});
  files::OutputDirectory out(settings.out);
  debrief::SessionReplay replay(scene, recording);
  replay.run([&observer](double share) { show_progress(observer, "Replaying", share); });
  const std::optional<debrief::Expert> expert = chosen_expert(settings.expert, false, scene, observer);
  observer.progress("Writing the debrief", 0);
  debrief::write_page(out, scene, gpu, recording, replay,
                      {.film = film_beside(folder_of(settings.recording), out.destination()),
                       .expert = expert,
                       .saved = saved_pictures(folder_of(settings.recording))});
  out.commit("debrief.html");
  observer.task_done();
  return {.folder = out.destination(), .identical = replay.result().identical()};
}

}  // namespace stylet::app
