#include "engine/import/derived_body.h"

#include "engine/files/error.h"
#include "engine/import/label_solid.h"
#include "engine/mesh/stuffing.h"
#include "engine/mesh/tet_quality.h"

#include <fnmatch.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace stylet::import {
namespace {

using files::ContentError;

constexpr double kSlice = 0.004;      // m: slices along the body, and rows within them
constexpr int kDirections = 96;       // of the hull of a slice
constexpr double kNarrows = 0.3;      // m a metre along the body, at most
constexpr double kSmooth = 0.012;     // m along the body: standard deviation of the Gaussian
constexpr double kHullCell = 0.008;   // m, of its surface
constexpr double kMaskCell = 0.006;   // m
constexpr double kMaskVoxel = 0.003;  // m: voxels of a body label are thinned out to about this
constexpr double kLargest = 3;        // m, of a patient
constexpr double kEmpty = -1e9;       // support of nothing
constexpr int kBodySmoothing = 2;     // passes, of the triangles

/// Largest extent of what lies in each axial slice, in directions across the body: support functions.
class Slices {
public:
  Slices(const Eigen::AlignedBox3d& box) : first_(box.min().y()), centre_(box.center().x(), box.center().z()) {
    count_ = static_cast<int>(std::floor(box.sizes().y() / kSlice)) + 1;
    support_.assign(static_cast<std::size_t>(count_) * kDirections, kEmpty);
    for (int k = 0; k < kDirections; ++k) {
      const double angle = 2 * std::numbers::pi * k / kDirections;
      across_[static_cast<std::size_t>(k)] = {std::cos(angle), std::sin(angle)};
    }
  }

  int slice_of(double y) const { return std::clamp(static_cast<int>((y - first_) / kSlice), 0, count_ - 1); }

  void add(int slice, const Eigen::Vector2d& point) {
    const Eigen::Vector2d p = point - centre_;
    for (int k = 0; k < kDirections; ++k) {
      double& most = at(slice, k);
      most = std::max(most, p.dot(across_[static_cast<std::size_t>(k)]));
    }
  }

  /// A body narrows gently towards the head and the feet.
  void smooth() {
    for (int k = 0; k < kDirections; ++k) {
      for (int j = 1; j < count_; ++j) at(j, k) = std::max(at(j, k), at(j - 1, k) - kNarrows * kSlice);
      for (int j = count_ - 2; j >= 0; --j) at(j, k) = std::max(at(j, k), at(j + 1, k) - kNarrows * kSlice);
    }
    const std::vector<double> sharp = support_;
    const int reach = static_cast<int>(std::ceil(3 * kSmooth / kSlice));
    for (int j = 0; j < count_; ++j) {
      for (int k = 0; k < kDirections; ++k) {
        double sum = 0, weights = 0;
        for (int d = -reach; d <= reach; ++d) {
          const double weight = std::exp(-0.5 * std::pow(d * kSlice / kSmooth, 2));
          sum += weight * sharp[index(std::clamp(j + d, 0, count_ - 1), k)];
          weights += weight;
        }
        at(j, k) = std::max(sum / weights, sharp[index(j, k)]);  // nothing is cut off
      }
    }
  }

  /// Metres outside the hull of the slice, negative inside.
  double outside(const Eigen::Vector3d& x) const {
    const double slice = std::clamp((x.y() - first_) / kSlice - 0.5, 0.0, static_cast<double>(count_ - 1));
    const int j = std::min(static_cast<int>(slice), std::max(count_ - 2, 0)), next = std::min(j + 1, count_ - 1);
    const double t = slice - j;
    const Eigen::Vector2d p = Eigen::Vector2d(x.x(), x.z()) - centre_;
    double most = -std::numeric_limits<double>::infinity();
    for (int k = 0; k < kDirections; ++k) {
      const double support = (1 - t) * support_[index(j, k)] + t * support_[index(next, k)];
      most = std::max(most, p.dot(across_[static_cast<std::size_t>(k)]) - support);
    }
    return most;
  }

  /// Of all slices, from the middle, m.
  double widest() const { return *std::max_element(support_.begin(), support_.end()); }
  const Eigen::Vector2d& centre() const { return centre_; }

private:
  static std::size_t index(int slice, int k) { return static_cast<std::size_t>(slice * kDirections + k); }
  double& at(int slice, int k) { return support_[index(slice, k)]; }

