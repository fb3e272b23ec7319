#include "engine/import/scene_picture.h"

#include "engine/figures/canvas.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace stylet::import {
namespace {

constexpr double kPatientMargin = 0.010;  // m about the patient
constexpr double kFan = 0.170;            // m, half the width of the cut along the ultrasound image
const figures::Colour kNeedle{255, 235, 60, 255};
const figures::Colour kTarget{255, 255, 255, 255};
const figures::Colour kProbeColour{90, 220, 255, 255};

/// A plane and how it is laid on a panel.
struct Cut {
  std::string title;
  Eigen::Vector3d origin, right, up;  ///< the panel's middle; unit
  double half = 0;                    ///< m from the middle to the edge
  std::string left_mark, right_mark;
};

class Panel {
public:
  Panel(picture::Picture& picture, int left, int top, int size, const Cut& cut, const ImportedScene& imported,
        const content::Scene& scene)
      : picture_(picture), left_(left), top_(top), size_(size), cut_(cut), imported_(imported), scene_(scene) {}

  void draw(figures::Canvas& canvas, const figures::Font& font) {
    tissues();
    canvas.clip({static_cast<double>(left_), static_cast<double>(top_), static_cast<double>(left_ + size_),
                 static_cast<double>(top_ + size_)});
    tetrahedra(canvas);
    canvas.line(place(imported_.entry), place(imported_.target), 2.5, kNeedle);
    canvas.disc(place(imported_.entry), 4, kNeedle);
    canvas.disc(place(imported_.target), 3, kTarget);
    probe(canvas);
    const figures::Colour ink{255, 255, 255, 255};
    canvas.text(font, cut_.title, {left_ + 10.0, top_ + 16.0}, 18, ink);
    canvas.text(font, cut_.left_mark, {left_ + 10.0, top_ + size_ / 2.0}, 20, ink);
    canvas.text(font, cut_.right_mark, {left_ + size_ - 10.0, top_ + size_ / 2.0}, 20, ink, figures::Align::right);
    const double bar = 0.05 / (2 * cut_.half) * size_;
    canvas.line({left_ + 10.0, top_ + size_ - 14.0}, {left_ + 10.0 + bar, top_ + size_ - 14.0}, 3, ink);
    canvas.text(font, "50 mm", {left_ + 18.0 + bar, top_ + size_ - 14.0}, 16, ink);
    canvas.unclip();
  }

private:
  figures::PixelPoint place(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d d = x - cut_.origin;
    const double scale = size_ / (2 * cut_.half);
    return {left_ + size_ / 2.0 + scale * d.dot(cut_.right), top_ + size_ / 2.0 - scale * d.dot(cut_.up)};
  }

  void tissues() {
    const content::LabelVolume& labels = scene_.labels;
    for (int row = 0; row < size_; ++row) {
      for (int column = 0; column < size_; ++column) {
        const double step = 2 * cut_.half / size_;
        const Eigen::Vector3d x = cut_.origin + step * (column + 0.5 - size_ / 2.0) * cut_.right -
                                  step * (row + 0.5 - size_ / 2.0) * cut_.up;
        const Eigen::Vector3d grid = (x - labels.origin.cast<double>()) / labels.spacing;
        const Eigen::Vector3i voxel = grid.array().round().cast<int>();
        std::array<double, 3> colour{0.01, 0.01, 0.015};
        if ((voxel.array() >= 0).all() && (voxel.array() < labels.size.array()).all()) {
          const std::size_t index = (static_cast<std::size_t>(voxel.z()) * static_cast<std::size_t>(labels.size.y()) +
                                     static_cast<std::size_t>(voxel.y())) *
                                        static_cast<std::size_t>(labels.size.x()) +
                                    static_cast<std::size_t>(voxel.x());
          const std::uint8_t label = labels.labels[index];
          // What a body carries is lighter: it moves.
          const double light = labels.bodies[index] >= 0 ? 1.0 : 0.55;
          if (label != 0) {
            for (std::size_t c = 0; c < 3; ++c) {
              colour[c] = light * static_cast<double>(scene_.tissues[label].colour[c]);
            }
          }
        }
        std::uint8_t* pixel = picture_.at(left_ + column, top_ + row);
        for (std::size_t c = 0; c < 3; ++c) {
          pixel[c] = static_cast<std::uint8_t>(std::lround(255 * std::pow(std::clamp(colour[c], 0.0, 1.0), 1 / 2.2)));
        }
      }
    }
  }

