#include "engine/app/expert_choice.h"

#include "engine/app/build_name.h"
#include "engine/app/observer.h"
#include "engine/recording/unfinished_recording.h"

namespace stylet::app {

void check_expert(const std::string& choice) {
  if (!choice.empty() && choice != "none") recording::read_recording(recording::find_recording(choice));
}

std::optional<debrief::Expert> chosen_expert(const std::string& choice, bool own_hand, const content::Scene& scene,
                                             Observer& observer) {
  const auto report = [&](double share) { show_progress(observer, "Running the expert's motion", share); };
  if (choice == "none") return std::nullopt;
  if (!choice.empty()) return debrief::expert_recording(scene, recording::find_recording(choice), report);
  if (own_hand || scene.motion.stylus.size() < 2) return std::nullopt;
  return debrief::expert_motion(scene, build_name(), debrief::expert_cache(), report);
}

}  // namespace stylet::app
