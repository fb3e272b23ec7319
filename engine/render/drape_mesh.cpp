#include "engine/render/drape_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace stylet::render {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A body lying under a sheet, from the feet to the shoulders: half width and half height of its ellipse as shares of
/// the trunk's, and how far its middle sinks between two legs. y from the middle of the trunk, m.
struct Station {
  double y, width, height, cleft;
};
constexpr Station kBody[] = {{-1.40, 0.70, 0.02, 0.0},  {-1.27, 0.66, 0.30, 0.01}, {-1.15, 0.64, 0.84, 0.035},
                             {-1.04, 0.66, 0.52, 0.05}, {-0.80, 0.74, 0.56, 0.05}, {-0.62, 0.80, 0.70, 0.04},
                             {-0.40, 0.96, 0.82, 0.02}, {-0.22, 1.04, 0.95, 0.0},  {-0.12, 1.00, 1.00, 0.0},
                             {0.14, 1.00, 1.00, 0.0},   {0.26, 1.06, 1.06, 0.0},   {0.34, 1.16, 0.98, 0.0},
                             {0.50, 1.10, 0.85, 0.0}};

double smooth(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

Station body_at(double y) {
  const Station* next = std::find_if(std::begin(kBody), std::end(kBody), [&](const Station& s) { return s.y >= y; });
  if (next == std::begin(kBody)) return kBody[0];
  if (next == std::end(kBody)) return kBody[std::size(kBody) - 1];
  const Station& a = next[-1];
  const Station& b = *next;
  const double t = smooth(a.y, b.y, y);
  return {y, a.width + t * (b.width - a.width), a.height + t * (b.height - a.height),
          a.cleft + t * (b.cleft - a.cleft)};
}

constexpr double kBelowSkin = 0.016;        // m: the cavity's wall, at least
constexpr double kLiningBelowSkin = 0.002;  // skin that is made up
constexpr double kLiningBeyond = 0.09;      // and how far it goes on past the ends of the trunk
constexpr double kCutBelowSkin = 0.006;     // and what closes its ends: nobody looks past it between wall and cloth
constexpr double kMattressHalf = 0.285;     // the sheet turns down here
constexpr double kHang = 0.40;              // and falls so far
constexpr double kFoot = -1.40, kHead = kScreenY;

// Columns of one half of the sheet, from the middle outwards: over the body, over the mattress, down the side.
constexpr int kOver = 18, kFlat = 8, kDown = 14;
constexpr int kClothColumns = kOver + kFlat + kDown;

/// Point of the body's half section, `offset` m outside it; x outwards, y up.
Vector2d on_body(const RoomLayout& layout, const Station& body, double angle, double offset) {
  const double width = layout.trunk_half.x() * body.width + offset;
  const double height = layout.trunk_half.y() * body.height + offset;
  const double middle = std::max(layout.trunk_half.y() * body.height - 0.006, 0.0);
  const double dip = body.cleft * std::exp(-std::pow(angle / 0.35, 2.0));
  return {width * std::sin(angle), std::max(middle + height * std::cos(angle) - dip, 0.008)};
}

/// Point of the sheet's half section at column i (0 ... kClothColumns); x outwards, y up.
Vector2d section(const RoomLayout& layout, const Station& body, int i) {
  const auto round = [&](double angle) { return on_body(layout, body, angle, kDrapeOffset); };
  const Vector2d leaves = round(kDrapeLeaves);
  const double ground = 0.006;
  if (i <= kOver) return round(kDrapeLeaves * i / kOver);
  if (i <= kOver + kFlat) {
    // A short curve down to the mattress, and out to its edge.
    const double t = static_cast<double>(i - kOver) / kFlat;
    const double edge = std::max(kMattressHalf, leaves.x() + 0.05);
    return {leaves.x() + t * (edge - leaves.x()), ground + (leaves.y() - ground) * std::pow(1 - t, 4.0)};
  }
  const double t = static_cast<double>(i - kOver - kFlat) / kDown;
  const double edge = std::max(kMattressHalf, leaves.x() + 0.05);
  return {edge + 0.034 * (1 - std::exp(-8 * t)), ground - kHang * t};
}

/// The half section of the sheet hung over the bar.
Vector2d at_bar(int i) {
  const double t = static_cast<double>(i) / (kOver + kFlat);
  if (i <= kOver + kFlat)
    return {kScreenHalfWidth * t, kScreenHeight + 0.004 - 0.012 * std::sin(std::numbers::pi * t)};
  const double down = static_cast<double>(i - kOver - kFlat) / kDown;
  return {kScreenHalfWidth + 0.012, kScreenHeight - (kHang + kScreenHeight) * down};
}

/// Soft folds, m: of cloth that lies (`lying`), and that hangs. Sums of waves that never meet again nearby.
double hanging_fold(double y, double down) {
  const double deep = smooth(0.02, 0.5, down);
  return deep * (0.016 * std::sin(41 * y + 0.8 * std::sin(9 * y)) + 0.009 * std::sin(67 * y + 1.3) +
                 0.006 * std::sin(23 * y + 4 * down));
}
double lying_fold(double x, double y) {
  // Bent so that no fold runs straight; sharper on top than below, as creases are.
  const double a = std::sin(23 * y + 13 * x + 2.1 * std::sin(7 * x + 5 * y));
  const double b = std::sin(31 * x - 15 * y + 2.4 * std::sin(6 * y + 3 * x));
  return 0.0042 * (a * a * a) + 0.0034 * (b * b * b) + 0.0012 * std::sin(61 * y - 23 * x);
}

/// Where the skin lies round the trunk: share of the ellipse's radius, by angle and place along; its outermost.
class SkinProfile {
public:
  SkinProfile(const RoomLayout& layout, const std::vector<Eigen::Vector3f>& skin)
      : first_(layout.trunk_y[0] - kMargin * kLength) {
    rows_ = static_cast<int>(std::ceil((layout.trunk_y[1] - first_) / kLength)) + kMargin + 1;
    std::vector<double> share(static_cast<std::size_t>(kAround * rows_), 0.0);
    const Eigen::Isometry3d table_from_patient = layout.patient_from_table.inverse();
    for (const Eigen::Vector3f& position : skin) {
      const Vector3d p = table_from_patient * position.cast<double>();
      const Vector2d round((p.x() - layout.trunk_centre.x()) / layout.trunk_half.x(),
                           (p.z() - layout.trunk_centre.y()) / layout.trunk_half.y());
      const int row = static_cast<int>(std::floor((p.y() - first_) / kLength));
      if (row < 0 || row >= rows_) continue;
      double& most = share[index(column_of(layout.trunk_angle(p)), row)];
      most = std::max(most, round.norm());
    }
    fill(share);
    // The cloth bridges what is narrower than two cells, and keeps off the skin between them; what lies below keeps
    // below it.
    share_ = share;
    inner_ = share;
    for (int row = 0; row < rows_; ++row)
      for (int i = 0; i < kAround; ++i)
        for (int dr = -1; dr <= 1; ++dr)
          for (int di = -1; di <= 1; ++di) {
            const std::size_t cell = index(i, row), other = index(i + di, std::clamp(row + dr, 0, rows_ - 1));
            if (known_[other] <= 0) continue;
            share_[cell] = std::max(share_[cell], share[other]);
            inner_[cell] = std::min(inner_[cell], share[other]);
          }
  }

  struct Place {
    double share = 1;  ///< of the ellipse's radius, on the skin or outside it
    double inner = 1;  ///< on it or inside
    double known = 0;  ///< 1: there is skin; falls to 0 away from it
  };
  /// Between cells linear.
  Place at(double angle, double y) const {
    const double column = (std::remainder(angle, 2 * std::numbers::pi) + std::numbers::pi) / kAngle - 0.5;
    const double row = std::clamp((y - first_) / kLength - 0.5, 0.0, static_cast<double>(rows_ - 1));
    const int i = static_cast<int>(std::floor(column)), j = std::min(static_cast<int>(row), rows_ - 2);
    Place place{.share = 0, .inner = 0, .known = 0};
    for (int di = 0; di <= 1; ++di)
      for (int dj = 0; dj <= 1; ++dj) {
        const double weight = (di > 0 ? column - i : 1 - column + i) * (dj > 0 ? row - j : 1 - row + j);
        const std::size_t cell = index(i + di, j + dj);
        place.share += weight * share_[cell];
        place.inner += weight * inner_[cell];
        place.known += weight * known_[cell];
      }
    return place;
  }

private:
  static constexpr int kAround = 96;
  static constexpr double kAngle = 2 * std::numbers::pi / kAround, kLength = 0.01;
  static constexpr int kMargin = 14;      // rows beyond the skin over which the cloth leaves it
  static constexpr double kFades = 0.08;  // of `known`, a cell away from the skin

  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row * kAround + (column % kAround + kAround) % kAround);
  }
  static int column_of(double angle) {
    return static_cast<int>(std::floor((std::remainder(angle, 2 * std::numbers::pi) + std::numbers::pi) / kAngle));
  }

  /// Cells without skin get the mean of their neighbors that have it, ring by ring.
  void fill(std::vector<double>& share) {
    known_.assign(share.size(), 0.0);
    for (std::size_t c = 0; c < share.size(); ++c) known_[c] = share[c] > 0 ? 1 : 0;
    for (double known = 1 - kFades; known > 0; known -= kFades) {
      const std::vector<double> before = share;
      for (int row = 0; row < rows_; ++row)
        for (int i = 0; i < kAround; ++i) {
          if (before[index(i, row)] > 0) continue;
          double sum = 0;
          int count = 0;
          for (int dr = -1; dr <= 1; ++dr)
            for (int di = -1; di <= 1; ++di) {
              if (row + dr < 0 || row + dr >= rows_) continue;
              const double other = before[index(i + di, row + dr)];
              if (other <= 0) continue;
              sum += other;
              ++count;
            }
          if (count == 0) continue;
          share[index(i, row)] = sum / count;
          known_[index(i, row)] = known;
        }
    }
    for (double& each : share)
      if (each <= 0) each = 1;
  }

  double first_;
  int rows_ = 0;
  std::vector<double> share_, inner_, known_;  // [rows][around]
};

