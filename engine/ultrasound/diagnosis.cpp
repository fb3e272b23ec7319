#include "engine/ultrasound/diagnosis.h"

#include "engine/content/probe_placement.h"
#include "engine/ultrasound/voxel_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

namespace stylet::ultrasound {
namespace {

constexpr int kLines = 33;             ///< of the image that are followed
constexpr double kStep = 0.5e-3;       ///< m along them
constexpr double kSeenLength = 0.010;  ///< m of grey that make a line worth looking at
constexpr double kSeenShare = 0.10;    ///< of the dynamic range above black
constexpr double kHiddenDb = 30;      ///< lost beyond what the depth gain makes up for: nothing comes back from there
constexpr double kThinCover = 0.020;  ///< m of tissue over bone or gas at most, for them to be the cause
constexpr double kAll = 0.9;          ///< of the lines
constexpr double kDb = 8.685889638;   ///< of a neper

/// The tissue under a point of the image plane, as the first passes of the image find it.
class TissueLookup {
public:
  explicit TissueLookup(const ScanModel& model) : model_(model), c_(model.constants()) {}

  /// Row of ScanModel::tissues(). @param p  (x, z) of the probe frame @param range  m below the face
  int at(const Eigen::Vector2f& p, double range) const {
    Eigen::Vector3f rest = xyz(c_.origin) + p.x() * xyz(c_.lateral) + p.y() * xyz(c_.axial);
    int body = -1;
    const Eigen::Vector2i cell = model_.scan().line_and_sample(p.cast<double>()).array().round().cast<int>();
    const Eigen::Vector2i last(c_.lines - 1, c_.samples - 1);
    if (const auto place =
            model_.slice().find(p, std::clamp(cell.x(), 0, last.x()), std::clamp(cell.y(), 0, last.y()))) {
      rest = place->position;
      body = place->body;
    }
    std::uint32_t both = voxel(rest);
    if (const auto breathing = static_cast<int>(c_.breath.w); body < 0 && breathing >= 0) {
      const std::uint32_t before = voxel(rest - xyz(c_.breath));
      if (owner_of(before) == breathing) {
        both = before;
        body = breathing;
      }
    }
    const int owner = owner_of(both);
    if (owner >= 0 && owner != body) return c_.filler_tissue;
    const int label = label_of(both);
    return label == 0 && range < double(c_.coupling) ? c_.gel_tissue : label;
  }

private:
  static Eigen::Vector3f xyz(const vec4& v) { return {v.x, v.y, v.z}; }

  std::uint32_t voxel(const Eigen::Vector3f& rest) const {
    const Eigen::Vector3f grid = (rest - Eigen::Vector3f(c_.label_x, c_.label_y, c_.label_z)) / c_.label_spacing;
    const Eigen::Array3i size(c_.label_nx, c_.label_ny, c_.label_nz);
    if (!(grid.array() >= -0.5F).all() || !(grid.array() < size.cast<float>() - 0.5F).all()) return 0;
    const Eigen::Array3i v = (grid.array() + 0.5F).floor().cast<int>();
    return model_.voxels()[(static_cast<std::size_t>(v.z()) * size.y() + v.y()) * size.x() + v.x()];
  }

