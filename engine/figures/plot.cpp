#include "engine/figures/plot.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace stylet::figures {
namespace {

struct ThemeColours {
  Colour background, grid, axis, text, marker;
};

ThemeColours theme_colours(PlotTheme theme) {
  if (theme == PlotTheme::dark) {
    return {.background = {18, 20, 24},
            .grid = {48, 52, 60},
            .axis = {130, 136, 148},
            .text = {214, 218, 226},
            .marker = {170, 176, 190, 150}};
  }
  return {.background = {255, 255, 255},
          .grid = {229, 231, 235},
          .axis = {110, 116, 128},
          .text = {31, 36, 46},
          .marker = {110, 116, 128, 150}};
}

/// The axis' own ends, else those of the finite values.
AxisRange range_of(const PlotAxis& axis, const PlotPanel& panel, std::vector<double> PlotSeries::*values) {
  AxisRange data = kNoRange;
  for (const PlotSeries& series : panel.series) extend(data, series.*values);
  return rounded(data, axis);
}

/// One panel within its share of the figure.
class PanelDrawing {
public:
  PanelDrawing(Canvas& canvas, const PlotPanel& panel, const PlotSettings& settings, const Font& font, PixelBox outer)
      : canvas_(canvas),
        panel_(panel),
        font_(font),
        colours_(theme_colours(settings.theme)),
        text_(settings.text_height) {
    x_ = range_of(panel.x, panel, &PlotSeries::x);
    y_ = range_of(panel.y, panel, &PlotSeries::y);
    outer_ = outer;
    const bool named = std::any_of(panel.series.begin(), panel.series.end(),
                                   [](const PlotSeries& series) { return !series.label.empty(); });
    const double title = panel.title.empty() && !named ? 0 : 1.6 * text_;
    const double x_label = panel.x.label.empty() ? 0 : 1.3 * text_;
    const double y_label = panel.y.label.empty() ? 0 : 1.4 * text_;
    box_.top = std::round(outer.top + 0.8 * text_ + title);
    box_.bottom = std::round(outer.bottom - 1.9 * text_ - x_label);
    y_ticks_ = nice_ticks(y_.min, y_.max, tick_count(box_.bottom - box_.top, 2.0 * text_));
    double widest = 0;
    for (const double v : y_ticks_) widest = std::max(widest, font.width(tick_text(v, tick_step(y_ticks_)), text_));
    box_.left = std::round(outer.left + 0.8 * text_ + y_label + widest + 0.5 * text_);
    box_.right = std::round(outer.right - 1.4 * text_);
    x_ticks_ = nice_ticks(x_.min, x_.max, tick_count(box_.right - box_.left, 5.0 * text_));
  }

  void draw() {
    if (box_.right - box_.left < 8 || box_.bottom - box_.top < 8) return;  // no room for a chart
    grid_and_axes();
    canvas_.clip(box_);
    markers();
    for (const PlotSeries& series : panel_.series) curve(series);
    for (const PlotDot& dot : panel_.dots) {
      if (!std::isfinite(dot.x + dot.y)) continue;
      canvas_.disc(pixel(dot.x, dot.y), 0.42 * text_, colours_.background);
      canvas_.disc(pixel(dot.x, dot.y), 0.32 * text_, dot.colour);
    }
    canvas_.unclip();
    legend();
  }

private:
  static int tick_count(double pixels, double each) { return std::clamp(static_cast<int>(pixels / each), 2, 12); }

  PixelPoint pixel(double x, double y) const {
    // Clamped far outside, so that a huge value does not overflow and the line still leaves in its direction.
    const auto map = [](double v, const AxisRange& r, double from, double to) {
      return from + std::clamp((v - r.min) / (r.max - r.min), -50.0, 50.0) * (to - from);
    };
    return {map(x, x_, box_.left, box_.right), map(y, y_, box_.bottom, box_.top)};
  }

  void grid_and_axes() {
    for (const double v : x_ticks_) {
      const double x = std::floor(pixel(v, y_.min).x) + 0.5;
      canvas_.line({x, box_.top}, {x, box_.bottom}, 1, colours_.grid);
      canvas_.text(font_, tick_text(v, tick_step(x_ticks_)), {x, box_.bottom + 0.9 * text_}, text_, colours_.text,
                   Align::centre);
    }
    for (const double v : y_ticks_) {
      const double y = std::floor(pixel(x_.min, v).y) + 0.5;
      canvas_.line({box_.left, y}, {box_.right, y}, 1, colours_.grid);
      canvas_.text(font_, tick_text(v, tick_step(y_ticks_)), {box_.left - 0.5 * text_, y}, text_, colours_.text,
                   Align::right);
    }
    if (y_.min < 0 && y_.max > 0) {
      const double y = std::floor(pixel(x_.min, 0).y) + 0.5;
      canvas_.line({box_.left, y}, {box_.right, y}, 1, colours_.axis);
    }
    canvas_.line({box_.left + 0.5, box_.top}, {box_.left + 0.5, box_.bottom}, 1, colours_.axis);
    canvas_.line({box_.left, box_.bottom - 0.5}, {box_.right, box_.bottom - 0.5}, 1, colours_.axis);
    const double centre_x = 0.5 * (box_.left + box_.right);
    canvas_.text(font_, panel_.title, {box_.left, outer_.top + 1.2 * text_}, 1.25 * text_, colours_.text);
    canvas_.text(font_, panel_.x.label, {centre_x, box_.bottom + 2.35 * text_}, text_, colours_.text, Align::centre);
    canvas_.text(font_, panel_.y.label, {outer_.left + 1.1 * text_, 0.5 * (box_.top + box_.bottom)}, text_,
                 colours_.text, Align::centre, /*turned=*/true);
  }

