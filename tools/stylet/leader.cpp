#include "tools/stylet/leader.h"

#include "tools/stylet/hid_device.h"

#include <fmt/format.h>

#include <cstdio>
#include <stdexcept>

namespace stylet::tools {

using haptic::hid::DeviceKind;

Stylus make_leader(const std::string& device, Seen seen, const content::Scene& scene, haptic::hid::ReportLog* log) {
  if (!device.empty()) return make_stylus(device, scene, log);
  const bool in_window = seen == Seen::in_window;
  // Of a scenario that says not where a needle starts only a motion can be shown.
  const bool leadable = !scene.targets.empty() && !scene.motion.stylus.empty();
  if (in_window && !leadable) return make_stylus("recorded", scene, log);
  const std::string leader = default_leader(seen, in_window ? connected_kind() : DeviceKind::kUnusable);
  if (leader == "hid") {
    try {
      Stylus stylus = make_stylus(leader, scene, log);
      fmt::print("{} leads the needle; --device mouse: mouse and keyboard; --device recorded: a demonstration\n",
                 stylus.device->name());
      std::fflush(stdout);
      return stylus;
    } catch (const std::runtime_error& error) {
      fmt::print(stderr, "stylet: {}\n", error.what());
    }
  }
  if (!in_window) return make_stylus(leader, scene, log);
  fmt::print("Mouse and keyboard lead the needle (H: the keys); --device recorded: a demonstration\n");
  std::fflush(stdout);
  return make_stylus("mouse", scene, log);
}

}  // namespace stylet::tools