  double first_;
  Eigen::Vector2d centre_;
  int count_ = 1;
  std::vector<double> support_;  // [slices][directions] m
  std::array<Eigen::Vector2d, kDirections> across_;
};

/// Half of a voxel's extent along the axes of the patient, m.
Eigen::Vector3d half_voxel(const LabelImage& image) {
  return 0.5 * image.patient_from_voxel.linear().cwiseAbs().rowwise().sum();
}

std::size_t row_of(const LabelImage& image, int j, int k) {
  return static_cast<std::size_t>(image.size.x()) *
         (static_cast<std::size_t>(j) + static_cast<std::size_t>(image.size.y()) * static_cast<std::size_t>(k));
}

/// visit(first, last voxel) of each row that has a label: all that a hull needs.
template <typename Visit>
void for_each_row(const LabelImage& image, const std::function<void()>& pulse, Visit visit) {
  for (int k = 0; k < image.size.z(); ++k) {
    pulse();
    for (int j = 0; j < image.size.y(); ++j) {
      const auto row = image.labels.begin() + static_cast<std::ptrdiff_t>(row_of(image, j, k));
      const auto end = row + image.size.x();
      const auto first = std::find_if(row, end, [](std::uint16_t label) { return label != 0; });
      if (first == end) continue;
      auto last = end - 1;
      while (*last == 0) --last;
      visit(Eigen::Vector3d(static_cast<double>(first - row), j, k),
            Eigen::Vector3d(static_cast<double>(last - row), j, k));
    }
  }
}

/// Whether something is labelled in the last layer of voxels towards the head (+1) or the feet (-1).
bool ends_in_patient(const LabelImage& image, int side) {
  const Eigen::Vector3d along = image.patient_from_voxel.linear().row(1).transpose();
  Eigen::Index axis = 0;
  along.cwiseAbs().maxCoeff(&axis);
  const int last = along[axis] * side > 0 ? image.size[axis] - 1 : 0;
  const Eigen::Index u = (axis + 1) % 3, w = (axis + 2) % 3;
  Eigen::Vector3i v = Eigen::Vector3i::Constant(last);
  for (v[u] = 0; v[u] < image.size[u]; ++v[u]) {
    for (v[w] = 0; v[w] < image.size[w]; ++v[w]) {
      if (image.labels[row_of(image, v.y(), v.z()) + static_cast<std::size_t>(v.x())] != 0) return true;
    }
  }
  return false;
}

/// Points of the rows of a volume, at the outer edges of their voxels.
void add_volume(const LabelImage& image, const std::function<void()>& pulse, const auto& add) {
  const Eigen::Vector3d half = half_voxel(image);
  for_each_row(image, pulse, [&](const Eigen::Vector3d& first, const Eigen::Vector3d& last) {
    const Eigen::Vector3d a = image.patient_from_voxel * first, b = image.patient_from_voxel * last;
    // A row that runs along the body lies in many slices.
    const int steps = std::max(1, static_cast<int>(std::ceil(std::abs(b.y() - a.y()) / kSlice)));
    for (int step = 0; step <= steps; ++step) {
      const Eigen::Vector3d p = a + (b - a) * step / steps;
      for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3d side((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1,
                                   (corner & 4) != 0 ? 1 : -1);
        add(p + half.cwiseProduct(side));
      }
    }
  });
}

DerivedBody hull(const std::vector<SourceFile>& files, const std::function<void()>& pulse) {
  Eigen::AlignedBox3d box;
  std::array<bool, 2> cut{false, false};  // towards the feet, the head
  const auto each_point = [&](const auto& add) {
    for (const SourceFile& file : files) {
      if (file.image) add_volume(*file.image, pulse, add);
      for (const SourcePart& part : file.parts) {
        pulse();
        for (const Eigen::Vector3d& v : part.mesh.vertices) add(v);
      }
    }
  };
  each_point([&](const Eigen::Vector3d& p) { box.extend(p); });
  if (box.isEmpty()) throw ContentError("there is no label and no surface to derive the body from");
  if (box.sizes().maxCoeff() > kLargest) {
    throw ContentError(
        fmt::format("what was segmented is {:.3g} m wide, too much for one patient; check the files' "
                    "unit, or name the skin",
                    box.sizes().maxCoeff()));
  }
  for (const SourceFile& file : files) {
    if (!file.image) continue;
    cut[0] = cut[0] || ends_in_patient(*file.image, -1);
    cut[1] = cut[1] || ends_in_patient(*file.image, 1);
  }
  Slices slices(box);
  each_point([&](const Eigen::Vector3d& p) { slices.add(slices.slice_of(p.y()), {p.x(), p.z()}); });
  slices.smooth();
  const double feet = box.min().y() - (cut[0] ? 0 : kBodyWall), head = box.max().y() + (cut[1] ? 0 : kBodyWall);
  std::size_t asked = 0;
  const auto distance = [&](const Eigen::Vector3d& x) {
    if (++asked % 4096 == 0) pulse();
    return std::max({slices.outside(x) - kBodyWall, feet - x.y(), x.y() - head});
  };
  const double reach = slices.widest() + kBodyWall + kHullCell;
  const Eigen::Vector2d& c = slices.centre();
  const Eigen::AlignedBox3d around(Eigen::Vector3d(c.x() - reach, feet - kHullCell, c.y() - reach),
                                   Eigen::Vector3d(c.x() + reach, head + kHullCell, c.y() + reach));
  return {.surface = mesh::boundary_surface(mesh::stuff(distance, around, kHullCell, kBodySmoothing)).mesh,
          .how = fmt::format("derived: no part is the body; a hull {:.0f} mm outside all that was segmented",
                             kBodyWall * 1e3)};
}

/// All labels, thinned out, with what they enclose in each axial slice.
LabelImage filled(const LabelImage& image, const std::function<void()>& pulse) {
  LabelImage mask;
  const Eigen::Vector3d spacing = image.patient_from_voxel.linear().colwise().norm().transpose();
  Eigen::Vector3i step;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    step[axis] = std::max(1, static_cast<int>(std::lround(kMaskVoxel / spacing[axis])));
    mask.size[axis] = (image.size[axis] + step[axis] - 1) / step[axis];
  }
  mask.patient_from_voxel = image.patient_from_voxel * Eigen::Scaling(step.cast<double>().eval());
  mask.labels.assign(row_of(mask, 0, mask.size.z()), 0);
  for (int k = 0; k < mask.size.z(); ++k) {
    pulse();
    for (int j = 0; j < mask.size.y(); ++j) {
      const std::size_t from = row_of(image, j * step.y(), k * step.z()), to = row_of(mask, j, k);
      for (int i = 0; i < mask.size.x(); ++i) {
        mask.labels[to + static_cast<std::size_t>(i)] =
            image.labels[from + static_cast<std::size_t>(i * step.x())] != 0 ? 1 : 0;
      }
    }
  }
  // What the slice's rim reaches through voxels without a label is outside; the rest is filled.
  Eigen::Index axis = 0;
  image.patient_from_voxel.linear().row(1).cwiseAbs().maxCoeff(&axis);
  const Eigen::Index u = (axis + 1) % 3, w = (axis + 2) % 3;
  constexpr std::uint16_t kOutside = 2;
  std::vector<Eigen::Vector3i> open;
  for (int slice = 0; slice < mask.size[axis]; ++slice) {
    pulse();
    const auto flood = [&](int a, int b) {
      if (a < 0 || b < 0 || a >= mask.size[u] || b >= mask.size[w]) return;
      Eigen::Vector3i v;
      v[axis] = slice, v[u] = a, v[w] = b;
      std::uint16_t& label = mask.labels[row_of(mask, v.y(), v.z()) + static_cast<std::size_t>(v.x())];
      if (label != 0) return;
      label = kOutside;
      open.push_back(v);
    };
    for (int a = 0; a < mask.size[u]; ++a) flood(a, 0), flood(a, mask.size[w] - 1);
    for (int b = 0; b < mask.size[w]; ++b) flood(0, b), flood(mask.size[u] - 1, b);
    while (!open.empty()) {
      const Eigen::Vector3i v = open.back();
      open.pop_back();
      flood(v[u] - 1, v[w]), flood(v[u] + 1, v[w]), flood(v[u], v[w] - 1), flood(v[u], v[w] + 1);
    }
  }
  for (std::uint16_t& label : mask.labels) label = label == kOutside ? 0 : 1;
  return mask;
}

}  // namespace