  /// Vertical dashes with a turned label at the top.
  void markers() {
    for (const PlotMarker& marker : panel_.markers) {
      if (!std::isfinite(marker.x)) continue;
      const double x = std::floor(pixel(marker.x, y_.min).x) + 0.5;
      double y = box_.top;
      while (y < box_.bottom) {
        canvas_.line({x, y}, {x, std::min(y + 4, box_.bottom)}, 1, colours_.marker);
        y += 8;
      }
      const double height = kMarkerText * text_;
      canvas_.text(font_, marker.label, {x - 0.55 * height, box_.top + 0.4 * text_}, height, colours_.text,
                   Align::right,
                   /*turned=*/true);
    }
  }

  /// The points of a line; those that share a pixel column are joined to what is seen of them: first, lowest,
  /// highest, last. A curve of ten thousand points has a few hundred columns.
  void curve(const PlotSeries& series) {
    std::vector<PixelPoint> points;
    const std::size_t count = std::min(series.x.size(), series.y.size());
    PixelPoint first, last, low, high;
    double column = std::numeric_limits<double>::quiet_NaN();
    const auto flush = [&] {
      if (std::isnan(column)) return;
      points.push_back(first);
      points.push_back(low);
      points.push_back(high);
      points.push_back(last);
      column = std::numeric_limits<double>::quiet_NaN();
    };
    for (std::size_t i = 0; i < count; ++i) {
      if (!std::isfinite(series.x[i] + series.y[i])) {
        flush();
        points.push_back({std::numeric_limits<double>::quiet_NaN(), 0});
        continue;
      }
      const PixelPoint p = pixel(series.x[i], series.y[i]);
      const double here = std::floor(2 * p.x);  // half a pixel
      if (here != column) {
        flush();
        column = here;
        first = low = high = p;
      }
      if (p.y > low.y) low = p;
      if (p.y < high.y) high = p;
      last = p;
    }
    flush();
    canvas_.polyline(points, series.width, series.colour);
  }

  /// In the line of the title, from the right: above the chart it hides nothing.
  void legend() {
    if (font_.empty()) return;
    double x = box_.right;
    const double y = outer_.top + 1.2 * text_;
    for (auto series = panel_.series.rbegin(); series != panel_.series.rend(); ++series) {
      if (series->label.empty()) continue;
      x -= font_.width(series->label, text_);
      canvas_.text(font_, series->label, {x, y}, text_, colours_.text);
      canvas_.line({x - 1.8 * text_, y}, {x - 0.5 * text_, y}, std::max(series->width, 2.5), series->colour);
      x -= 3.2 * text_;
    }
  }

  Canvas& canvas_;
  const PlotPanel& panel_;
  const Font& font_;
  ThemeColours colours_;
  double text_;
  AxisRange x_, y_;
  PixelBox outer_, box_;
  std::vector<double> x_ticks_, y_ticks_;
};

}  // namespace

Colour plot_colour(int index, PlotTheme theme) {
  // Okabe & Ito, with the blue and the black of the light theme lightened for the dark one.
  static constexpr std::array<Colour, 6> light{Colour{0, 114, 178}, {213, 94, 0},    {0, 158, 115},
                                               {40, 44, 52},        {204, 121, 167}, {230, 159, 0}};
  static constexpr std::array<Colour, 6> dark{Colour{86, 180, 233}, {240, 140, 60},  {60, 200, 160},
                                              {235, 238, 245},      {224, 150, 190}, {240, 228, 66}};
  const auto i = static_cast<std::size_t>(std::max(index, 0)) % light.size();
  return theme == PlotTheme::dark ? dark[i] : light[i];
}

picture::Picture draw_plot(std::span<const PlotPanel> panels, const PlotSettings& settings, const Font& font) {
  picture::Picture image(settings.width, settings.height);
  Canvas canvas(image);
  canvas.fill({0, 0, static_cast<double>(settings.width), static_cast<double>(settings.height)},
              theme_colours(settings.theme).background);
  const double share = static_cast<double>(settings.height) / std::max(static_cast<double>(panels.size()), 1.0);
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const double top = share * static_cast<double>(i);
    PanelDrawing(canvas, panels[i], settings, font, {0, top, static_cast<double>(settings.width), top + share})
        .draw();
  }
  return image;
}

}  // namespace stylet::figures