  const ScanModel& model_;
  const FrameConstants& c_;
};

/// What one scan line meets.
struct Line {
  double air = 0;                                                ///< m before it meets tissue; infinite: none there
  double seen = 0;                                               ///< m that show grey
  double loudest_db = -std::numeric_limits<double>::infinity();  ///< of what stands out of the noise, above black
  int hidden_by = -1;                                            ///< tissue behind which nothing shows
  double hidden_from = std::numeric_limits<double>::infinity();  ///< m
};

Line follow(const ScanModel& model, const TissueLookup& lookup, double number) {
  const FrameConstants& c = model.constants();
  const ScannerControls& controls = model.controls();
  const double black_db = double(c.white_db) - double(c.dynamic_range);
  Line line{.air = std::numeric_limits<double>::infinity()};
  double lost = 0;  // nepers, there and back
  int before = c.gel_tissue;
  for (double range = 0.5 * kStep; range < controls.depth; range += kStep) {
    const double sample = range / model.scan().sample_pitch - 0.5;
    const int here = lookup.at(model.scan().position(number, sample).cast<float>(), range);
    const TissueRow& row = model.tissues()[here];
    if (here != before) {
      const float step = row.log_impedance - model.tissues()[before].log_impedance;
      const double reflected = std::tanh(0.5 * std::abs(double(step)));
      lost -= std::log(std::max(1 - reflected * reflected, 1e-4));
    }
    lost += double(row.loss) * kStep;
    before = here;
    if (!std::isfinite(line.air) && here != 0 && here != c.gel_tissue) line.air = range - 0.5 * kStep;
    const double depth_gain_db = double(c.tgc) * range;
    if (kDb * lost - depth_gain_db > kHiddenDb) {
      line.hidden_by = here;
      line.hidden_from = range;
      break;
    }
    const double echo = std::log(double(row.backscatter)) - lost;
    if (echo < std::log(double(c.noise))) continue;
    const double level_db = kDb * echo + depth_gain_db + slider_gain_db(controls, range / controls.depth) - black_db;
    line.loudest_db = std::max(line.loudest_db, level_db);
    if (level_db > kSeenShare * double(c.dynamic_range)) line.seen += kStep;
  }
  // What is behind the reflector is not looked at, but where the skin is.
  for (double range = line.hidden_from; !std::isfinite(line.air) && range < controls.depth; range += kStep) {
    const double sample = range / model.scan().sample_pitch - 0.5;
    const int here = lookup.at(model.scan().position(number, sample).cast<float>(), range);
    if (here != 0 && here != c.gel_tissue) line.air = range;
  }
  return line;
}

std::string placement(const ScanModel& model) {
  const FrameConstants& c = model.constants();
  content::Probe probe = model.scene().probe;
  Eigen::Matrix3d axes;
  axes << c.lateral.x, c.elevation.x, c.axial.x, c.lateral.y, c.elevation.y, c.axial.y, c.lateral.z, c.elevation.z,
      c.axial.z;
  probe.pose = {{c.origin.x, c.origin.y, c.origin.z}, Eigen::Quaterniond(axes)};
  probe.depth = model.controls().depth;
  return content::odd_probe_placement(probe, model.scene().labels);
}

/// The commonest of `values` (small, not negative).
int commonest(const std::vector<int>& values) {
  return *std::ranges::max_element(values, {}, [&](int v) { return std::ranges::count(values, v); });
}

}  // namespace

std::string diagnose(const ScanModel& model) {
  const TissueLookup lookup(model);
  std::vector<Line> lines;
  lines.reserve(kLines);
  for (int i = 0; i < kLines; ++i) {
    lines.push_back(follow(model, lookup, (model.scan().lines - 1.0) * i / (kLines - 1)));
  }
  const auto share = [&lines](auto&& of) { return double(std::ranges::count_if(lines, of)) / kLines; };
  if (share([](const Line& line) { return line.seen >= kSeenLength; }) > 1 - kAll) return {};

  const double coupling = double(model.constants().coupling);
  if (share([&](const Line& line) { return line.air > coupling; }) >= kAll) {
    if (std::string odd = placement(model); !odd.empty()) return odd;
    const double gap = std::ranges::min(lines, {}, &Line::air).air;
    if (!std::isfinite(gap)) return "the image plane does not meet the patient; turn the probe towards the skin";
    return fmt::format("the probe does not touch the skin: {:.0f} mm of air{}; bring it down", std::ceil(gap * 1e3),
                       model.scene().probe.gel ? "" : " and no gel");
  }
  std::vector<int> hiding;
  double from = std::numeric_limits<double>::infinity();
  for (const Line& line : lines) {
    if (line.hidden_by < 0 || line.hidden_from > line.air + kThinCover) continue;
    hiding.push_back(line.hidden_by);
    from = std::min(from, line.hidden_from);
  }
  if (double(hiding.size()) >= kAll * kLines) {
    const int tissue = commonest(hiding);
    return fmt::format("everything lies behind {} {:.0f} mm below the probe; slide or tilt it",
                       tissue == 0 ? "gas" : model.scene().tissues[tissue].name, from * 1e3);
  }
  const double loudest = std::ranges::max(lines, {}, &Line::loudest_db).loudest_db;
  const double missing = std::ceil(0.5 * double(model.constants().dynamic_range) - loudest);
  const double gain = model.controls().gain_db;
  if (gain + missing <= ControlLimits::of(model.scene().probe).gain_db.max) {
    return fmt::format("the gain is too low ({:g} dB); raise it by about {:.0f} dB", gain, missing);
  }
  return "nothing under the probe scatters sound: fluid only; slide the probe";
}

}  // namespace stylet::ultrasound
