#include "engine/debrief/page.h"

#include "engine/debrief/debrief_files.h"
#include "engine/debrief/page_assets.h"
#include "engine/debrief/skin_entry.h"
#include "engine/figures/svg_plot.h"
#include "engine/files/html.h"
#include "engine/session/state_hash.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace stylet::debrief {

namespace {

using figures::SvgMark;
using figures::SvgPlot;
using figures::TimelineBand;
using files::html::base64;
using files::html::escaped;
using nlohmann::ordered_json;

/// sRGB of a linear colour, as CSS.
std::string css_colour(const std::array<float, 3>& linear) {
  const auto byte = [](float v) {
    const double c = std::clamp(static_cast<double>(v), 0.0, 1.0);
    return static_cast<int>(std::lround(255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055)));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(linear[0]), byte(linear[1]), byte(linear[2]));
}

/// "abdominal_wall" for people, escaped.
std::string in_words(std::string name) {
  std::ranges::replace(name, '_', ' ');
  return escaped(name);
}

/// JSON that may stand within a script element.
std::string embedded(const ordered_json& json) {
  const std::string text = json.dump(-1, ' ', true, ordered_json::error_handler_t::replace);
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    if (c == '<' || c == '>' || c == '&') {
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    } else {
      out += c;
    }
  }
  return out;
}

constexpr double kApproach = 0.02;  // m, of the way to the skin that plots against depth show

/// What is far outside is left out.
std::vector<double> depths_mm(const std::vector<PathPoint>& path) {
  std::vector<double> depths = depth_from_entry(path);
  for (double& depth : depths) depth = depth < -kApproach ? std::numeric_limits<double>::quiet_NaN() : depth * 1e3;
  return depths;
}

/// The moments that the plot of depth against time has at 0, so that one lies on the other.
struct Alignment {
  bool entry = false;  ///< the skin's; else the beginning
  double trainee_s = 0;
  double expert_s = 0;
};
Alignment alignment_of(const DebriefData& data) {
  const std::optional<double> trainee = skin_entry_s(data.path);
  const std::optional<double> expert = skin_entry_s(data.expert_path);
  if (!trainee || (!data.expert.empty() && !expert)) return {};
  return {.entry = true, .trainee_s = *trainee, .expert_s = expert.value_or(0)};
}

/// To the moment in the film, as a browser's player understands it; the text alone where there is no film of it.
std::string film_link(const DebriefData& data, double time_s, const std::string& text) {
  const std::optional<double> at = data.film ? data.film->at(time_s) : std::nullopt;
  if (!at) return text;
  return fmt::format(R"(<a class="film" href="{}#t={:.2f}" target="film" title="The film at this moment">{}</a>)",
                     escaped(data.film->file), *at, text);
}

/// debrief.json and what only the page shows.
ordered_json page_json(const DebriefData& data) {
  ordered_json json = to_json(data);
  json["tissue_colours"] = ordered_json::array();
  for (const TissueKey& tissue : data.tissues) json["tissue_colours"].push_back(css_colour(tissue.colour));
  json["outlines"] = ordered_json::array();
  for (const Outline& outline : data.outlines) {
    ordered_json& entry = json["outlines"].emplace_back();
    entry["name"] = outline.name;
    entry["colour"] = css_colour(outline.colour);
    ordered_json& vertices = entry["vertices_mm"] = ordered_json::array();
    for (const Eigen::Vector3f& v : outline.vertices) {
      for (int axis = 0; axis < 3; ++axis) vertices.push_back(std::round(v[axis] * 1e4F) / 10.0);
    }
    ordered_json& triangles = entry["triangles"] = ordered_json::array();
    for (const auto& triangle : outline.triangles) {
      for (const std::uint32_t corner : triangle) triangles.push_back(corner);
    }
  }
  json["depth_mm"] = ordered_json::array();
  for (const double depth : depths_mm(data.path)) {
    json["depth_mm"].push_back(std::isfinite(depth) ? ordered_json(std::round(depth * 100) / 100) : ordered_json());
  }
  json["depth_time_zero_s"] = alignment_of(data).trainee_s;
  json["eye"] = {data.eye.x(), data.eye.y(), data.eye.z()};
  json["up"] = {data.up.x(), data.up.y(), data.up.z()};
  return json;
}