  void tetrahedra(figures::Canvas& canvas) {
    static constexpr std::array<std::array<int, 2>, 6> kEdges{{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};
    const Eigen::Vector3d normal = cut_.right.cross(cut_.up);
    for (const content::DeformableBody& body : scene_.bodies) {
      for (const auto& tet : body.mesh.tets) {
        // Where the plane crosses the edges: three or four points; all of their connections are the section's sides,
        // and the diagonals of a quadrilateral.
        std::vector<std::pair<int, Eigen::Vector3d>> points;
        for (std::size_t e = 0; e < kEdges.size(); ++e) {
          const auto corner = [&](int c) { return body.mesh.nodes[tet[c]]; };
          const Eigen::Vector3d a = corner(kEdges[e][0]), b = corner(kEdges[e][1]);
          const double da = normal.dot(a - cut_.origin), db = normal.dot(b - cut_.origin);
          if ((da < 0) != (db < 0)) points.emplace_back(static_cast<int>(e), a + da / (da - db) * (b - a));
        }
        for (std::size_t i = 0; i < points.size(); ++i) {
          for (std::size_t j = i + 1; j < points.size(); ++j) {
            // A side lies in a face: its two edges share a corner.
            const auto& p = kEdges[points[i].first];
            const auto& q = kEdges[points[j].first];
            if (p[0] != q[0] && p[0] != q[1] && p[1] != q[0] && p[1] != q[1]) continue;
            canvas.line(place(points[i].second), place(points[j].second), 0.7, {255, 255, 255, 60});
          }
        }
      }
    }
  }

  void probe(figures::Canvas& canvas) {
    const content::Probe& probe = scene_.probe;
    const Eigen::Vector3d lateral = probe.pose.orientation * Eigen::Vector3d::UnitX();
    const Eigen::Vector3d axis = probe.pose.orientation * Eigen::Vector3d::UnitZ();
    std::vector<figures::PixelPoint> face;
    for (int i = -12; i <= 12; ++i) {
      const double share = i / 12.0;
      Eigen::Vector3d x = probe.pose.position + share * 0.5 * probe.width * lateral;
      if (probe.convex) {
        const double angle = share * 0.5 * probe.field_of_view;
        x = probe.pose.position + probe.radius * (std::sin(angle) * lateral + (std::cos(angle) - 1) * axis);
      }
      face.push_back(place(x));
    }
    canvas.polyline(face, 2.5, kProbeColour);
  }

  picture::Picture& picture_;
  int left_, top_, size_;
  const Cut& cut_;
  const ImportedScene& imported_;
  const content::Scene& scene_;
};

}  // namespace

picture::Picture scene_picture(const ImportedScene& imported, const content::Scene& scene, int panel) {
  const content::LabelVolume& labels = scene.labels;
  const Eigen::Vector3d low = labels.origin.cast<double>();
  const Eigen::Vector3d size = (labels.size.cast<float>() * labels.spacing).cast<double>();
  const Eigen::Vector3d middle = low + 0.5 * size;
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
  // Through the target, the middle of the patient in the middle of the panel.
  const auto through = [&](int axis) {
    Eigen::Vector3d origin = middle;
    origin[axis] = imported.target[axis];
    return origin;
  };
  const Eigen::Vector3d lateral = imported.probe.orientation * x;
  const Eigen::Vector3d down = imported.probe.orientation * z;
  const double half = 0.5 * size.maxCoeff() + kPatientMargin;
  const std::array<Cut, 4> cuts{Cut{"axial, from the feet", through(1), x, z, half, "R", "L"},
                                Cut{"coronal, from the front", through(2), x, y, half, "R", "L"},
                                Cut{"sagittal, from the left", through(0), -z, y, half, "A", "P"},
                                Cut{"plane of the ultrasound image", imported.probe.position + 0.35 * 2 * kFan * down,
                                    lateral, -down, kFan, "", ""}};
  const int gap = 6;
  picture::Picture picture(2 * panel + gap, 2 * panel + gap, {30, 30, 36, 255});
  figures::Canvas canvas(picture);
  const figures::Font font = figures::Font::load();
  for (int i = 0; i < 4; ++i) {
    Panel(picture, (i % 2) * (panel + gap), (i / 2) * (panel + gap), panel, cuts[i], imported, scene)
        .draw(canvas, font);
  }
  return picture;
}

}  // namespace stylet::import