void compute_normals(RoomMesh& mesh) {
  mesh.normals.assign(mesh.positions.size(), Eigen::Vector3f::Zero());
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const std::span<const std::uint32_t> t = std::span(mesh.indices).subspan(i, 3);
    const Eigen::Vector3f area =
        (mesh.positions[t[1]] - mesh.positions[t[0]]).cross(mesh.positions[t[2]] - mesh.positions[t[0]]);
    for (const std::uint32_t k : t) mesh.normals[k] += area;
  }
  for (Eigen::Vector3f& normal : mesh.normals)
    normal = normal.norm() > 0 ? normal.normalized() : Eigen::Vector3f::UnitZ();
}

/// Triangles of a grid of rows, its upper side seen with columns to the right and rows away.
void join_grid(RoomMesh& mesh, std::uint32_t rows, std::uint32_t columns) {
  for (std::uint32_t j = 0; j + 1 < rows; ++j)
    for (std::uint32_t i = 0; i + 1 < columns; ++i) {
      const std::uint32_t a = j * columns + i, b = a + 1, c = b + columns, d = a + columns;
      mesh.indices.insert(mesh.indices.end(), {a, b, c, a, c, d});
    }
}

}  // namespace

RoomMesh drape_mesh(const RoomLayout& layout, const std::vector<Eigen::Vector3f>& skin) {
  RoomMesh mesh;
  const SkinProfile profile(layout, skin);
  constexpr double kSteep = kHead - 0.18;  // from here on it rises to the bar
  constexpr int kRowsBelow = 64, kRowsAbove = 14;
  const int rows = kRowsBelow + kRowsAbove + 1;
  constexpr int kBehind = 5;  // rows that hang behind the bar
  for (int row = 0; row < rows + kBehind; ++row) {
    const double y = row <= kRowsBelow ? kFoot + (kSteep - kFoot) * row / kRowsBelow
                                       : std::min(kSteep + (kHead - kSteep) * (row - kRowsBelow) / kRowsAbove, kHead);
    const Station body = body_at(y);
    const double raised = smooth(kHead - 0.17, kHead, y);
    for (int column = -kClothColumns; column <= kClothColumns; ++column) {
      const int i = std::abs(column);
      const double side = column < 0 ? -1 : 1;
      Vector2d p = section(layout, body, i);
      const double angle = side * kDrapeLeaves * std::min(i, kOver) / kOver;
      const bool over_body = i <= kOver;
      if (over_body) {
        const SkinProfile::Place place = profile.at(angle, y);
        const Vector2d round(layout.trunk_half.x() * std::sin(std::abs(angle)),
                             layout.trunk_half.y() * std::cos(angle));
        const Vector2d out =
            Vector2d(round.x() / std::pow(layout.trunk_half.x(), 2), round.y() / std::pow(layout.trunk_half.y(), 2))
                .normalized();
        const Vector2d on = Vector2d(0, layout.trunk_centre.y()) + place.share * round + kDrapeOffset * out;
        p = (1 - place.known) * p + place.known * Vector2d(on.x(), std::max(on.y(), 0.008));
      }
      p = (1 - raised) * p + raised * at_bar(i);
      // Taut on the trunk, loose elsewhere.
      const double loose = std::clamp(
          smooth(0.06, 0.30, std::abs(layout.outside_field(angle, y))) + (over_body ? 0.0 : 1.0), 0.0, 1.0);
      const double fold = over_body || i <= kOver + kFlat
                              ? loose * (lying_fold(side * p.x(), y) + 0.0088)
                              : hanging_fold(y + 0.1 * side, static_cast<double>(i - kOver - kFlat) / kDown);
      if (over_body)
        p += fold * Vector2d(std::sin(std::abs(angle)), std::cos(angle));
      else if (i <= kOver + kFlat)
        p.y() += fold;
      else
        p.x() += fold;
      const double behind = row >= rows ? 0.02 * (row - rows + 1) : 0.0;
      mesh.positions.emplace_back(
          static_cast<float>(side * p.x()),
          static_cast<float>(y + std::min(behind, 0.012) + 0.3 * raised * lying_fold(p.x(), p.y())),
          static_cast<float>(p.y() - behind));
      const Vector2d at = layout.in_field(angle, y);
      mesh.coordinates.push_back({static_cast<float>(at.x()), static_cast<float>(at.y())});
    }
  }
  join_grid(mesh, static_cast<std::uint32_t>(rows + kBehind), 2 * kClothColumns + 1);
  compute_normals(mesh);
  return mesh;
}