bool names_body(const std::string& part) {
  static constexpr std::array kNames{"body", "body_skin", "body_trunc", "body_trunk", "body_contour",
                                     "skin", "torso",     "trunk",      "external",   "outline"};
  return std::ranges::any_of(kNames,
                             [&](const char* name) { return ::fnmatch(name, part.c_str(), FNM_CASEFOLD) == 0; });
}

DerivedBody derive_body(const std::vector<SourceFile>& files, const std::function<void()>& pulse) {
  for (const SourceFile& file : files) {
    const auto body = std::ranges::find_if(file.parts, [](const SourcePart& part) { return names_body(part.name); });
    if (!file.image || body == file.parts.end()) continue;
    const std::array label{1};
    const LabelSolid solid(filled(*file.image, pulse), label, LabelSolid::kMostVoxels, pulse);
    std::size_t asked = 0;
    const auto distance = [&](const Eigen::Vector3d& x) {
      if (++asked % 4096 == 0) pulse();
      return solid.signed_distance(x);
    };
    return {.surface = mesh::boundary_surface(mesh::stuff(distance, solid.bounds(), kMaskCell, kBodySmoothing)).mesh,
            .how = fmt::format("derived: all labels together with \"{}\", filled", body->name)};
  }
  return hull(files, pulse);
}

}  // namespace stylet::import
