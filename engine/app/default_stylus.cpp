#include "engine/app/default_stylus.h"

#include "engine/app/hid_device.h"

#include <fmt/format.h>

#include <stdexcept>

namespace stylet::app {

using haptic::hid::DeviceKind;

Stylus open_stylus_or_default(const std::string& device, ShownIn shown, const content::Scene& scene,
                              haptic::hid::ReportLog* log, const session::StartPose* start, Observer& observer) {
  if (!device.empty()) {
    Stylus stylus = open_stylus(device, scene, log, start);
    if (!stylus.warning.empty()) observer.note(Note::warning, stylus.warning);
    return stylus;
  }
  const bool in_window = shown == ShownIn::window;
  // Of a scenario that says not where a needle starts only a motion can be shown.
  const bool can_be_held = !scene.targets.empty() && !scene.motion.stylus.empty();
  if (in_window && !can_be_held) return open_stylus("recorded", scene, log, start);
  const std::string name = default_stylus(shown, in_window ? connected_kind() : DeviceKind::kUnusable);
  if (name == "hid") {
    try {
      Stylus stylus = open_stylus(name, scene, log, start);
      observer.note(Note::info, stylus.device->name() +
                                    " leads the needle; --device mouse: mouse and keyboard; --device recorded: a "
                                    "demonstration");
      return stylus;
    } catch (const std::runtime_error& error) {
      observer.note(Note::notice, error.what());
    }
  }
  if (!in_window) return open_stylus(name, scene, log, start);
  observer.note(Note::info, "Mouse and keyboard lead the needle (H: the keys); --device recorded: a demonstration");
  return open_stylus("mouse", scene, log, start);
}

}  // namespace stylet::app
