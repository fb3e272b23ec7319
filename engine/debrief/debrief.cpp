#include "engine/debrief/debrief.h"

#include "engine/debrief/collect.h"
#include "engine/debrief/debrief_files.h"
#include "engine/debrief/page.h"
#include "engine/debrief/session_replay.h"
#include "engine/debrief/still_moment.h"
#include "engine/session/puncture_event.h"
#include "engine/training/flow.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace stylet::debrief {

using figures::TraceEvent;
using recording::EventRecord;
using recording::Recording;
using session::PunctureEvent;

namespace {

/// For the table: each puncture under the name of the tissue entered; without any (the paper's couplings) the bodies
/// entered and left.
std::vector<TraceEvent> trace_events(const Recording& recording) {
  std::vector<TraceEvent> events;
  for (const PunctureEvent& puncture : session::punctures(recording.events))
    events.push_back({puncture.time_s, puncture.to});
  const bool punctured = !events.empty();
  for (const EventRecord& event : recording.events) {
    const bool body = event.name == "entered" || event.name == "left";
    if (event.name == session::kPunctureEvent || (punctured && body)) continue;
    events.push_back({event.time_s, event.name});
  }
  return events;
}

/// For the figure: what the force tells of, in few words. Stages begin with what is marked already; what a core or a
/// zone came to follows from it; what was refused did not happen.
std::vector<TraceEvent> felt_events(const Recording& recording) {
  std::vector<EventRecord> felt = recording.events;
  std::erase_if(felt, [](const EventRecord& event) {
    return event.name == training::flow_event::kStage || event.name == training::flow_event::kRefused ||
           is_result(event);
  });
  std::vector<TraceEvent> events;
  for (const DebriefEvent& event : events_of(felt)) {
    constexpr std::string_view kInto = "Into ";
    const bool puncture = event.kind == EventKind::puncture && event.title.starts_with(kInto);
    events.push_back({event.time_s, puncture ? event.title.substr(kInto.size()) : event.title});
  }
  return events;
}

/// What lies closer together than its names are wide in a figure gets one mark; the same again is not said twice.
std::vector<TraceEvent> figure_marks(std::vector<TraceEvent> events, double duration_s) {
  constexpr double kWidth = 0.012;  // of the time axis
  constexpr int kMostNames = 3;
  std::stable_sort(events.begin(), events.end(),
                   [](const TraceEvent& a, const TraceEvent& b) { return a.time_s < b.time_s; });
  std::vector<TraceEvent> marks;
  std::string last;
  int names = 0;
  for (TraceEvent& event : events) {
    if (marks.empty() || event.time_s >= marks.back().time_s + kWidth * duration_s) {
      last = event.name;
      names = 1;
      marks.push_back(std::move(event));
    } else if (event.name != last && ++names <= kMostNames + 1) {
      last = event.name;
      marks.back().name += names <= kMostNames ? ", " + event.name : ", ...";
    }
  }
  return marks;
}

}  // namespace

void write_force(const files::OutputDirectory& out, const Recording& recording, const figures::ForceTrace& trace) {
  figures::write_force_csv(out.staged("force.csv"), trace, trace_events(recording));
  picture::write_png(
      out.staged("force.png"),
      figures::draw_force_figure(trace, figure_marks(felt_events(recording), trace.summary().duration_s),
                                 figures::Font::load()));
}

void write_page(const files::OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
                const Recording& recording, SessionReplay& replay, const DebriefSettings& settings) {
  const std::vector<training::Metric> metrics =
      settings.metrics.empty() ? training::measure(replay.trace(), scene) : settings.metrics;
  DebriefData data = collect(scene, recording, replay, metrics, settings.expert);
  data.attempts = settings.attempts;
  data.pictures = draw_key_moments(scene, device, recording, replay);
  out.write("debrief.html", debrief_page(data));
  out.write("debrief.json",
            to_json(data).dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
  out.write("debrief.csv", debrief_csv(data));
  out.write("path.csv", path_csv(data));
}

int write_debrief(const files::OutputDirectory& out, const ReplayedSession& session, gpu::Device& device,
                  const DebriefSettings& settings, const DebriefProgress& progress) {
  const auto& [scene, recording, replay, force] = session;
  const auto report = [&](const std::string& doing) {
    return [&progress, doing](double share) {
      if (progress) progress(doing, share);
    };
  };
  report("Writing the debrief")(0);
  write_page(out, scene, device, recording, replay, settings);
  report("Drawing the pictures")(0);
  write_stills(out, scene, device, replay, still_moment(recording.events, replay.frames()).time_s, force,
               settings.stills);
  if (!settings.film) return 0;
  return write_film(out, scene, device, replay, force, settings.stills.film, report("Drawing the film"));
}

}  // namespace stylet::debrief