RoomMesh lining_mesh(const RoomLayout& layout, const std::vector<Eigen::Vector3f>& skin) {
  constexpr std::uint32_t kColumns = 73;
  constexpr double kApart = 0.01;  // m between rows
  const SkinProfile profile(layout, skin);
  const double first = layout.trunk_y[0] - kLiningBeyond, length = layout.trunk_y[1] + kLiningBeyond - first;
  const auto rows = static_cast<std::uint32_t>(std::ceil(length / kApart)) + 1;
  RoomMesh mesh;
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t column = 0; column < kColumns; ++column) {
      const double y = first + length * row / (rows - 1);
      const double angle = kDrapeLeaves * (2.0 * column / (kColumns - 1) - 1);
      const SkinProfile::Place place = profile.at(angle, y);
      const Vector2d made_up = on_body(layout, body_at(y), std::abs(angle), -kLiningBelowSkin);
      const double share = place.inner - kLiningBelowSkin / layout.trunk_half.minCoeff();
      const Vector2d theirs =
          Vector2d(0, layout.trunk_centre.y()) +
          share * layout.trunk_half.cwiseProduct(Vector2d(std::sin(std::abs(angle)), std::cos(angle)));
      const Vector2d p = (1 - place.known) * made_up + place.known * theirs;
      mesh.positions.push_back(Vector3d(std::copysign(p.x(), angle), y, p.y()).cast<float>());
    }
  join_grid(mesh, rows, kColumns);
  compute_normals(mesh);
  return mesh;
}

