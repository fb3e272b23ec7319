#include "engine/figures/svg_plot.h"

#include "engine/figures/plot_axis.h"
#include "engine/files/html.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>

namespace stylet::figures {

using files::html::escaped;

namespace {

// In units of the view box, which are about pixels: two plots stand beside each other, or one is as wide as both.
constexpr int kHeight = 250;
int width_of(const SvgPlot& plot) {
  return plot.wide ? 1098 : 540;
}
struct Box {
  double left = 46, top = 22, right = 0, bottom = 206;
};

struct Axis {
  AxisRange range;
  std::vector<double> ticks;
  double min() const { return range.min; }
  double max() const { return range.max; }
  std::string text(double tick) const { return tick_text(tick, tick_step(ticks)); }
};

/// Around all finite values and zero.
Axis axis_of(std::span<const SvgLine> lines, std::vector<double> SvgLine::*values, int ticks) {
  AxisRange data{.min = 0, .max = 0};
  for (const SvgLine& line : lines) extend(data, line.*values);
  const AxisRange range = rounded(data, data.min < 0 ? PlotAxis{} : PlotAxis{.label = {}, .min = 0});
  return {.range = range, .ticks = nice_ticks(range.min, range.max, ticks)};
}

void append_line(std::string& svg, const SvgLine& line, const Axis& x, const Axis& y, const Box& box) {
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
    fmt::format_to(out, "{:.1f},{:.1f} ",
                   box.left + (line.x[i] - x.min()) / (x.max() - x.min()) * (box.right - box.left),
                   box.bottom - (line.y[i] - y.min()) / (y.max() - y.min()) * (box.bottom - box.top));
  }
  if (open) svg += "\"/>";
}

/// Marks are numbered in order: "3", "3, 4", "3-5".
std::string mark_label(std::span<const SvgMark> marks) {
  if (marks.size() == 1) return marks.front().number;
  return marks.front().number + (marks.size() == 2 ? ", " : "\u2013") + marks.back().number;
}

/// Numbers that would lie on each other share a label.
void append_marks(std::string& svg, std::span<const SvgMark> marks, const std::function<double(double)>& to_x,
                  double top, double bottom) {
  constexpr double kDigit = 8;  // width
  auto out = std::back_inserter(svg);
  const auto half_width = [&](std::span<const SvgMark> group) {
    const std::size_t digits = group.front().number.size() + (group.size() > 1 ? group.back().number.size() + 1 : 0);
    return kDigit / 2 * static_cast<double>(digits);
  };
  const auto middle = [&](std::span<const SvgMark> group) {
    return (to_x(group.front().x) + to_x(group.back().x)) / 2;
  };
  for (std::size_t first = 0; first < marks.size();) {
    std::size_t count = 1;
    for (; first + count < marks.size(); ++count) {
      const auto group = marks.subspan(first, count);
      const auto next = marks.subspan(first + count, 1);
      if (middle(next) - half_width(next) > middle(group) + half_width(group) + kDigit / 2) break;
    }
    const auto group = marks.subspan(first, count);
    for (const SvgMark& mark : group) {
      fmt::format_to(out,
                     R"(<g class="mark {0}"><title>{1}</title><line x1="{2:.1f}" x2="{2:.1f}" y1="{3:.1f}" )"
                     R"(y2="{4:.1f}"/></g>)",
                     mark.name, escaped(mark.title), to_x(mark.x), top, bottom);
    }
    fmt::format_to(out, R"(<g class="mark {}"><text x="{:.1f}" y="{:.1f}" text-anchor="middle">{}</text></g>)",
                   group.front().name, middle(group), top - 4, escaped(mark_label(group)));
    first += count;
  }
}

}  // namespace

