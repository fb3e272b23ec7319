#include "engine/import/organ_picture.h"

#include "engine/figures/canvas.h"
#include "engine/mesh/surface_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

namespace stylet::import {
namespace {

using Rgb = Eigen::Vector3d;  // linear, 0 to 1

constexpr std::array<std::uint8_t, 4> kBackground{250, 250, 252, 255};
const Rgb kTissue(0.62, 0.28, 0.23);
const Rgb kEdge(0.08, 0.08, 0.10);

/// Seen along -Z of the patient (from the front): x to the right is the patient's left.
class FrontPanel {
public:
  FrontPanel(picture::Picture& picture, int left, int width, int top, int height, const Eigen::AlignedBox3d& box)
      : picture_(picture),
        left_(left),
        top_(top),
        width_(width),
        height_(height),
        depth_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), -1e30) {
    const Eigen::Vector3d size = box.sizes();
    scale_ = 0.9 * std::min(width / std::max(size.x(), 1e-9), height / std::max(size.y(), 1e-9));
    centre_ = box.center();
  }

  double pixels_per_metre() const { return scale_; }

  /// @param edges  draws the triangle's border
  void triangle(const std::array<Eigen::Vector3d, 3>& world, const std::array<Rgb, 3>& colours, bool edges) {
    std::array<Eigen::Vector3d, 3> p;
    for (std::size_t c = 0; c < 3; ++c) p[c] = to_pixel(world[c]);
    const double area = (p[1] - p[0]).x() * (p[2] - p[0]).y() - (p[1] - p[0]).y() * (p[2] - p[0]).x();
    if (area == 0) return;
    const auto least = [&](int axis) { return std::min({p[0][axis], p[1][axis], p[2][axis]}); };
    const auto most = [&](int axis) { return std::max({p[0][axis], p[1][axis], p[2][axis]}); };
    const int x0 = std::max(0, static_cast<int>(least(0))), x1 = std::min(width_ - 1, static_cast<int>(most(0)) + 1);
    const int y0 = std::max(0, static_cast<int>(least(1))), y1 = std::min(height_ - 1, static_cast<int>(most(1)) + 1);
    std::array<double, 3> per_pixel{};  // length of the opposite edge over the area: barycentric to pixels
    for (std::size_t c = 0; c < 3; ++c) {
      const Eigen::Vector3d edge = p[(c + 2) % 3] - p[(c + 1) % 3];
      per_pixel[c] = std::abs(area) / std::max(edge.head<2>().norm(), 1e-9);
    }
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        const double px = x + 0.5, py = y + 0.5;
        std::array<double, 3> w{};
        for (std::size_t c = 0; c < 3; ++c) {
          const Eigen::Vector3d& a = p[(c + 1) % 3];
          const Eigen::Vector3d& b = p[(c + 2) % 3];
          w[c] = ((b.x() - a.x()) * (py - a.y()) - (b.y() - a.y()) * (px - a.x())) / area;
        }
        if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
        const double z = w[0] * p[0].z() + w[1] * p[1].z() + w[2] * p[2].z();
        double& nearest =
            depth_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
        if (z <= nearest) continue;
        nearest = z;
        Rgb colour = w[0] * colours[0] + w[1] * colours[1] + w[2] * colours[2];
        if (edges) {
          double border = 1e9;  // pixels
          for (std::size_t c = 0; c < 3; ++c) border = std::min(border, w[c] * per_pixel[c]);
          colour = colour + (kEdge - colour) * 0.75 * std::clamp(1.3 - border, 0.0, 1.0);
        }
        std::uint8_t* pixel = picture_.at(left_ + x, top_ + y);
        for (int k = 0; k < 3; ++k) {
          pixel[k] = static_cast<std::uint8_t>(std::lround(255 * std::pow(std::clamp(colour[k], 0.0, 1.0), 1 / 2.2)));
        }
        pixel[3] = 255;
      }
    }
  }

private:
  /// Pixels, and metres towards the viewer.
  Eigen::Vector3d to_pixel(const Eigen::Vector3d& world) const {
    const Eigen::Vector3d d = world - centre_;
    return {0.5 * width_ + scale_ * d.x(), 0.5 * height_ - scale_ * d.y(), d.z()};
  }

  picture::Picture& picture_;
  int left_, top_, width_, height_;
  double scale_ = 1;
  Eigen::Vector3d centre_;
  std::vector<double> depth_;
};

Rgb lit(const Rgb& colour, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d light = Eigen::Vector3d(-0.4, 0.5, 0.77).normalized();
  return colour * (0.18 + 0.82 * std::max(0.0, normal.dot(light)));
}

/// Red at 12 degrees and less, green at 45 and more.
Rgb quality_colour(double degrees) {
  const double t = std::clamp((degrees - 12) / (45 - 12), 0.0, 1.0);
  return {0.75 * (1 - t) + 0.15 * t, 0.10 * (1 - t) + 0.55 * t, 0.10 * (1 - t) + 0.20 * t};
}

