#include "tools/bench/figure_files.h"

#include "engine/figures/canvas.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>

namespace stylet::bench {
namespace {

constexpr int kWidth = 1400;
constexpr int kPanelHeight = 380;
constexpr double kTextHeight = 18;

picture::Picture with_caption(const picture::Picture& plot, std::span<const std::string> caption,
                              const figures::Font& font) {
  const double line = 1.5 * kTextHeight;
  picture::Picture figure(plot.width,
                          plot.height + static_cast<int>(line * (static_cast<double>(caption.size()) + 0.8)),
                          {255, 255, 255, 255});
  std::copy(plot.rgba.begin(), plot.rgba.end(), figure.rgba.begin());
  figures::Canvas canvas(figure);
  double y = plot.height + 0.6 * line;
  for (const std::string& text : caption) {
    canvas.text(font, text, {1.5 * kTextHeight, y}, kTextHeight, {31, 36, 46});
    y += line;
  }
  return figure;
}

void write_csv(const std::filesystem::path& file, std::span<const FigureColumn> columns) {
  std::ofstream out(file);
  std::size_t rows = 0;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    out << (c == 0 ? "" : ",") << columns[c].name;
    rows = std::max(rows, columns[c].values.size());
  }
  out << '\n';
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (c > 0) out << ',';
      if (r < columns[c].values.size()) out << fmt::format("{:.9g}", columns[c].values[r]);
    }
    out << '\n';
  }
  out.close();
  if (!out)
    throw std::runtime_error(file.string() + ": cannot be written; is the folder writable and the disk not full?");
}

}  // namespace

std::vector<double> component(const std::vector<Eigen::Vector3d>& vectors, int axis, double scale) {
  std::vector<double> values;
  values.reserve(vectors.size());
  for (const Eigen::Vector3d& v : vectors) values.push_back(scale * v[axis]);
  return values;
}

void write_figure(const std::filesystem::path& folder, const std::string& name,
                  std::span<const figures::PlotPanel> panels, std::span<const std::string> caption,
                  std::span<const FigureColumn> columns) {
  std::filesystem::create_directories(folder);
  static const figures::Font font = figures::Font::load();
  const figures::PlotSettings settings{
      .width = kWidth, .height = kPanelHeight * static_cast<int>(panels.size()), .text_height = kTextHeight};
  picture::write_png(folder / (name + ".png"), with_caption(draw_plot(panels, settings, font), caption, font));
  write_csv(folder / (name + ".csv"), columns);
}

}  // namespace stylet::bench
