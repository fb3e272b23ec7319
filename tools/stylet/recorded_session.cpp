#include "tools/stylet/recorded_session.h"

#include "engine/files/error.h"
#include "engine/readers/scenario.h"
#include "engine/recording/unfinished_recording.h"
#include "tools/stylet/session_options.h"

#include <fmt/format.h>

#include <utility>

namespace stylet::tools {

RecordedSession open_recording(const std::string& named, const std::string& scenario, Progress& progress) {
  const std::string path = recording::find_recording(named).string();
  recording::Recording recording = recording::read_recording(path);
  fmt::print("{}: {}\n", path, recording.condition());
  const session::ReplayableSteps steps = session::replayable_steps(recording);
  if (steps.haptic == 0) {
    throw files::ContentError(path + ": was cut off before the first step; there is nothing to replay");
  }
  if (steps.haptic != recording.haptic.size() || steps.simulation != recording.simulation.size()) {
    fmt::print("replayed up to {:.3f} s: the {} haptic and {} simulation steps after it lack their input\n",
               recording.haptic[steps.haptic - 1].time_s, recording.haptic.size() - steps.haptic,
               recording.simulation.size() - steps.simulation);
  }
  const auto scenario_path = readers::find_scenario(scenario.empty() ? recording.header.scenario : scenario);
  if (session::file_hash(scenario_path) != recording.header.scenario_hash) {
    fmt::print(stderr, "stylet: {} has changed since the recording was made; the replay may differ\n",
               scenario_path.string());
  }
  content::Scene scene = load_scene(scenario_path.string(), progress);
  const session::RecordedSettings settings = session::recorded_settings(recording);
  if (settings.haptic_hz > 0) set_haptic_rate(scene, settings.haptic_hz);
  return {std::move(recording), steps, std::move(scene)};
}

}  // namespace stylet::tools
