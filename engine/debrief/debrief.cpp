#include "engine/debrief/debrief.h"

#include "engine/debrief/collect.h"
#include "engine/debrief/debrief_files.h"
#include "engine/debrief/page.h"
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
  const picture::Picture figure = figures::draw_force_figure(
      trace, figure_marks(felt_events(recording), trace.summary().duration_s), figures::Font::load());
  out.named_in_place([&] {
    figures::write_force_csv(out.staged("force.csv"), trace, trace_events(recording));
    picture::write_png(out.staged("force.png"), figure);
  });
}

namespace {

const std::vector<std::string> kPageFiles{"debrief.json", "debrief.csv", "path.csv", "debrief.html"};

void write_page_files(const files::OutputDirectory& out, const DebriefData& data) {
  out.write("debrief.json",
            to_json(data).dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
  out.write("debrief.csv", debrief_csv(data));
  out.write("path.csv", path_csv(data));
  out.write("debrief.html", debrief_page(data));
}

DebriefData collect_all(const content::Scene& scene, const Recording& recording, Footage& footage,
                        const DebriefSettings& settings) {
  DebriefData data = collect(scene, recording, footage,
                             settings.metrics.empty() ? training::measure(footage.trace(), scene) : settings.metrics,
                             settings.expert);
  data.attempts = settings.attempts;
  return data;
}

/// Of the key moments and those that the trainee saved, as they came.
std::vector<DebriefPicture> in_order(std::vector<DebriefPicture> pictures, const std::vector<DebriefPicture>& saved) {
  pictures.insert(pictures.end(), saved.begin(), saved.end());
  std::ranges::stable_sort(pictures, {}, &DebriefPicture::time_s);
  return pictures;
}

}  // namespace

void write_page(const files::OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
                const Recording& recording, Footage& footage, const DebriefSettings& settings) {
  DebriefData data = collect_all(scene, recording, footage, settings);
  KeyMomentPictures pictures(scene, device, recording, footage);
  while (pictures.draw_next()) {
  }
  data.pictures = in_order(pictures.take(), settings.saved);
  if (settings.film) data.film = film_of(footage.frames(), settings.stills.film);
  write_page_files(out, data);
}

DebriefWork::DebriefWork(files::OutputDirectory& out, const KeptSession& session, DebriefSettings settings)
    : out_(out), session_(session), settings_(std::move(settings)) {}

DebriefWork::~DebriefWork() = default;

DebriefWork::Piece DebriefWork::after_page() const {
  if (!stills_written_) return Piece::stills;
  return settings_.film && film_frames_ == 0 ? Piece::film : Piece::nothing;
}

void DebriefWork::write_page() {
  DebriefData data = collect_all(session_.scene, session_.recording, session_.footage, settings_);
  data.pictures = in_order(pictures_, settings_.saved);
  if (film_frames_ > 0) data.film = film_of(session_.footage.frames(), settings_.stills.film);
  write_page_files(out_, data);
  out_.publish(kPageFiles);
  page_written_ = true;
}

void DebriefWork::step(gpu::Device& device) {
  const auto& [scene, recording, footage, force] = session_;
  bool drawn = false;
  switch (next_) {
    case Piece::moments:
      if (!moments_) moments_ = std::make_unique<KeyMomentPictures>(scene, device, recording, footage);
      if (moments_->draw_next()) return;
      pictures_ = moments_->take();
      moments_.reset();
      next_ = Piece::page;
      return;
    case Piece::page:
      write_page();
      next_ = film_ ? Piece::film : after_page();
      return;
    case Piece::stills:
      write_stills(out_, scene, device, footage, still_moment(recording.events, footage.frames()).time_s, force,
                   settings_.stills);
      out_.publish({"view.png", "ultrasound.png", "session.png"});
      stills_written_ = true;
      next_ = after_page();
      return;
    case Piece::film:
      out_.named_in_place([&] {
        if (!film_) {
          film_ = std::make_unique<Film>(out_, session_.scene, device, session_.footage, session_.force,
                                         settings_.stills.film);
        }
        drawn = !film_->draw_next();
      });
      if (!drawn) return;
      film_frames_ = film_->frames();
      film_.reset();
      out_.publish({"session.mp4"});
      next_ = Piece::page;
      return;
    case Piece::nothing:
      return;
  }
}

void DebriefWork::release_device() {
  moments_.reset();
  film_.reset();
}

void DebriefWork::give_up() {
  release_device();
  next_ = Piece::nothing;
}

void DebriefWork::compare_with(Expert expert) {
  settings_.expert = std::move(expert);
  if (page_written_) next_ = Piece::page;
}

void DebriefWork::add_film() {
  settings_.film = true;
  if (next_ == Piece::nothing) next_ = after_page();
}

std::string DebriefWork::doing() const {
  switch (next_) {
    case Piece::moments:
    case Piece::page:
      return "Writing the debrief";
    case Piece::stills:
      return "Drawing the pictures";
    case Piece::film:
      return "Drawing the film";
    case Piece::nothing:
      break;
  }
  return "";
}

double DebriefWork::share() const {
  if (next_ == Piece::moments) return moments_ ? moments_->share() : 0;
  if (next_ == Piece::film) return film_ ? film_->share() : 0;
  return next_ == Piece::page ? 1 : 0;
}

}  // namespace stylet::debrief