std::string number_attribute(const char* name, const std::optional<double>& value) {
  return value && std::isfinite(*value) ? fmt::format(" data-{}=\"{}\"", name, *value) : std::string();
}

void append_verdict(std::string& html, const DebriefData& data) {
  auto out = std::back_inserter(html);
  if (!data.score) {
    html += "<div class=\"verdict none\"><b>Measured</b><span>this scenario gives no points</span></div>";
    return;
  }
  const DebriefScore& score = *data.score;
  const std::string reason = !score.done ? "nothing was sampled or treated: there is nothing to give points for"
                             : score.failed_critical ? "a critical criterion was not met"
                             : score.passed ? fmt::format("at or above the pass mark of {:.0f}", score.pass_mark)
                                            : fmt::format("below the pass mark of {:.0f}", score.pass_mark);
  fmt::format_to(out,
                 R"(<div class="verdict {}"><b id="total" data-value="{}">{:.0f}<small> / 100</small></b>)"
                 R"(<strong>{}</strong><span>{}</span></div>)",
                 score.passed ? "passed" : "failed", score.total, score.total,
                 score.passed ? "\u2713 Passed" : "\u2717 Not passed", reason);
}

void append_header(std::string& html, const DebriefData& data) {
  fmt::format_to(
      std::back_inserter(html),
      R"(<header><div><p class="brand">Stylet debrief</p><h1>{}</h1><p class="facts">{} &middot; {:.1f} s )"
      R"(&middot; {} &middot; {}{}{}</p></div>)",
      escaped(data.title), escaped(data.scenario), data.duration_s, escaped(data.stylus), escaped(data.mode),
      data.force_scale < 1 ? fmt::format(" &middot; felt at {:.0f} % of the forces below", 100 * data.force_scale)
                           : std::string(),
      data.start_seed ? fmt::format(" &middot; start {}", *data.start_seed) : std::string());
  append_verdict(html, data);
  html += "</header>\n";
  if (data.cut_off) {
    html += "<p class=\"notice\">The session was cut off: this debrief ends where its recording does.</p>\n";
  }
}

std::string band_text(const DebriefMetric& metric) {
  const std::string unit = metric.unit.empty() ? "" : fmt::format(" {}", unit_text(metric.unit));
  return fmt::format("all points at {:g}{}, none at {:g}{}", metric.full, unit, metric.zero, unit);
}

void append_metric_row(std::string& html, const DebriefMetric& metric, bool scored, bool compared) {
  auto out = std::back_inserter(html);
  fmt::format_to(out, R"(<tr{}><th scope="row" title="{}">{}{}<small>{}</small></th>)",
                 metric.failed ? " class=\"failed\"" : "", escaped(metric.source), escaped(metric.title),
                 metric.critical ? " <em>critical</em>" : "",
                 scored ? escaped(band_text(metric)) : escaped(metric.definition));
  fmt::format_to(out, R"(<td class="value" data-key="{}"{}>{}</td>)", escaped(metric.key),
                 number_attribute("value", metric.value), escaped(value_text(metric.value, metric.unit)));
  if (compared) {
    fmt::format_to(out, R"(<td class="expert"{}>{}</td>)", number_attribute("expert", metric.expert),
                   metric.expert ? escaped(value_text(metric.expert, metric.unit)) : "&ndash;");
  }
  if (scored) {
    const double points = metric.points.value_or(0);
    const double share = metric.most_points > 0 ? points / metric.most_points : 0;
    fmt::format_to(out,
                   R"(<td class="points"{}><span class="bar"><i class="{}" style="width:{:.0f}%"></i></span>)"
                   R"({:.1f}<small> of {:.1f}</small></td>)",
                   number_attribute("points", metric.points),
                   share >= 0.7   ? "good"
                   : share >= 0.3 ? "fair"
                                  : "poor",
                   100 * share, points, metric.most_points);
  }
  html += "</tr>\n";
}

void append_metrics(std::string& html, const DebriefData& data, bool scored) {
  const bool any = std::ranges::any_of(data.metrics, [&](const auto& m) { return m.points.has_value() == scored; });
  if (!any) return;
  const bool compared = !data.expert.empty();
  html += scored ? "<section><h2>What scored</h2>" : "<section><h2>What else was measured</h2>";
  html += "<table class=\"metrics\"><thead><tr><th></th><th>You</th>";
  if (compared) html += "<th>Expert</th>";
  if (scored) html += "<th>Points</th>";
  html += "</tr></thead><tbody>\n";
  std::vector<const DebriefMetric*> rows;
  for (const DebriefMetric& metric : data.metrics) {
    if (metric.points.has_value() == scored) rows.push_back(&metric);
  }
  std::ranges::stable_sort(rows, std::greater{}, &DebriefMetric::most_points);  // what counts most first
  for (const DebriefMetric* metric : rows) append_metric_row(html, *metric, scored, compared);
  html += "</tbody></table></section>\n";
}