std::vector<Eigen::Vector3f> cavity_rings(const RoomLayout& layout, const std::vector<Eigen::Vector3f>& skin,
                                          double below_skin, std::span<const double> along) {
  const SkinProfile profile(layout, skin);
  std::vector<Eigen::Vector3f> rings;
  for (const double y : along)
    for (std::size_t side = 0; side < kCavityRing; ++side) {
      const double angle = -2 * std::numbers::pi * static_cast<double>(side) / (kCavityRing - 1);
      const SkinProfile::Place place = profile.at(angle, y);
      const double size = 1 + place.known * (place.share - 1);
      const Vector3d on = layout.trunk_point(angle, y), centre(layout.trunk_centre.x(), y, layout.trunk_centre.y());
      const Vector3d p = centre + std::max(size - below_skin / layout.trunk_half.minCoeff(), 0.02) * (on - centre);
      rings.push_back(p.cast<float>());
    }
  return rings;
}

RoomMesh cavity_mesh(const RoomLayout& layout, const std::vector<Eigen::Vector3f>& skin) {
  constexpr std::uint32_t kRows = 17;
  std::vector<double> along;
  for (std::uint32_t row = 0; row < kRows; ++row)
    along.push_back(layout.trunk_y[0] + (layout.trunk_y[1] - layout.trunk_y[0]) * row / (kRows - 1));
  // The shapes differ within the grid's cells: deep enough to stay below cloth and skin.
  RoomMesh mesh;
  mesh.positions = cavity_rings(layout, skin, kBelowSkin, along);
  join_grid(mesh, kRows, kCavityRing);
  compute_normals(mesh);
  return mesh;
}

RoomMesh cut_mesh(const RoomLayout& layout, const std::vector<Eigen::Vector3f>& skin) {
  constexpr std::uint32_t kRings = 9;
  RoomMesh mesh;
  for (std::size_t end = 0; end < 2; ++end) {
    const double y = layout.trunk_y[end];
    const std::vector<Eigen::Vector3f> rim = cavity_rings(layout, skin, kCutBelowSkin, std::span(&y, 1));
    const Eigen::Vector3f middle = Vector3d(layout.trunk_centre.x(), y, layout.trunk_centre.y()).cast<float>();
    RoomMesh disc;
    for (std::uint32_t ring = 0; ring < kRings; ++ring) {
      const std::uint32_t outwards = end == 0 ? ring : kRings - 1 - ring;
      const float share = std::max(static_cast<float>(outwards) / (kRings - 1), 1e-3F);
      for (const Eigen::Vector3f& p : rim) disc.positions.push_back(middle + share * (p - middle));
    }
    join_grid(disc, kRings, kCavityRing);
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), disc.positions.begin(), disc.positions.end());
    for (const std::uint32_t index : disc.indices) mesh.indices.push_back(base + index);
  }
  compute_normals(mesh);
  return mesh;
}

}  // namespace stylet::render