void draw_surface(FrontPanel& panel, const mesh::TriangleMesh& mesh) {
  const std::vector<Eigen::Vector3f> normals = mesh::smooth_normals(mesh);
  for (const auto& t : mesh.triangles) {
    std::array<Eigen::Vector3d, 3> corners;
    std::array<Rgb, 3> colours;
    for (std::size_t c = 0; c < 3; ++c) {
      corners[c] = mesh.vertices[t[c]];
      colours[c] = lit(kTissue, normals[t[c]].cast<double>());
    }
    panel.triangle(corners, colours, false);
  }
}

void draw_cut(FrontPanel& panel, const physics::TetMesh& mesh, double plane) {
  // Faces that only one kept tetrahedron has.
  struct Face {
    std::array<int, 3> corners;
    double angle = 0;
    int uses = 0;
    bool cut = false;
  };
  std::map<std::array<int, 3>, Face> faces;
  for (const auto& tet : mesh.tets) {
    std::array<Eigen::Vector3d, 4> x;
    for (std::size_t c = 0; c < 4; ++c) x[c] = mesh.nodes[tet[c]];
    if ((x[0] + x[1] + x[2] + x[3]).z() / 4 > plane) continue;
    const double front = std::max({x[0].z(), x[1].z(), x[2].z(), x[3].z()});
    const double angle = mesh::dihedral_range(x[0], x[1], x[2], x[3]).min * 180 / std::numbers::pi;
    for (const auto& f : {std::array{1, 2, 3}, std::array{0, 3, 2}, std::array{0, 1, 3}, std::array{0, 2, 1}}) {
      std::array<int, 3> corners{};
      for (std::size_t c = 0; c < 3; ++c) corners[c] = tet[f[c]];
      std::array<int, 3> key = corners;
      std::sort(key.begin(), key.end());
      Face& face = faces[key];
      face.corners = corners;
      face.angle = angle;
      face.cut = front > plane - 1e-3;
      ++face.uses;
    }
  }
  for (const auto& [key, face] : faces) {
    if (face.uses != 1) continue;
    std::array<Eigen::Vector3d, 3> x;
    for (std::size_t c = 0; c < 3; ++c) x[c] = mesh.nodes[face.corners[c]];
    const Eigen::Vector3d normal = (x[1] - x[0]).cross(x[2] - x[0]).normalized();
    if (normal.z() <= 0) continue;  // from behind
    const Rgb colour = lit(face.cut ? quality_colour(face.angle) : Rgb(0.75, 0.6, 0.55), normal);
    panel.triangle(x, {colour, colour, colour}, true);
  }
}

/// A length of 1, 2 or 5 times a power of ten near a sixth of the panel.
double scale_bar(double metres) {
  const double power = std::pow(10, std::floor(std::log10(metres)));
  for (const double step : {5.0, 2.0}) {
    if (step * power <= metres) return step * power;
  }
  return power;
}

}  // namespace

picture::Picture organ_picture(const ImportedOrgan& organ, int width, int height) {
  picture::Picture picture(width, height, kBackground);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : organ.surface.vertices) box.extend(v);
  const int half = width / 2, top = 40, inner = height - 100;
  FrontPanel surface(picture, 0, half, top, inner, box);
  draw_surface(surface, organ.surface);
  FrontPanel cut(picture, half, half, top, inner, box);
  draw_cut(cut, organ.mesh, box.center().z());

  figures::Canvas canvas(picture);
  const figures::Font font = figures::Font::load();
  const figures::Colour ink{40, 40, 48, 255};
  canvas.text(font, organ.id, {16, 22}, 24, ink);
  canvas.text(font, "surface, from the front", {half - 16.0, 22}, 18, ink, figures::Align::right);
  canvas.text(font, "tetrahedra behind the middle plane", {width - 16.0, 22}, 18, ink, figures::Align::right);
  const double metres = scale_bar(half / 6.0 / surface.pixels_per_metre());
  const double length = metres * surface.pixels_per_metre(), y = height - 30.0;
  canvas.line({16, y}, {16 + length, y}, 3, ink);
  canvas.text(font, fmt::format("{:g} mm", metres * 1e3), {24 + length, y}, 18, ink);
  canvas.text(font, "R", {16, top + inner / 2.0}, 22, ink);
  canvas.text(font, "L", {half - 30.0, top + inner / 2.0}, 22, ink);
  const ImportReport& r = organ.report;
  canvas.text(font,
              fmt::format("{:.4g} ml, {} nodes, {} tetrahedra, volume {:+.2f} %, dihedral angles {:.0f} to {:.0f} "
                          "degrees",
                          r.volume * 1e6, r.nodes, r.tetrahedra, 100 * r.volume_error(), r.quality.min_dihedral_deg,
                          r.quality.max_dihedral_deg),
              {width - 16.0, y}, 18, ink, figures::Align::right);
  return picture;
}

}  // namespace stylet::import
