#include "engine/import/site_search.h"

#include "engine/content/probe_placement.h"
#include "engine/readers/label_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

namespace stylet::import {
namespace {

using Eigen::Vector3d;

constexpr double kCell = 0.0025;             // m
constexpr double kMostCells = 12e6;          // the cells grow until they fit
constexpr double kAround = 0.14;             // m about the target that is looked at
constexpr double kSkinApart = 0.007;         // m between places on the skin
constexpr double kOffCut = 0.020;            // m between the wall's depth round an entry and the end of the scan
constexpr double kWayStep = 0.002;           // m along a way
constexpr double kReach = 0.105;             // m: longer ways are too long for most needles
constexpr double kKeepOff = 0.006;           // m between a needle and what is spared
constexpr double kSteepest = 0.55;           // cosine between needle and skin's normal
constexpr double kAlongBody = 0.80;          // cosine between needle and the body's axis: a hand has no room there
constexpr double kLying = -0.2;              // z of the skin's normal: below, the patient lies on it
constexpr double kGoodDepth = 0.065;         // m below the skin, of a lesion that is made up
constexpr double kBallClear = 0.006;         // m between it and what is about it
constexpr double kBallApart = 0.008;         // m between the places tried for it
constexpr double kBallsApart = 0.016;        // m between those of them for which a probe is tried
constexpr std::size_t kBallsTried = 40;      // the best by their needle's way
constexpr std::array kBeside{0.040, 0.068};  // m between entry and probe: its face, and a hand's room beside it
constexpr double kFarAway = 1.0;             // m
constexpr double kWayDegree = std::numbers::pi / 180;
// What outweighs the length of any way, so that it is chosen only where there is nothing else.
constexpr double kThroughHard = 300;    // a mm of bone or air
constexpr double kThroughSpared = 150;  // a mm of what bleeds or leaks
constexpr double kAlongBeam = 30;       // a degree too close to the beam
constexpr double kOffSkin = 30;         // a degree that the probe's face is tilted off the skin
constexpr double kFlatEnough = 18;      // degrees: from here on
constexpr double kSkids = 200;          // what the cosine between needle and capsule's normal lacks of kSquare
constexpr double kSquare = 0.75;
constexpr double kCapsule = 0.008;  // m: so far behind it, its distance tells how square the needle goes in
constexpr double kShadowed = 60;    // each of kLines of the face
constexpr int kLines = 5;

}  // namespace

SiteSearch::SiteSearch(std::span<const SiteOrgan> organs, const Body& body, const SideWall& wall,
                       const content::Probe& probe, const Eigen::AlignedBox3d& around, std::function<void()> pulse)
    : body_(body), wall_(wall), probe_(probe), pulse_(std::move(pulse)) {
  const Eigen::AlignedBox3d near(around.min().array() - kAround, around.max().array() + kAround);
  const Eigen::AlignedBox3d box = near.intersection(body.solid().bounds());
  double cell = kCell;
  for (;; cell *= 1.1) {
    grid_.size = ((box.sizes() / cell).array().ceil() + 1).cast<int>().max(2);
    if (grid_.size.cast<double>().prod() <= kMostCells) break;
  }
  grid_.spacing = static_cast<float>(cell);
  grid_.origin = box.min().cast<float>();
  const auto nx = static_cast<std::size_t>(grid_.size.x());
  kinds_.assign(nx * static_cast<std::size_t>(grid_.size.y()) * static_cast<std::size_t>(grid_.size.z()),
                SiteKind::free);
  for (const SiteOrgan& organ : organs) {
    pulse_();
    const auto crossings = readers::row_crossings(*organ.surface, grid_);
    for (std::size_t c = 0; c + 1 < crossings.size();) {
      if (crossings[c].row != crossings[c + 1].row) {
        ++c;
        continue;
      }
      const auto index = [&](float x) {
        const double i = std::ceil((static_cast<double>(x) - grid_.origin.x()) / grid_.spacing);
        return static_cast<std::ptrdiff_t>(std::clamp(i, 0.0, static_cast<double>(nx)));
      };
      const auto row = kinds_.begin() + static_cast<std::ptrdiff_t>(crossings[c].row * nx);
      std::fill(row + index(crossings[c].x), row + index(crossings[c + 1].x), organ.kind);
      c += 2;
    }
  }
  clear_ = distance_to(
      [](SiteKind kind) { return kind == SiteKind::spared || kind == SiteKind::air || kind == SiteKind::hard; });
  deep_ = distance_to([](SiteKind kind) { return kind != SiteKind::carrier; });

  std::set<std::array<int, 3>> taken;
  for (const Vector3d& v : body.solid().surface().vertices) {
    if (!near.contains(v)) continue;
    const double off = wall.depth + kOffCut;
    if (std::ranges::any_of(body.cuts(), [&](const ScanCut& cut) { return cut.beyond(v) > -off; })) continue;
    const Eigen::Array3i place = (v / kSkinApart).array().floor().cast<int>();
    if (!taken.insert({place.x(), place.y(), place.z()}).second) continue;
    const mesh::Solid::Nearest on = body.on_skin(v);
    if (on.normal.z() < kLying) continue;
    skin_.push_back({on.point, on.normal});
  }
}

std::optional<std::size_t> SiteSearch::cell_of(const Vector3d& x) const {
  const Eigen::Array3i i =
      ((x - grid_.origin.cast<double>()) / static_cast<double>(grid_.spacing)).array().round().cast<int>();
  if ((i < 0).any() || (i >= grid_.size.array()).any()) return {};
  return static_cast<std::size_t>(i.x()) +
         static_cast<std::size_t>(grid_.size.x()) *
             (static_cast<std::size_t>(i.y()) +
              static_cast<std::size_t>(grid_.size.y()) * static_cast<std::size_t>(i.z()));
}

SiteKind SiteSearch::kind_at(const Vector3d& x) const {
  const auto cell = cell_of(x);
  return cell ? kinds_[*cell] : SiteKind::free;
}

double SiteSearch::clear_at(const Vector3d& x) const {
  const auto cell = cell_of(x);
  return cell ? static_cast<double>(clear_[*cell]) : kFarAway;
}

double SiteSearch::deep_at(const Vector3d& x) const {
  const auto cell = cell_of(x);
  return cell ? static_cast<double>(deep_[*cell]) : 0;
}

/// Chamfer distance over the 26 neighbours, two sweeps: a few per cent long. Not carried over the rim.
std::vector<float> SiteSearch::distance_to(const std::function<bool(SiteKind)>& is) const {
  const Eigen::Vector3i n = grid_.size;
  const std::array<std::ptrdiff_t, 3> stride{1, n.x(), static_cast<std::ptrdiff_t>(n.x()) * n.y()};
  std::vector<float> distance(kinds_.size(), static_cast<float>(kFarAway));
  for (std::size_t i = 0; i < kinds_.size(); ++i) {
    if (is(kinds_[i])) distance[i] = 0;
  }
  const auto sweep = [&](int way) {
    for (int c = 0; c < n.z(); ++c) {
      pulse_();
      const int k = way > 0 ? c : n.z() - 1 - c;
      for (int b = 0; b < n.y(); ++b) {
        const int j = way > 0 ? b : n.y() - 1 - b;
        for (int a = 0; a < n.x(); ++a) {
          const int i = way > 0 ? a : n.x() - 1 - a;
          const std::ptrdiff_t here = i + j * stride[1] + k * stride[2];
          float& least = distance[static_cast<std::size_t>(here)];
          if (least == 0) continue;
          for (int dk = -1; dk <= 0; ++dk) {
            for (int dj = -1; dj <= (dk < 0 ? 1 : 0); ++dj) {
              for (int di = -1; di <= (dk < 0 || dj < 0 ? 1 : -1); ++di) {
                const Eigen::Vector3i v(i + way * di, j + way * dj, k + way * dk);
                if ((v.array() < 0).any() || (v.array() >= n.array()).any()) continue;
                const float step = grid_.spacing * std::sqrt(static_cast<float>(di * di + dj * dj + dk * dk));
                least = std::min(
                    least, step + distance[static_cast<std::size_t>(v.x() + v.y() * stride[1] + v.z() * stride[2])]);
              }
            }
          }
        }
      }
    }
  };
  sweep(1);
  sweep(-1);
  return distance;
}

/// Millimetres; infinite where no hand would go in.
double SiteSearch::way_cost(const Skin& entry, const Vector3d& target) const {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const double length = (target - entry.point).norm();
  const Vector3d along = (target - entry.point) / length;
  const double flat = -along.dot(entry.normal);
  if (length < 0.015 || flat < kSteepest || std::abs(along.y()) > kAlongBody) return kNever;
  double cost = 1e3 * length + 5e3 * std::max(0.0, length - kReach) + 60 * (1 - flat);
  bool inside = false;
  for (double s = 0; s < length; s += kWayStep) {
    const Vector3d x = entry.point + s * along;
    const SiteKind kind = kind_at(x);
    if (kind == SiteKind::carrier && !inside) {
      // Along an organ's surface a needle skids and pushes it away.
      inside = true;
      const Vector3d behind = x + std::min(kCapsule, length - s) * along;
      cost += kSkids * std::max(0.0, kSquare - deep_at(behind) / (behind - x).norm());
    }
    const double mm = 1e3 * kWayStep;
    if (kind == SiteKind::hard || kind == SiteKind::air) cost += kThroughHard * mm;
    if (kind == SiteKind::spared) cost += kThroughSpared * mm;
    cost += 2 * mm * std::max(0.0, 1 - clear_at(x) / kKeepOff);
  }
  return cost;
}

/// Millimetres; infinite where the probe would not see the needle. Not worked out further from `most` on.
double SiteSearch::view_cost(const Skin& probe, const Vector3d& entry, const Vector3d& target, double most) const {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const Vector3d to_seen = (target - probe.point).normalized();
  if ((entry - probe.point).normalized().cross(to_seen).norm() < 0.3) return kNever;
  content::Probe held = probe_;
  held.pose = content::probe_on_skin(probe.point, probe.normal, target, entry);
  const double between = content::angle_to_beam(held, target, target - entry) / kWayDegree;
  const double tilt =
      std::acos(std::clamp(-(held.pose.orientation * Vector3d::UnitZ()).dot(probe.normal), -1.0, 1.0)) / kWayDegree;
  double cost = 0.3e3 * (target - probe.point).norm() + 3 * std::max(0.0, tilt - 8) +
                kOffSkin * std::max(0.0, tilt - kFlatEnough) +
                kAlongBeam * std::max(0.0, kLeastToBeam / kWayDegree - between) + 2 * std::max(0.0, between - 75);
  if (cost >= most) return cost;
  for (int i = 0; i < kLines; ++i) {  // half as wide as the face
    const Vector3d from = probe.point + 0.010 * (i - kLines / 2) * (held.pose.orientation * Vector3d::UnitX());
    const Vector3d way = target - from;
    for (double s = 0.004; s < way.norm(); s += kWayStep) {
      const SiteKind kind = kind_at(from + s * way.normalized());
      if (kind != SiteKind::hard && kind != SiteKind::air) continue;
      cost += kShadowed;
      break;
    }
  }
  return cost;
}

std::optional<Vector3d> SiteSearch::ball(double radius) const {
  // Beside a way's own length, which is no matter here.
  const auto off_depth = [](const Vector3d& x, const Vector3d& entry) {
    const double length = (x - entry).norm();
    return 2e3 * std::abs(length - kGoodDepth) - 1e3 * length;
  };
  std::vector<Skin> some;
  std::set<std::array<int, 3>> taken;
  for (const Skin& skin : skin_) {
    const Eigen::Array3i place = (skin.point / (2 * kSkinApart)).array().floor().cast<int>();
    if (taken.insert({place.x(), place.y(), place.z()}).second) some.push_back(skin);
  }
  const int apart = std::max(1, static_cast<int>(std::lround(kBallApart / static_cast<double>(grid_.spacing))));
  for (const double clear : {kBallClear, 0.002, 0.0}) {
    std::vector<std::pair<double, Vector3d>> places;  // with what the needle's way costs
    for (int k = 0; k < grid_.size.z(); k += apart) {
      pulse_();
      for (int j = 0; j < grid_.size.y(); j += apart) {
        for (int i = 0; i < grid_.size.x(); i += apart) {
          const Vector3d x = grid_.origin.cast<double>() + static_cast<double>(grid_.spacing) * Vector3d(i, j, k);
          const std::size_t cell = *cell_of(x);
          const double off = radius + clear;
          if (static_cast<double>(deep_[cell]) < off || static_cast<double>(clear_[cell]) < off) continue;
          if (std::ranges::any_of(body_.cuts(), [&](const ScanCut& cut) { return cut.beyond(x) > -2 * off; }))
            continue;
          double least = std::numeric_limits<double>::infinity();
          for (const Skin& skin : some) {
            const double depth = off_depth(x, skin.point);
            // A way costs its length at least.
            if (depth + 1e3 * (x - skin.point).norm() < least) least = std::min(least, way_cost(skin, x) + depth);
          }
          if (std::isfinite(least)) places.emplace_back(least, x);
        }
      }
    }
    std::ranges::stable_sort(places, {}, [](const auto& each) { return each.first; });
    std::vector<Vector3d> tried;
    std::optional<Vector3d> best;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& place : places) {
      const double way = place.first;
      const Vector3d& x = place.second;
      if (tried.size() == kBallsTried || way >= least) break;
      if (std::ranges::any_of(tried, [&](const Vector3d& other) { return (x - other).norm() < kBallsApart; }))
        continue;
      tried.push_back(x);
      const auto found = sites(x, {});
      if (!found) continue;
      const double cost = found->cost + off_depth(x, found->entry);
      if (cost >= least) continue;
      least = cost;
      best = x;
    }
    if (best) return best;
  }
  return {};
}