/// The attempts of the session, this one last.
void append_attempts(std::string& html, const DebriefData& data) {
  if (data.attempts.empty()) return;
  html +=
      "<section><h2>Attempts</h2><table class=\"events\" id=\"attempts\"><thead><tr><th>#</th><th>Score</th><th></th>"
      "<th>Session</th><th></th></tr></thead><tbody>\n";
  int number = 0;
  const auto append = [&](const DebriefAttempt& attempt) {
    const bool scored = attempt.score && attempt.score->done;
    const char* verdict = !attempt.score          ? "measured"
                          : !scored               ? "nothing was sampled or treated"
                          : attempt.score->passed ? "\u2713 passed"
                                                  : "\u2717 not passed";
    const std::string where =
        attempt.folder.empty()
            ? std::string("this one")
            : fmt::format("<a href=\"{0}/debrief.html\">{0}/debrief.html</a>", escaped(attempt.folder));
    fmt::format_to(std::back_inserter(html),
                   "<tr><td>{}</td><td>{}</td><td>{}</td><td>{:.1f} s</td><td>{}</td></tr>\n", ++number,
                   scored ? fmt::format("{:.0f} / 100", attempt.score->total) : "&ndash;", verdict,
                   attempt.duration_s, where);
  };
  std::ranges::for_each(data.attempts, append);
  append({.duration_s = data.duration_s, .score = data.score});
  html += "</tbody></table></section>\n";
}

/// Events but stages, numbered as in the plots.
std::vector<SvgMark> numbered_marks(const DebriefData& data) {
  std::vector<SvgMark> marks;
  for (const DebriefEvent& event : data.events) {
    if (event.kind == EventKind::stage) continue;
    marks.push_back({.x = event.time_s,
                     .number = std::to_string(marks.size() + 1),
                     .title = fmt::format("{:.2f} s: {}", event.time_s, event.title),
                     .name = event_kind_name(event.kind)});
  }
  return marks;
}

/// The cores as they lie in a dish, the needle's tip on the left, all to one scale.
void append_cores(std::string& html, const DebriefData& data) {
  if (data.cores.empty()) return;
  constexpr float kPixels = 8e3F;  // a meter: the longest is as wide as a telephone
  html += "<ul class=\"cores\">";
  auto out = std::back_inserter(html);
  int number = 0;
  for (const state::CoreTrack& core : data.cores) {
    fmt::format_to(out, R"(<li><svg width="{:.0f}" height="14" viewBox="0 0 1 1" preserveAspectRatio="none">)",
                   std::max(kPixels * core.length(), 1.0F));
    for (const state::CorePiece& piece : core.pieces) {
      const auto tissue = static_cast<std::size_t>(piece.tissue);
      if (tissue == 0 || tissue >= data.tissues.size()) continue;
      std::array<float, 3> colour = data.tissues[tissue].colour;
      for (float& c : colour) c *= piece.shade();
      fmt::format_to(out, R"(<rect x="{:.4f}" y="{:.4f}" width="{:.4f}" height="{:.4f}" fill="{}"/>)", piece.from,
                     piece.low, piece.to - piece.from, piece.high - piece.low, css_colour(colour));
    }
    fmt::format_to(out, "</svg> core {}: {:.0f} mm, {:.0f} % target</li>\n", ++number, 1e3F * core.length(),
                   100 * core.target_share);
  }
  html += "</ul>\n";
}

