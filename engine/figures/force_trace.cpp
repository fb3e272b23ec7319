#include "engine/figures/force_trace.h"

#include "engine/files/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <system_error>

namespace stylet::figures {
namespace {

constexpr double kMillimetres = 1e3;

PlotSeries series_of(std::string label, Colour colour, std::size_t size) {
  PlotSeries series{.label = std::move(label), .x = {}, .y = {}, .colour = colour, .width = 1.8};
  series.x.reserve(size);
  series.y.reserve(size);
  return series;
}

void append(PlotSeries& series, double x, double y) {
  series.x.push_back(x);
  series.y.push_back(y);
}

/// A field of RFC 4180, quoted because an event may hold any text.
std::string csv_field(const std::string& text) {
  std::string field = "\"";
  for (const char c : text) field.append(c == '"' ? 2 : 1, c);
  return field + '"';
}

/// The marks' names hang from the top: the curves stay below them.
void make_room_for_marks(PlotPanel& panel, const Font& font, int height) {
  const PlotSettings settings;
  double longest = 0;
  for (const PlotMarker& mark : panel.markers) {
    longest = std::max(longest, font.width(mark.label, kMarkerText * settings.text_height));
  }
  double low = 0, high = 0;
  for (const PlotSeries& series : panel.series) {
    for (const double v : series.y) {
      if (!std::isfinite(v)) continue;
      low = std::min(low, v);
      high = std::max(high, v);
    }
  }
  if (!(longest > 0) || !(high > low)) return;
  const double box = std::max(height - 6 * settings.text_height, 1.0);
  const double share = std::min((longest + settings.text_height) / box, 0.5);
  panel.y.max = high + share / (1 - share) * (high - low);
}

/// Axial and lateral force against depth.
std::array<PlotSeries, 2> depth_curves(std::span<const ForceSample> samples, PlotTheme theme) {
  std::array curves{series_of("axial (against insertion)", plot_colour(0, theme), samples.size()),
                    series_of("lateral", plot_colour(1, theme), samples.size())};
  for (const ForceSample& s : samples) {
    append(curves[0], kMillimetres * s.depth, s.axial);
    append(curves[1], kMillimetres * s.depth, s.lateral);
  }
  return curves;
}

}  // namespace

ForceTrace::ForceTrace(std::size_t capacity, int every) : capacity_(capacity), every_(std::max(every, 1)) {
  samples_.reserve(capacity);
}

bool ForceTrace::add(double time_s, const Eigen::Vector3d& hub, const Eigen::Vector3d& needle_axis, double depth,
                     const Eigen::Vector3d& force, double work) {
  least_work_ = std::min(least_work_, work);
  if (seen_++ % static_cast<std::size_t>(every_) != 0) return true;
  if (samples_.size() >= capacity_) {
    ++dropped_;
    return false;
  }
  const double along = force.dot(needle_axis);
  samples_.push_back({.time_s = time_s,
                      .hub = hub,
                      .depth = depth,
                      .force = force,
                      .axial = -along,
                      .lateral = (force - along * needle_axis).norm(),
                      .work = work});
  return true;
}

ForceSummary ForceTrace::summary() const {
  ForceSummary out;
  out.samples = samples_.size();
  out.least_work = least_work_;
  if (samples_.empty()) return out;
  out.duration_s = samples_.back().time_s - samples_.front().time_s;
  out.peak_force_time_s = samples_.front().time_s;
  const ForceSample* before = nullptr;
  for (const ForceSample& s : samples_) {
    if (const double norm = s.force.norm(); norm > out.peak_force) {
      out.peak_force = norm;
      out.peak_force_time_s = s.time_s;
    }
    out.peak_axial = std::max(out.peak_axial, s.axial);
    out.peak_lateral = std::max(out.peak_lateral, s.lateral);
    out.max_depth = std::max(out.max_depth, s.depth);
    if (before != nullptr) out.max_jump = std::max(out.max_jump, (s.force - before->force).norm());
    before = &s;
  }
  return out;
}

void write_force_csv(const std::filesystem::path& path, const ForceTrace& trace, std::span<const TraceEvent> events) {
  std::vector<TraceEvent> coming(events.begin(), events.end());
  std::stable_sort(coming.begin(), coming.end(),
                   [](const TraceEvent& a, const TraceEvent& b) { return a.time_s < b.time_s; });
  auto next = coming.begin();
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out,
                 "time_s,hub_x_m,hub_y_m,hub_z_m,depth_m,force_x_n,force_y_n,force_z_n,force_axial_n,"
                 "force_lateral_n,work_j,event\r\n");
  for (const ForceSample& s : trace.samples()) {
    std::string names;
    for (; next != coming.end() && next->time_s <= s.time_s; ++next) {
      names += (names.empty() ? "" : "; ") + next->name;
    }
    fmt::format_to(out, "{},{},{},{},{},{},{},{},{},{},{},{}\r\n", s.time_s, s.hub.x(), s.hub.y(), s.hub.z(), s.depth,
                   s.force.x(), s.force.y(), s.force.z(), s.axial, s.lateral, s.work,
                   names.empty() ? names : csv_field(names));
  }
  std::FILE* file = std::fopen(path.c_str(), "wb");
  const bool written = file != nullptr && std::fwrite(text.data(), 1, text.size(), file) == text.size();
  if (file == nullptr || std::fclose(file) != 0 || !written) {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
    throw files::ContentError(path.string() + ": cannot be written; check folder, permissions and space");
  }
}