std::string svg_plot(const SvgPlot& plot) {
  const Box box{.right = width_of(plot) - 10.0};
  const Axis x = axis_of(plot.lines, &SvgLine::x, plot.wide ? 14 : 8);
  const Axis y = axis_of(plot.lines, &SvgLine::y, 6);
  const auto to_x = [&](double v) { return box.left + (v - x.min()) / (x.max() - x.min()) * (box.right - box.left); };
  const auto to_y = [&](double v) {
    return box.bottom - (v - y.min()) / (y.max() - y.min()) * (box.bottom - box.top);
  };
  std::string svg = fmt::format(R"(<figure class="plot{}"><figcaption>{}<span class="keys">)",
                                plot.wide ? " broad" : "", escaped(plot.title));
  auto out = std::back_inserter(svg);
  for (const SvgLine& line : plot.lines) {
    fmt::format_to(out, R"(<span class="key"><i class="{}{}"></i>{}</span>)", line.name, line.dashed ? " dashed" : "",
                   escaped(line.label));
  }
  fmt::format_to(out,
                 R"(</span></figcaption><svg id="{}" viewBox="0 0 {} {}" role="img" aria-label="{}" data-x0="{}" )"
                 R"(data-x1="{}" data-y0="{}" data-y1="{}" data-box="{} {} {} {}"><g class="grid">)",
                 plot.id, width_of(plot), kHeight, escaped(plot.title), x.min(), x.max(), y.min(), y.max(), box.left,
                 box.top, box.right, box.bottom);
  for (const double tick : x.ticks) {
    fmt::format_to(out,
                   R"(<line x1="{0:.1f}" x2="{0:.1f}" y1="{1}" y2="{2}"/><text x="{0:.1f}" y="{3}" )"
                   R"(text-anchor="middle">{4}</text>)",
                   to_x(tick), box.top, box.bottom, box.bottom + 16, x.text(tick));
  }
  for (const double tick : y.ticks) {
    fmt::format_to(out,
                   R"(<line x1="{1}" x2="{2}" y1="{0:.1f}" y2="{0:.1f}"/><text x="{3}" y="{4:.1f}" )"
                   R"(text-anchor="end">{5}</text>)",
                   to_y(tick), box.left, box.right, box.left - 7, to_y(tick) + 4, y.text(tick));
  }
  fmt::format_to(
      out,
      R"(</g><text class="axis" x="{}" y="{}" text-anchor="end">{}</text>)"
      R"svg(<text class="axis" x="14" y="{}" text-anchor="middle" transform="rotate(-90 14 {})">{}</text>)svg",
      box.right, kHeight - 8, escaped(plot.x_label), (box.top + box.bottom) / 2, (box.top + box.bottom) / 2,
      escaped(plot.y_label));
  std::vector<SvgMark> inside = plot.marks;
  std::erase_if(inside, [&](const SvgMark& mark) { return mark.x < x.min() || mark.x > x.max(); });
  append_marks(svg, inside, to_x, box.top, box.bottom);
  for (const SvgLine& line : plot.lines) append_line(svg, line, x, y, box);
  svg += "</svg></figure>\n";
  return svg;
}

std::string svg_timeline(double duration_s, std::span<const TimelineBand> bands, std::span<const SvgMark> marks) {
  constexpr double kLeft = 12, kRight = 1088, kTop = 28, kBottom = 58;
  const double end_s = std::max(duration_s, 1e-3);
  const auto to_x = [&](double s) { return kLeft + std::clamp(s / end_s, 0.0, 1.0) * (kRight - kLeft); };
  std::string svg =
      R"(<svg class="timeline" id="timeline" viewBox="0 0 1100 86" role="img" aria-label="Timeline of events">)";
  auto out = std::back_inserter(svg);
  fmt::format_to(out, R"(<rect class="track" x="{}" y="{}" width="{}" height="{}" rx="4"/>)", kLeft, kTop,
                 kRight - kLeft, kBottom - kTop);
  int index = 0;
  for (const TimelineBand& band : bands) {
    const double from = to_x(band.from_s);
    const double to = to_x(band.to_s);
    fmt::format_to(out,
                   R"(<g class="band"><title>{}</title><rect class="b{}" x="{:.1f}" y="{}" width="{:.1f}" )"
                   R"(height="{}"/>)",
                   escaped(band.label), index++ % 4, from, kTop, std::max(to - from, 0.5), kBottom - kTop);
    if (to - from > 7.5 * static_cast<double>(band.label.size())) {
      fmt::format_to(out, R"(<text x="{:.1f}" y="{}">{}</text>)", from + 8, (kTop + kBottom) / 2 + 4,
                     escaped(band.label));
    }
    svg += "</g>";
  }
  const std::vector<double> ticks = nice_ticks(0, end_s, 12);
  for (const double tick : ticks) {
    fmt::format_to(out,
                   R"(<g class="grid"><line x1="{0:.1f}" x2="{0:.1f}" y1="{1}" y2="{2}"/><text x="{0:.1f}" )"
                   R"(y="{3}" text-anchor="middle">{4} s</text></g>)",
                   to_x(tick), kBottom, kBottom + 5, kBottom + 20, tick_text(tick, tick_step(ticks)));
  }
  append_marks(svg, marks, to_x, kTop - 6, kBottom);
  svg += "</svg>\n";
  return svg;
}

}  // namespace stylet::figures