void append_course(std::string& html, const DebriefData& data) {
  std::vector<TimelineBand> bands;
  for (const DebriefEvent& event : data.events) {
    if (event.kind != EventKind::stage) continue;
    if (!bands.empty()) bands.back().to_s = event.time_s;
    bands.push_back({.from_s = event.time_s, .to_s = data.duration_s, .label = event.title});
  }
  html += "<section><h2>Course</h2><div class=\"wide\">";
  html += figures::svg_timeline(data.duration_s, bands, numbered_marks(data));
  html +=
      "</div><table class=\"events\"><thead><tr><th>#</th><th>Time</th><th>Event</th><th></th></tr></thead><tbody>\n";
  int number = 0;
  for (const DebriefEvent& event : data.events) {
    const bool stage = event.kind == EventKind::stage;
    fmt::format_to(std::back_inserter(html),
                   R"(<tr class="{}" data-time="{}"><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>)"
                   "\n",
                   event_kind_name(event.kind), event.time_s, stage ? std::string() : std::to_string(++number),
                   film_link(data, event.time_s, fmt::format("{:.2f} s", event.time_s)), escaped(event.title),
                   escaped(event.detail));
  }
  html += "</tbody></table>\n";
  append_cores(html, data);
  html += "</section>\n";
}

template <typename Of>
std::vector<double> column(const std::vector<PathPoint>& path, const Of& of) {
  std::vector<double> values;
  values.reserve(path.size());
  for (const PathPoint& p : path) values.push_back(of(p));
  return values;
}
double time_of(const PathPoint& p) {
  return p.time_s;
}
double inserted_mm(const PathPoint& p) {
  return p.inserted * 1e3;
}
double distance_mm(const PathPoint& p) {
  return p.target_distance * 1e3;
}

void append_plots(std::string& html, const DebriefData& data) {
  const auto& path = data.path;
  const bool compared = !data.expert.empty();
  const std::vector<SvgMark> marks = numbered_marks(data);
  const auto axial = [](const PathPoint& p) { return p.axial; };
  const auto lateral = [](const PathPoint& p) { return p.lateral; };
  html += "<section><h2>Force</h2><div class=\"plots\">";
  html +=
      figures::svg_plot({.id = "force_time",
                         .title = "Force on the hand",
                         .x_label = "time, s",
                         .y_label = "N",
                         .lines = {{"axial", "against insertion", column(path, time_of), column(path, axial)},
                                   {"lateral", "across the needle", column(path, time_of), column(path, lateral)}},
                         .marks = marks,
                         .wide = true});
  SvgPlot depth{.id = "force_depth",
                .title = "Force against depth",
                .x_label = "depth from the skin entry, mm",
                .y_label = "N",
                .lines = {{"axial", "against insertion", depths_mm(path), column(path, axial)},
                          {"lateral", "across the needle", depths_mm(path), column(path, lateral)}}};
  const Alignment zero = alignment_of(data);
  const auto times_from = [](const std::vector<PathPoint>& of, double zero_s) {
    return column(of, [zero_s](const PathPoint& p) { return p.time_s - zero_s; });
  };
  const std::vector<double> times = times_from(path, zero.trainee_s);
  SvgPlot course{.id = "depth_time",
                 .title = "Depth and distance to the target",
                 .x_label = zero.entry ? "time from the skin entry, s" : "time, s",
                 .y_label = "mm",
                 .lines = {{"depth", "needle in tissue", times, column(path, inserted_mm)}},
                 .marks = marks};
  for (SvgMark& mark : course.marks) mark.x -= zero.trainee_s;
  if (!data.targets.empty()) course.lines.push_back({"distance", "tip to target", times, column(path, distance_mm)});
  if (compared) {
    const auto& expert = data.expert_path;
    depth.lines.push_back({"axial", "expert", depths_mm(expert), column(expert, axial), true});
    course.lines.push_back({"depth", "expert", times_from(expert, zero.expert_s), column(expert, inserted_mm), true});
  }
  html += figures::svg_plot(depth);
  html += figures::svg_plot(course);
  html += "</div></section>\n";
}

