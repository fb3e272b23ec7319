#include "engine/session/puncture_event.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace stylet::session {
namespace {

constexpr std::string_view kInto = " > ";
constexpr std::string_view kAt = ", ";
constexpr std::string_view kReleases = " N (";

std::string_view tissue_name(const content::Scene& scene, int tissue) {
  constexpr std::size_t kLongest = 80;  // two fit an event
  const auto index = static_cast<std::size_t>(tissue);
  return index < scene.tissues.size() ? std::string_view(scene.tissues[index].name).substr(0, kLongest) : "?";
}

}  // namespace

std::string_view puncture_detail(const content::Scene& scene, const physics::Puncture& puncture,
                                 PunctureText& memory) {
  const auto end = fmt::format_to_n(memory.text, sizeof memory.text, "{}{}{}{}{:.4f} N ({:.4g} J)",
                                    tissue_name(scene, puncture.from), kInto, tissue_name(scene, puncture.to), kAt,
                                    puncture.force, puncture.energy);
  return {memory.text, std::min(end.size, sizeof memory.text)};
}

std::vector<PunctureEvent> punctures(const recording::Recording& recording) {
  std::vector<PunctureEvent> found;
  for (const recording::EventRecord& event : recording.events) {
    if (event.name != kPunctureEvent) continue;
    const std::size_t into = event.detail.find(kInto);
    const std::size_t at = event.detail.rfind(kAt);
    if (into == std::string::npos || at == std::string::npos || at < into) continue;
    const std::size_t name = into + kInto.size();
    PunctureEvent puncture{
        .time_s = event.time_s, .from = event.detail.substr(0, into), .to = event.detail.substr(name, at - name)};
    const char* begin = event.detail.data() + at + kAt.size();
    const char* end = event.detail.data() + event.detail.size();
    const auto [behind, problem] = std::from_chars(begin, end, puncture.force_n);
    if (problem != std::errc{}) continue;
    if (double energy = 0; std::string_view(behind, end).starts_with(kReleases) &&
                           std::from_chars(behind + kReleases.size(), end, energy).ec == std::errc{}) {
      puncture.energy_j = energy;
    }
    found.push_back(puncture);
  }
  return found;
}

}  // namespace stylet::session
