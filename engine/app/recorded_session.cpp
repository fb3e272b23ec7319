#include "engine/app/recorded_session.h"

#include "engine/app/load_scene.h"
#include "engine/files/error.h"
#include "engine/readers/scenario.h"
#include "engine/recording/unfinished_recording.h"

#include <fmt/format.h>

#include <utility>

namespace stylet::app {

RecordedSession open_recording(const std::string& named, const std::string& scenario, Observer& observer) {
  const std::string path = recording::find_recording(named).string();
  recording::Recording recording = recording::read_recording(path);
  observer.note(Note::info, path + ": " + recording.condition());
  const session::ReplayableSteps steps = session::replayable_steps(recording);
  if (steps.haptic == 0) {
    throw files::ContentError(path + ": was cut off before the first step; there is nothing to replay");
  }
  if (steps.haptic != recording.haptic.size() || steps.simulation != recording.simulation.size()) {
    observer.note(
        Note::info,
        fmt::format("replayed up to {:.3f} s: the {} haptic and {} simulation steps after it lack their input",
                    recording.haptic[steps.haptic - 1].time_s, recording.haptic.size() - steps.haptic,
                    recording.simulation.size() - steps.simulation));
  }
  const auto scenario_path = readers::find_scenario(scenario.empty() ? recording.header.scenario : scenario);
  if (session::file_hash(scenario_path) != recording.header.scenario_hash) {
    observer.note(Note::notice,
                  scenario_path.string() + " has changed since the recording was made; the replay may differ");
  }
  content::Scene scene = load_scene(scenario_path.string(), observer);
  const session::RecordedSettings settings = session::recorded_settings(recording);
  if (settings.haptic_hz > 0) set_haptic_rate(scene, settings.haptic_hz);
  return {std::move(recording), steps, std::move(scene)};
}

}  // namespace stylet::app
