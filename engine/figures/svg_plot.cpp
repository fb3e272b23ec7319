#include "engine/figures/svg_plot.h"

#include "engine/figures/plot_axis.h"
#include "engine/files/html.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>

namespace stylet::figures {

using files::html::escaped;

namespace {

// Across in shares of the width that the page gives, down in pixels: lines stretch, text stays as large as it is.
constexpr double kTop = 22, kBottom = 206;
constexpr int kHeight = 250;
constexpr double kAcross = 1000;  // of the lines' view box

/// What is written beside each other depends on the width: once for each of these, of which the style sheet shows
/// one.
struct Room {
  const char* name;  ///< class
  double width;      ///< least, pixels
};
constexpr std::array kRooms{Room{"narrow", 260}, Room{"medium", 450}, Room{"broad", 940}};

struct Axis {
  AxisRange range;
  std::vector<double> ticks;
  double min() const { return range.min; }
  double max() const { return range.max; }
  /// 0 at the beginning of the axis, 1 at its end.
  double share(double v) const { return (v - min()) / (max() - min()); }
  std::string text(double tick) const { return tick_text(tick, tick_step(ticks)); }
};

/// Around all finite values and zero.
Axis axis_of(const SvgPlot& plot, std::vector<double> SvgLine::*values, double SvgPoint::*value, int ticks) {
  AxisRange data{.min = 0, .max = 0};
  for (const SvgLine& line : plot.lines) extend(data, line.*values);
  for (const SvgPoint& point : plot.points) extend(data, std::array{point.*value});
  const AxisRange range = rounded(data, data.min < 0 ? PlotAxis{} : PlotAxis{.label = {}, .min = 0});
  return {.range = range, .ticks = nice_ticks(range.min, range.max, ticks)};
}

void append_line(std::string& svg, const SvgLine& line, const Axis& x, const Axis& y) {
  auto out = std::back_inserter(svg);
  bool open = false;
  for (std::size_t i = 0; i < line.x.size(); ++i) {
    const bool finite = std::isfinite(line.x[i]) && std::isfinite(line.y[i]);
    if (!finite) {
      if (open) svg += "\"/>";
      open = false;
      continue;
    }
    if (!open)
      fmt::format_to(out, R"(<polyline class="line {}{}" points=")", line.name, line.dashed ? " dashed" : "");
    open = true;
    fmt::format_to(out, "{:.1f},{:.1f} ", kAcross * x.share(line.x[i]), (kBottom - kTop) * (1 - y.share(line.y[i])));
  }
  if (open) svg += "\"/>";
}

/// Marks are numbered in order: "3", "3, 4", "3-5".
std::string mark_label(std::span<const SvgMark> marks) {
  if (marks.size() == 1) return marks.front().number;
  return marks.front().number + (marks.size() == 2 ? ", " : "\u2013") + marks.back().number;
}

/// Numbers that would lie on each other share a label.
/// @param to_share  of the width
void append_mark_labels(std::string& svg, std::span<const SvgMark> marks,
                        const std::function<double(double)>& to_share, double y, const Room& room) {
  constexpr double kDigit = 9;  // width, bold
  const auto half_width = [&](std::span<const SvgMark> group) {
    const std::size_t digits = group.front().number.size() + (group.size() > 1 ? group.back().number.size() + 1 : 0);
    return kDigit / 2 * static_cast<double>(digits);
  };
  const auto middle = [&](std::span<const SvgMark> group) {
    return room.width * (to_share(group.front().x) + to_share(group.back().x)) / 2;
  };
  fmt::format_to(std::back_inserter(svg), R"(<g class="{}">)", room.name);
  for (std::size_t first = 0; first < marks.size();) {
    std::size_t count = 1;
    for (; first + count < marks.size(); ++count) {
      const auto group = marks.subspan(first, count);
      const auto next = marks.subspan(first + count, 1);
      if (middle(next) - half_width(next) > middle(group) + half_width(group) + kDigit / 2) break;
    }
    const auto group = marks.subspan(first, count);
    fmt::format_to(std::back_inserter(svg),
                   R"(<g class="mark {}"><text x="{:.2f}%" y="{:.1f}" text-anchor="middle">{}</text></g>)",
                   group.front().name, 100 * middle(group) / room.width, y, escaped(mark_label(group)));
    first += count;
  }
  svg += "</g>";
}

void append_marks(std::string& svg, std::span<const SvgMark> marks, const std::function<double(double)>& to_share,
                  double top, double bottom) {
  for (const SvgMark& mark : marks) {
    fmt::format_to(std::back_inserter(svg),
                   R"(<g class="mark {0}"><title>{1}</title><line x1="{2:.2f}%" x2="{2:.2f}%" y1="{3:.1f}" )"
                   R"(y2="{4:.1f}"/></g>)",
                   mark.name, escaped(mark.title), 100 * to_share(mark.x), top, bottom);
  }
  if (marks.empty()) return;
  for (const Room& room : kRooms) append_mark_labels(svg, marks, to_share, top - 4, room);
}

/// Of many numbers below an axis every second one goes where there is little room.
const char* tick_class(std::size_t index, std::size_t count) {
  return count > 9 && index % 2 == 1 ? " class=\"fine\"" : "";
}

}  // namespace

std::string svg_plot(const SvgPlot& plot) {
  const Axis x = axis_of(plot, &SvgLine::x, &SvgPoint::x, plot.wide ? 14 : 8);
  const Axis y = axis_of(plot, &SvgLine::y, &SvgPoint::y, 6);
  const auto to_y = [&](double v) { return kBottom - y.share(v) * (kBottom - kTop); };
  std::string svg = fmt::format(R"(<figure class="plot{}"><figcaption>{}<span class="keys">)",
                                plot.wide ? " broad" : "", escaped(plot.title));
  auto out = std::back_inserter(svg);
  for (const SvgLine& line : plot.lines) {
    if (line.label.empty()) continue;
    fmt::format_to(out, R"(<span class="key"><i class="{}{}"></i>{}</span>)", line.name, line.dashed ? " dashed" : "",
                   escaped(line.label));
  }
  fmt::format_to(out,
                 R"(</span></figcaption><svg class="chart" id="{}" width="100%" height="{}" role="img" )"
                 R"(aria-label="{}" data-x0="{}" data-x1="{}" data-y0="{}" data-y1="{}" data-top="{}" )"
                 R"(data-bottom="{}"><g class="grid">)",
                 plot.id, kHeight, escaped(plot.title), x.min(), x.max(), y.min(), y.max(), kTop, kBottom);
  for (std::size_t i = 0; i < x.ticks.size(); ++i) {
    fmt::format_to(out,
                   R"(<line x1="{0:.2f}%" x2="{0:.2f}%" y1="{1}" y2="{2}"/><text{3} x="{0:.2f}%" y="{4}" )"
                   R"(text-anchor="middle">{5}</text>)",
                   100 * x.share(x.ticks[i]), kTop, kBottom, tick_class(i, x.ticks.size()), kBottom + 16,
                   x.text(x.ticks[i]));
  }
  for (const double tick : y.ticks) {
    fmt::format_to(
        out,
        R"(<line x1="0" x2="100%" y1="{0:.1f}" y2="{0:.1f}"/><text x="-7" y="{1:.1f}" text-anchor="end">{2}</text>)",
        to_y(tick), to_y(tick) + 4, y.text(tick));
  }
  const double middle = (kTop + kBottom) / 2;
  fmt::format_to(
      out,
      R"(</g><text class="axis" x="100%" y="{}" text-anchor="end">{}</text>)"
      R"svg(<text class="axis" x="-34" y="{}" text-anchor="middle" transform="rotate(-90 -34 {})">{}</text>)svg",
      kHeight - 8, escaped(plot.x_label), middle, middle, escaped(plot.y_label));
  std::vector<SvgMark> inside = plot.marks;
  std::erase_if(inside, [&](const SvgMark& mark) { return mark.x < x.min() || mark.x > x.max(); });
  append_marks(
      svg, inside, [&](double v) { return x.share(v); }, kTop, kBottom);
  fmt::format_to(out, R"(<svg class="lines" y="{}" width="100%" height="{}" viewBox="0 0 {} {}" )", kTop,
                 kBottom - kTop, kAcross, kBottom - kTop);
  svg += "preserveAspectRatio=\"none\">";
  for (const SvgLine& line : plot.lines) append_line(svg, line, x, y);
  svg += "</svg>";
  for (const SvgPoint& point : plot.points) {
    fmt::format_to(out, R"(<circle class="point {}" cx="{:.2f}%" cy="{:.1f}" r="4"><title>{}</title></circle>)",
                   point.name, 100 * x.share(point.x), to_y(point.y), escaped(point.title));
  }
  svg += "</svg></figure>\n";
  return svg;
}

std::string svg_timeline(double duration_s, std::span<const TimelineBand> bands, std::span<const SvgMark> marks) {
  constexpr double kBandTop = 28, kBandBottom = 58;
  const double end_s = std::max(duration_s, 1e-3);
  const auto to_share = [&](double s) { return std::clamp(s / end_s, 0.0, 1.0); };
  std::string svg = R"(<svg class="timeline" id="timeline" width="100%" height="86" role="img" )"
                    R"(aria-label="Timeline of events">)";
  auto out = std::back_inserter(svg);
  fmt::format_to(out, R"(<rect class="track" x="0" y="{}" width="100%" height="{}" rx="4"/>)", kBandTop,
                 kBandBottom - kBandTop);
  int index = 0;
  for (const TimelineBand& band : bands) {
    const double from = to_share(band.from_s);
    const double width = to_share(band.to_s) - from;
    fmt::format_to(out,
                   R"(<g class="band"><title>{}</title><rect class="b{}" x="{:.2f}%" y="{}" width="{:.2f}%" )"
                   R"(height="{}"/>)",
                   escaped(band.label), index++ % 4, 100 * from, kBandTop, std::max(100 * width, 0.05),
                   kBandBottom - kBandTop);
    for (const Room& room : kRooms) {
      if (width * room.width < 8.5 * static_cast<double>(band.label.size()) + 8) continue;
      fmt::format_to(out, R"(<text class="{}" x="{:.2f}%" dx="6" y="{}">{}</text>)", room.name, 100 * from,
                     (kBandTop + kBandBottom) / 2 + 4, escaped(band.label));
    }
    svg += "</g>";
  }
  const std::vector<double> ticks = nice_ticks(0, end_s, 12);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    fmt::format_to(out,
                   R"(<g class="grid"><line x1="{0:.2f}%" x2="{0:.2f}%" y1="{1}" y2="{2}"/><text{3} x="{0:.2f}%" )"
                   R"(y="{4}" text-anchor="middle">{5} s</text></g>)",
                   100 * to_share(ticks[i]), kBandBottom, kBandBottom + 5,
                   ticks.size() > 5 && i % 2 == 1 ? " class=\"fine\"" : "", kBandBottom + 20,
                   tick_text(ticks[i], tick_step(ticks)));
  }
  append_marks(svg, marks, to_share, kBandTop - 6, kBandBottom);
  svg += "</svg>\n";
  return svg;
}

}  // namespace stylet::figures
