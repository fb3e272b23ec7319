#include "engine/debrief/debrief_files.h"

#include "engine/debrief/skin_entry.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

namespace stylet::debrief {

namespace {

using nlohmann::ordered_json;

ordered_json vector_json(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

ordered_json number_json(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? ordered_json(*value) : ordered_json();
}

/// Columns instead of objects: thousands of moments in a fifth of the bytes.
ordered_json path_json(const std::vector<PathPoint>& path) {
  ordered_json json;
  for (const char* column :
       {"time_s", "tip_m", "tissue", "inserted_m", "force_n", "axial_n", "lateral_n", "target_distance_m"}) {
    json[column] = ordered_json::array();
  }
  for (const PathPoint& p : path) {
    json["time_s"].push_back(p.time_s);
    json["tip_m"].push_back(vector_json(p.tip));
    json["tissue"].push_back(p.tissue);
    json["inserted_m"].push_back(p.inserted);
    json["force_n"].push_back(p.force);
    json["axial_n"].push_back(p.axial);
    json["lateral_n"].push_back(p.lateral);
    json["target_distance_m"].push_back(p.target_distance);
  }
  return json;
}

ordered_json metric_json(const DebriefMetric& metric) {
  ordered_json json;
  json["key"] = metric.key;
  json["title"] = metric.title;
  json["unit"] = metric.unit;
  json["value"] = number_json(metric.value);
  json["expert"] = number_json(metric.expert);
  json["definition"] = metric.definition;
  json["source"] = metric.source;
  if (!metric.points) return json;
  json["points"] = *metric.points;
  json["most_points"] = metric.most_points;
  json["full_at"] = metric.full;
  json["zero_at"] = metric.zero;
  json["critical"] = metric.critical;
  json["failed"] = metric.failed;
  return json;
}

ordered_json score_json(const DebriefScore& score) {
  return {{"total", score.total},
          {"pass_mark", score.pass_mark},
          {"done", score.done},
          {"passed", score.passed},
          {"failed_critical", score.failed_critical}};
}

std::string csv_text(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

std::string csv_number(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? fmt::format("{}", *value) : std::string();
}

}  // namespace

const char* event_kind_name(EventKind kind) {
  switch (kind) {
    case EventKind::stage:
      return "stage";
    case EventKind::puncture:
      return "puncture";
    case EventKind::sample:
      return "sample";
    case EventKind::safety:
      return "safety";
    case EventKind::note:
      break;
  }
  return "note";
}

std::string unit_text(const std::string& unit) {
  if (unit == "mm2") return "mm\u00b2";
  if (unit == "mm/s^2.5") return "mm/s\u00b2\u00b7\u2075";
  return unit;
}

std::string value_text(const std::optional<double>& value, const std::string& unit) {
  if (!value || !std::isfinite(*value)) return "not measured";
  if (unit.empty()) return fmt::format("{:.0f}", *value);
  const double size = std::abs(*value);
  return fmt::format("{:.{}f} {}", *value, size >= 100 ? 0 : size >= 10 ? 1 : 2, unit_text(unit));
}

nlohmann::ordered_json to_json(const DebriefData& data) {
  ordered_json json;
  json["format"] = "stylet-debrief";
  json["version"] = 1;
  json["build"] = data.build;
  json["scenario"] = data.scenario;
  json["title"] = data.title;
  json["stylus"] = data.stylus;
  json["mode"] = data.mode;
  json["force_scale"] = data.force_scale;
  json["duration_s"] = data.duration_s;
  json["cut_off"] = data.cut_off;
  if (data.start_seed) json["start_seed"] = *data.start_seed;
  if (data.score) json["score"] = score_json(*data.score);
  json["attempts_before"] = ordered_json::array();
  for (const DebriefAttempt& attempt : data.attempts) {
    ordered_json& entry = json["attempts_before"].emplace_back();
    entry["folder"] = attempt.folder;
    entry["duration_s"] = attempt.duration_s;
    if (attempt.score) entry["score"] = score_json(*attempt.score);
  }
  json["metrics"] = ordered_json::array();
  for (const DebriefMetric& metric : data.metrics) json["metrics"].push_back(metric_json(metric));
  json["events"] = ordered_json::array();
  for (const DebriefEvent& event : data.events) {
    json["events"].push_back({{"time_s", event.time_s},
                              {"kind", event_kind_name(event.kind)},
                              {"title", event.title},
                              {"detail", event.detail}});
  }
  json["tissues"] = ordered_json::array();
  for (const TissueKey& tissue : data.tissues) json["tissues"].push_back(tissue.name);
  json["arrival_s"] = data.arrival_s;
  json["shaft_m"] = ordered_json::array();
  for (const Eigen::Vector3d& node : data.shaft) json["shaft_m"].push_back(vector_json(node));
  json["targets"] = ordered_json::array();
  for (const TargetMark& target : data.targets) {
    json["targets"].push_back(
        {{"name", target.name}, {"centre_m", vector_json(target.centre)}, {"radius_m", target.radius}});
  }
  json["cores"] = ordered_json::array();
  for (const state::CoreTrack& core : data.cores) {
    ordered_json& entry = json["cores"].emplace_back();
    entry["length_mm"] = std::round(1e6 * core.length()) / 1e3;
    entry["target_percent"] = std::round(1e4 * core.target_share) / 1e2;
    entry["pieces"] = ordered_json::array();
    for (const state::CorePiece& piece : core.pieces) {
      const auto tissue = static_cast<std::size_t>(piece.tissue);
      entry["pieces"].push_back({{"tissue", tissue < data.tissues.size() ? data.tissues[tissue].name : "?"},
                                 {"from", piece.from},
                                 {"to", piece.to},
                                 {"low", piece.low},
                                 {"high", piece.high}});
    }
  }
  json["pictures"] = ordered_json::array();
  for (const DebriefPicture& picture : data.pictures) {
    json["pictures"].push_back({{"time_s", picture.time_s}, {"title", picture.title}, {"caption", picture.caption}});
  }
  if (data.film) {
    json["film"] = {{"file", data.film->file},
                    {"from_s", data.film->from_s},
                    {"to_s", data.film->to_s},
                    {"speed", data.film->speed}};
  }
  json["skin_entry_s"] = number_json(skin_entry_s(data.path));
  json["path"] = path_json(data.path);
  if (!data.expert.empty()) {
    json["expert"] = data.expert;
    json["expert_skin_entry_s"] = number_json(skin_entry_s(data.expert_path));
    json["expert_path"] = path_json(data.expert_path);
  }
  return json;
}

std::string debrief_csv(const DebriefData& data) {
  std::string csv = "row,key,title,value,unit,expert,points,most_points,failed,time_s,detail\r\n";
  if (data.score) {
    csv +=
        fmt::format("score,total,{},{},,,{},100,{},,pass mark {}\r\n", data.score->passed ? "passed" : "not passed",
                    data.score->total, data.score->total, data.score->failed_critical, data.score->pass_mark);
  }
  for (const DebriefMetric& metric : data.metrics) {
    const bool scored = metric.points.has_value();
    csv += fmt::format("metric,{},{},{},{},{},{},{},{},,{}\r\n", csv_text(metric.key), csv_text(metric.title),
                       csv_number(metric.value), csv_text(metric.unit), csv_number(metric.expert),
                       csv_number(metric.points), scored ? fmt::format("{}", metric.most_points) : "",
                       scored ? fmt::format("{}", metric.failed) : "", csv_text(metric.definition));
  }
  for (const DebriefEvent& event : data.events) {
    csv += fmt::format("event,{},{},,,,,,,{},{}\r\n", event_kind_name(event.kind), csv_text(event.title),
                       event.time_s, csv_text(event.detail));
  }
  return csv;
}

std::string path_csv(const DebriefData& data) {
  std::string csv =
      "who,time_s,tip_x_m,tip_y_m,tip_z_m,tissue,inserted_m,force_n,axial_n,lateral_n,target_distance_m\r\n";
  const auto rows = [&](const char* who, const std::vector<PathPoint>& path) {
    for (const PathPoint& p : path) {
      const auto tissue = static_cast<std::size_t>(p.tissue);
      csv += fmt::format("{},{},{},{},{},{},{},{},{},{},{}\r\n", who, p.time_s, p.tip.x(), p.tip.y(), p.tip.z(),
                         tissue < data.tissues.size() ? csv_text(data.tissues[tissue].name) : "", p.inserted, p.force,
                         p.axial, p.lateral, csv_number(p.target_distance));
    }
  };
  rows("trainee", data.path);
  rows("expert", data.expert_path);
  return csv;
}

}  // namespace stylet::debrief
