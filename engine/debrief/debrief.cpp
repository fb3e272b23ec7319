#include "engine/debrief/debrief.h"

#include "engine/debrief/debrief_files.h"
#include "engine/debrief/page.h"
#include "engine/debrief/session_replay.h"
#include "engine/session/puncture_event.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace stylet::debrief {

using session::EventRecord;
using session::PunctureEvent;
using session::Recording;
using session::TraceEvent;

namespace {

/// Each puncture under the name of the tissue entered; without any (the paper's couplings) the bodies entered and
/// left.
std::vector<TraceEvent> trace_events(const Recording& recording) {
  std::vector<TraceEvent> events;
  for (const PunctureEvent& puncture : session::punctures(recording))
    events.push_back({puncture.time_s, puncture.to});
  const bool punctured = !events.empty();
  for (const EventRecord& event : recording.events) {
    const bool body = event.name == "entered" || event.name == "left";
    if (event.name == session::kPunctureEvent || (punctured && body)) continue;
    events.push_back({event.time_s, event.name});
  }
  return events;
}

/// What lies closer together than its names are wide in a figure gets one mark.
std::vector<TraceEvent> figure_marks(std::vector<TraceEvent> events, double duration_s) {
  constexpr double kWidth = 0.012;  // of the time axis
  std::stable_sort(events.begin(), events.end(),
                   [](const TraceEvent& a, const TraceEvent& b) { return a.time_s < b.time_s; });
  std::vector<TraceEvent> marks;
  for (TraceEvent& event : events) {
    if (!marks.empty() && event.time_s < marks.back().time_s + kWidth * duration_s) {
      marks.back().name += ", " + event.name;
    } else {
      marks.push_back(std::move(event));
    }
  }
  return marks;
}

}  // namespace

void write_force(const session::OutputDirectory& out, const Recording& recording, const session::ForceTrace& trace) {
  const std::vector<TraceEvent> events = trace_events(recording);
  session::write_force_csv(out.staged("force.csv"), trace, events);
  view::write_png(
      out.staged("force.png"),
      session::draw_force_figure(trace, figure_marks(events, trace.summary().duration_s), session::Font::load()));
}

void write_page(const session::OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
                const Recording& recording, SessionReplay& replay, const DebriefSettings& settings) {
  const std::vector<training::Metric> metrics =
      settings.metrics.empty() ? training::measure(replay.trace(), scene) : settings.metrics;
  DebriefData data = collect(scene, recording, replay, metrics, settings.expert);
  data.pictures = draw_key_moments(scene, device, recording, replay);
  out.write("debrief.html", debrief_page(data));
  out.write("debrief.json",
            to_json(data).dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
  out.write("debrief.csv", debrief_csv(data));
  out.write("path.csv", path_csv(data));
}

int write_debrief(const session::OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
                  const Recording& recording, SessionReplay& replay, const session::ForceTrace& trace,
                  const DebriefSettings& settings, const DebriefProgress& progress) {
  const auto report = [&](const std::string& doing) {
    return [&progress, doing](double share) {
      if (progress) progress(doing, share);
    };
  };
  report("Writing the debrief")(0);
  write_page(out, scene, device, recording, replay, settings);
  report("Drawing the pictures")(0);
  write_stills(out, scene, device, replay, replay.publisher().closest_frame(), trace, settings.stills);
  if (!settings.film) return 0;
  return write_film(out, scene, device, replay, trace, settings.stills.film, report("Drawing the film"));
}

}  // namespace stylet::debrief
