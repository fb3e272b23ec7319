// What a session came to, as a debrief shows it: the page, the JSON and the CSV are three ways to write this.
#pragma once

#include "engine/state/frame_state.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace stylet::debrief {

/// A measured quantity, and what it scored.
struct DebriefMetric {
  std::string key{};
  std::string title{};
  std::string unit{};             ///< empty: a count
  std::optional<double> value{};  ///< in the unit; none: there was nothing to measure it on
  std::optional<double> expert{};
  std::string definition{};
  std::string source{};
  // Where the scenario scores it.
  std::optional<double> points{};
  double most_points = 0;
  double full = 0;  ///< value that gets all points
  double zero = 0;  ///< value that gets none
  bool critical = false;
  bool failed = false;  ///< critical, and without points
};

struct DebriefScore {
  double total = 0;  ///< of 100
  double pass_mark = 0;
  bool done = true;  ///< something was sampled or treated
  bool passed = false;
  bool failed_critical = false;
};

/// An attempt of the same session before the one that is debriefed.
struct DebriefAttempt {
  std::string folder{};  ///< of its results, beside the page's; empty: the page's own
  double duration_s = 0;
  std::optional<DebriefScore> score{};  ///< none: the scenario scores nothing
};

/// stage: from here to the next one or the end.
enum class EventKind : std::uint8_t { stage, puncture, sample, safety, note };
const char* event_kind_name(EventKind kind);

struct DebriefEvent {
  double time_s = 0;
  EventKind kind = EventKind::note;
  std::string title{};
  std::string detail{};
};

/// A moment of a needle's way. SI, patient frame.
struct PathPoint {
  double time_s = 0;
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();
  int tissue = 0;  ///< at the tip, index into DebriefData::tissues
  double inserted = 0;
  double force = 0;    ///< on the hand, norm
  double axial = 0;    ///< against insertion
  double lateral = 0;  ///< across the needle
  double target_distance = 0;
};

struct TissueKey {
  std::string name{};
  std::array<float, 3> colour{};  ///< linear RGB
};

struct TargetMark {
  std::string name{};
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0;
};

/// A surface of the patient with few triangles, to see the path by.
struct Outline {
  std::string name{};
  bool shown = true;              ///< when the page opens
  std::array<float, 3> colour{};  ///< linear RGB
  std::vector<Eigen::Vector3f> vertices{};
  std::vector<std::array<std::uint32_t, 3>> triangles{};
};

struct DebriefPicture {
  double time_s = 0;
  std::string title{};    ///< "Liver capsule"
  std::string caption{};  ///< what is to be seen
  std::string png{};      ///< bytes of the file
};

/// A film of the session that lies beside the page.
struct DebriefFilm {
  std::string file{};  ///< a plain name
  double from_s = 0;   ///< session time of its first frame
  double to_s = 0;     ///< and of its last
  double speed = 1;    ///< session time over film time

  /// Where in the film a moment of the session is, s; none: the film does not have it.
  std::optional<double> at(double time_s) const {
    if (time_s < from_s - 0.05 || time_s > to_s + 0.05) return std::nullopt;  // an event may lie between frames
    return std::clamp(time_s, from_s, to_s) / speed - from_s / speed;
  }
};

struct DebriefData {
  std::string title{};     ///< of the scenario, for people
  std::string scenario{};  ///< its name
  std::string build{};
  std::string stylus{};
  std::string mode{};
  double force_scale = 1;  ///< of the needle's force that the stylus was given
  double duration_s = 0;
  bool cut_off = false;                       ///< the recording ends before its session did
  std::optional<std::uint32_t> start_seed{};  ///< of the start that was drawn
  std::vector<DebriefAttempt> attempts{};     ///< before this one, the first first
  std::optional<DebriefScore> score{};
  std::vector<DebriefMetric> metrics{};
  std::vector<DebriefEvent> events{};  ///< times ascending
  std::vector<TissueKey> tissues{};
  std::vector<PathPoint> path{};
  std::string expert{};  ///< who; empty: nobody to compare with
  std::vector<PathPoint> expert_path{};
  double arrival_s = 0;                  ///< the moment that shaft, targets and outlines show
  std::vector<Eigen::Vector3d> shaft{};  ///< of the needle, hub first
  std::vector<TargetMark> targets{};
  std::vector<Outline> outlines{};
  std::vector<state::CoreTrack> cores{};           ///< of a biopsy, in their order
  std::vector<DebriefPicture> pictures{};          ///< times ascending
  std::optional<DebriefFilm> film{};               ///< none: there is none to look at
  Eigen::Vector3d eye = Eigen::Vector3d(0, 0, 1);  ///< of the scenario's camera
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();
};

}  // namespace stylet::debrief
