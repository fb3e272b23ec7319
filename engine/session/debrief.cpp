#include "engine/session/debrief.h"

#include "engine/session/frame_clock.h"
#include "engine/session/frame_publisher.h"
#include "engine/session/pictures.h"
#include "engine/session/puncture_event.h"
#include "engine/session/video.h"
#include "engine/view/panes.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace stylet::session {

namespace {

/// Each puncture under the name of the tissue entered; without any (the paper's couplings) the bodies entered and
/// left.
std::vector<TraceEvent> trace_events(const Recording& recording) {
  std::vector<TraceEvent> events;
  for (const PunctureEvent& puncture : punctures(recording)) events.push_back({puncture.time_s, puncture.to});
  const bool punctured = !events.empty();
  for (const EventRecord& event : recording.events) {
    const bool body = event.name == "entered" || event.name == "left";
    if (event.name == kPunctureEvent || (punctured && body)) continue;
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

Debrief write_debrief(const OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
                      const Recording& recording, const ForceTrace& trace, const DebriefSettings& settings,
                      const DebriefProgress& progress) {
  const auto report = [&](const std::string& doing, double share) {
    if (progress) progress(doing, share);
  };
  const Font font = Font::load();
  const RecordedSettings recorded = recorded_settings(recording);
  const std::vector<TraceEvent> events = trace_events(recording);
  write_force_csv(out.staged("force.csv"), trace, events);
  view::write_png(out.staged("force.png"),
                  draw_force_figure(trace, figure_marks(events, trace.summary().duration_s), font));

  const int width = settings.video_width;
  const int height = settings.video_height;
  const view::PaneLayout layout = view::PaneLayout::of(width, height, true);
  Pictures panes(device, scene,
                 {.view_width = settings.stereo ? layout.scene.width / 2 : layout.scene.width,
                  .view_height = layout.scene.height,
                  .ultrasound_width = layout.ultrasound.width,
                  .ultrasound_height = layout.ultrasound.height,
                  .stereo = settings.stereo});
  // A frame takes a software rasteriser most of a second.
  const int frames_per_second = settings.frames_per_second / (device.identity().is_lavapipe() ? 2 : 1);
  VideoWriter video(out.staged("session.mp4"),
                    {.width = width, .height = height, .frames_per_second = frames_per_second});
  StepHash hash;
  FramePublisher frames(scene);
  FrameClock clock(frames, {.frames_per_second = static_cast<double>(frames_per_second)},
                   [&](int, const state::FrameState& state) {
                     const Pictures::Moment moment = panes.draw(state, scene.camera);
                     video.add_frame(compose_frame(moment, state, trace, font, width, height).rgba);
                   });
  Debrief debrief;
  CoupledLoops loops(scene, recorded.coupling, recorded.start, {&hash, &frames, &clock}, recorded.base);
  debrief.replay =
      replay(recording, loops, hash, [&](double share) { report("Replaying and drawing the video", share); });
  debrief.state_hash = hash.state();
  video.finish();
  debrief.video_frames = clock.frames();

  report("Drawing the pictures", 0);
  const state::FrameState& moment = frames.closest_frame();
  view::write_png(out.staged("session.png"),
                  compose_frame(panes.draw(moment, scene.camera), moment, trace, font, width, height));
  Pictures stills(device, scene,
                  {.view_width = settings.view_width,
                   .view_height = settings.view_height,
                   .ultrasound_width = 960,
                   .ultrasound_height = 720,
                   .stereo = settings.stereo});
  const Pictures::Moment closest = stills.draw(moment, scene.camera);
  view::write_png(out.staged("view.png"), closest.view);
  view::write_png(out.staged("ultrasound.png"), closest.ultrasound);
  return debrief;
}

}  // namespace stylet::session