void append_way(std::string& html, const DebriefData& data) {
  html +=
      "<section><h2>The needle's way</h2><div class=\"way\"><div class=\"stage\"><canvas id=\"way\" width=\"1040\" "
      "height=\"760\" tabindex=\"0\" aria-label=\"The way of the needle's tip in three dimensions\"></canvas>"
      "<noscript><p>The turning picture needs scripts; path.csv holds its points.</p></noscript></div><div "
      "class=\"side\"><p class=\"hint script\">Drag to turn, wheel to zoom, double click to put back.</p><p "
      "class=\"script\"><label><input type=\"radio\" name=\"colour\" value=\"tissue\" checked> tissue</label> "
      "<label><input type=\"radio\" name=\"colour\" value=\"speed\"> speed of the tip</label></p><ul class=\"keys\" "
      "id=\"tissues\">";
  auto out = std::back_inserter(html);
  std::vector<bool> met(data.tissues.size(), false);
  for (const PathPoint& p : data.path) {
    if (static_cast<std::size_t>(p.tissue) < met.size()) met[p.tissue] = true;
  }
  for (std::size_t i = 0; i < met.size(); ++i) {
    if (!met[i]) continue;
    fmt::format_to(out, R"(<li><i style="background:{}"></i>{}</li>)", css_colour(data.tissues[i].colour),
                   in_words(data.tissues[i].name));
  }
  html += "</ul><ul class=\"keys\"><li><i class=\"shaft\"></i>needle";
  fmt::format_to(out, " at {:.2f} s</li>", data.arrival_s);
  if (!data.expert.empty()) {
    fmt::format_to(
        out, R"(<li><label><input type="checkbox" id="show_expert" checked> <i class="expert"></i>{}</label></li>)",
        escaped(data.expert));
  }
  for (std::size_t i = 0; i < data.outlines.size(); ++i) {
    fmt::format_to(out,
                   R"(<li><label><input type="checkbox" class="show_outline" value="{}"{}> <i )"
                   R"(style="background:{}"></i>{}</label></li>)",
                   i, data.outlines[i].shown ? " checked" : "", css_colour(data.outlines[i].colour),
                   in_words(data.outlines[i].name));
  }
  html += "</ul><p class=\"script\" id=\"now\"></p>";
  if (data.film) {
    fmt::format_to(out,
                   R"(<p class="script"><a class="film" id="film_now" href="{0}" data-file="{0}" data-from="{1}" )"
                   R"(data-to="{2}" data-speed="{3}" target="film">Film at this moment</a></p>)",
                   escaped(data.film->file), data.film->from_s, data.film->to_s, data.film->speed);
  }
  html +=
      "<input class=\"script\" type=\"range\" id=\"time\" min=\"0\" "
      "max=\"1000\" value=\"0\" aria-label=\"Time\"></div></div></section>\n";
}

void append_pictures(std::string& html, const DebriefData& data) {
  if (data.pictures.empty()) return;
  html += "<section><h2>Ultrasound at the key moments</h2><div class=\"pictures\">";
  for (const DebriefPicture& picture : data.pictures) {
    fmt::format_to(std::back_inserter(html),
                   R"(<figure data-time="{}"><img alt="Ultrasound image: {}" src="data:image/png;base64,{}">)"
                   R"(<figcaption><b>{}</b> {}<br>{}</figcaption></figure>)",
                   picture.time_s, escaped(picture.title), base64(picture.png), escaped(picture.title),
                   film_link(data, picture.time_s, fmt::format("{:.2f} s", picture.time_s)),
                   escaped(picture.caption));
  }
  html += "</div></section>\n";
}

}  // namespace

std::string debrief_page(const DebriefData& data) {
  const std::string json = embedded(page_json(data));
  // Who writes a title cannot know the hash of the whole session, so cannot bring a script of their own.
  session::StateHash hash;
  for (const char c : json) hash.add(static_cast<std::uint64_t>(static_cast<unsigned char>(c)));
  const std::string nonce = fmt::format("{:016x}", hash.value());
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta http-equiv=\"Content-Security-Policy\" "
      "content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'nonce-{}'\"><meta "
      "name=\"viewport\" content=\"width=device-width, initial-scale=1\"><meta name=\"color-scheme\" content=\"light "
      "dark\"><title>{} - Stylet debrief</title><style>\n{}</style></head><body>\n",
      nonce, escaped(data.title), kPageStyle);
  append_header(html, data);
  append_metrics(html, data, true);
  append_attempts(html, data);
  append_course(html, data);
  append_way(html, data);
  append_plots(html, data);
  append_pictures(html, data);
  append_metrics(html, data, false);
  fmt::format_to(std::back_inserter(html),
                 "<footer>Stylet {}. The same numbers are in debrief.json, debrief.csv and path.csv. Research and "
                 "training software, not a medical device.</footer>\n<script type=\"application/json\" id=\"data\" "
                 "nonce=\"{}\">{}</script>\n<script nonce=\"{}\">\n{}</script>\n</body></html>\n",
                 escaped(data.build), nonce, json, nonce, kPageScript);
  return html;
}

}  // namespace stylet::debrief