picture::Picture draw_force_figure(const ForceTrace& trace, std::span<const TraceEvent> events, const Font& font,
                                   int width, int height) {
  const std::span<const ForceSample> samples = trace.samples();
  PlotPanel time{.title = "Force on the hand",
                 .x = {.label = "time (s)"},
                 .y = {.label = "force (N)"},
                 .series = {},
                 .markers = {},
                 .dots = {}};
  const char* names[4] = {"x", "y", "z", "magnitude"};
  for (int i = 0; i < 4; ++i) {
    time.series.push_back(series_of(names[i], plot_colour(i == 3 ? 3 : i, PlotTheme::light), samples.size()));
    for (const ForceSample& s : samples) {
      append(time.series.back(), s.time_s, i == 3 ? s.force.norm() : s.force[i]);
    }
  }
  if (!samples.empty()) {
    time.x.min = samples.front().time_s;
    time.x.max = std::max(samples.back().time_s, samples.front().time_s + 1e-3);
  }
  for (const TraceEvent& event : events) time.markers.push_back({event.time_s, event.name});
  make_room_for_marks(time, font, height / 2);

  PlotPanel depth{.title = "Force against insertion depth",
                  .x = {.label = "insertion depth (mm)", .min = 0},
                  .y = {.label = "force (N)"},
                  .series = {},
                  .markers = {},
                  .dots = {}};
  for (PlotSeries& curve : depth_curves(samples, PlotTheme::light)) depth.series.push_back(std::move(curve));
  // Rounding errors make no figure.
  if (const ForceSummary summary = trace.summary(); summary.peak_force < 1e-6) time.y.max = depth.y.max = 1;
  const PlotPanel panels[2] = {std::move(time), std::move(depth)};
  return draw_plot(panels, {.width = width, .height = height}, font);
}

picture::Picture draw_force_depth_strip(const ForceTrace& trace, double time_s, const Font& font, int width,
                                        int height) {
  const std::span<const ForceSample> all = trace.samples();
  const auto after =
      std::upper_bound(all.begin(), all.end(), time_s, [](double t, const ForceSample& s) { return t < s.time_s; });
  const std::span<const ForceSample> past = all.first(after - all.begin());
  PlotPanel panel{.title = {},
                  .x = {.label = "insertion depth (mm)", .min = 0},
                  .y = {.label = "force (N)"},
                  .series = {},
                  .markers = {},
                  .dots = {}};
  // Ends from the whole trace, rounded outwards as the axes of a full figure would be.
  double low = 0, high = 1e-3, deepest = 1e-3;
  for (const ForceSample& s : all) {
    low = std::min({low, s.axial, s.lateral});
    high = std::max({high, s.axial, s.lateral});
    deepest = std::max(deepest, s.depth);
  }
  const double room = 0.06 * (high - low);
  panel.x.max = 1.02 * kMillimetres * deepest;
  panel.y.min = low < 0 ? low - room : 0;
  panel.y.max = high + room;
  for (PlotSeries& curve : depth_curves(past, PlotTheme::dark)) panel.series.push_back(std::move(curve));
  if (!past.empty()) {
    const ForceSample& now = past.back();
    panel.dots = {{kMillimetres * now.depth, now.lateral, plot_colour(1, PlotTheme::dark)},
                  {kMillimetres * now.depth, now.axial, plot_colour(0, PlotTheme::dark)}};
  }
  const double text = std::clamp(0.075 * height, 10.0, 18.0);
  return draw_plot({&panel, 1}, {.width = width, .height = height, .theme = PlotTheme::dark, .text_height = text},
                   font);
}

}  // namespace stylet::figures
