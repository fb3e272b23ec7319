#include "engine/session/puncture_event.h"

#include <charconv>

namespace stylet::session {
namespace {

constexpr std::string_view kFrom = "from";
constexpr std::string_view kTo = "to";
constexpr std::string_view kForce = "force";
constexpr std::string_view kEnergy = "energy";

std::string_view tissue_name(const content::Scene& scene, int tissue) {
  const auto index = static_cast<std::size_t>(tissue);
  return index < scene.tissues.size() ? std::string_view(scene.tissues[index].name) : "?";
}

/// Version 1: "fat > muscle, 0.8000 N (0.00123 J)", at first without the energy.
std::optional<PunctureEvent> from_version_1(std::string_view text, double time_s) {
  constexpr std::string_view kInto = " > ", kAt = ", ", kReleases = " N (";
  const std::size_t into = text.find(kInto);
  const std::size_t at = text.rfind(kAt);
  if (into == std::string_view::npos || at == std::string_view::npos || at < into) return std::nullopt;
  const std::size_t name = into + kInto.size();
  PunctureEvent puncture{
      .time_s = time_s, .from = std::string(text.substr(0, into)), .to = std::string(text.substr(name, at - name))};
  const char* begin = text.data() + at + kAt.size();
  const char* end = text.data() + text.size();
  const auto [behind, problem] = std::from_chars(begin, end, puncture.force_n);
  if (problem != std::errc{}) return std::nullopt;
  if (double energy = 0; std::string_view(behind, end).starts_with(kReleases) &&
                         std::from_chars(behind + kReleases.size(), end, energy).ec == std::errc{}) {
    puncture.energy_j = energy;
  }
  return puncture;
}

}  // namespace

void add_puncture(recording::RecordingChannel& channel, double time_s, std::uint64_t step,
                  const content::Scene& scene, const physics::Puncture& puncture) {
  channel.add_event(time_s, step, kPunctureEvent,
                    {{kFrom, tissue_name(scene, puncture.from)},
                     {kTo, tissue_name(scene, puncture.to)},
                     {kForce, puncture.force, "N"},
                     {kEnergy, puncture.energy, "J"}});
}

std::optional<PunctureEvent> puncture_of(const recording::EventRecord& event) {
  if (event.name != kPunctureEvent) return std::nullopt;
  if (const std::string_view text = event.version_1_text(); !text.empty()) return from_version_1(text, event.time_s);
  const std::optional<double> force = event.number(kForce);
  if (!force || event.text(kTo).empty()) return std::nullopt;
  return PunctureEvent{.time_s = event.time_s,
                       .from = std::string(event.text(kFrom)),
                       .to = std::string(event.text(kTo)),
                       .force_n = *force,
                       .energy_j = event.number(kEnergy)};
}

std::vector<PunctureEvent> punctures(std::span<const recording::EventRecord> events) {
  std::vector<PunctureEvent> found;
  for (const recording::EventRecord& event : events) {
    if (auto puncture = puncture_of(event)) found.push_back(std::move(*puncture));
  }
  return found;
}

}  // namespace stylet::session