std::optional<SiteSearch::Sites> SiteSearch::sites(const Vector3d& target,
                                                   const std::optional<Vector3d>& entry) const {
  std::vector<std::pair<double, Skin>> entries;
  if (entry) {
    const mesh::Solid::Nearest on = body_.on_skin(*entry);
    entries.push_back({0, {on.point, on.normal}});
  }
  for (const Skin& skin : skin_) {
    if (entry) break;
    if (field_distance(wall_, skin.point, body_.cuts(), skin.point) > -wall_.depth) continue;
    const double cost = way_cost(skin, target);
    if (std::isfinite(cost)) entries.emplace_back(cost, skin);
  }
  std::ranges::stable_sort(entries, {}, [](const auto& each) { return each.first; });
  std::optional<Sites> best;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [cost, from] : entries) {
    if (cost >= least) break;
    pulse_();
    for (const Skin& skin : skin_) {
      const double apart = (skin.point - from.point).norm();
      if (apart < kBeside[0] || apart > kBeside[1]) continue;
      if (field_distance(wall_, from.point, body_.cuts(), skin.point) > -0.015) continue;
      const double all = cost + view_cost(skin, from.point, target, least - cost);
      if (all >= least) continue;
      least = all;
      best = {.entry = from.point, .probe = skin.point, .cost = all};
    }
  }
  return best;
}

}  // namespace stylet::import
