// Fast, random insertions into every shipped scenario, while the simulation stalls: is any surface missed?
#include "tools/bench/mechanics_parts.h"

#include "engine/readers/scenario.h"
#include "engine/session/coupled_loops.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace stylet::bench {
namespace {

using Eigen::Vector3d;

constexpr double kSimulationHz = 25;
constexpr double kStall = 0.060;  // s, one simulation step of each insertion is so late
constexpr double kRise = 0.020;   // s, a startled hand from rest to its speed
constexpr int kLate = 3;          // haptic steps after which a surface that is not felt is missed
constexpr double kLip = 4e-3;  // m; the same where the shaft goes through the body: the rim of where it has left it

constexpr double kAtRest = 1e-3;  // N of residual
constexpr int kMostSteps = 200;
constexpr double kBent = 0.02;  // rad, of the needle for good: then the next insertion takes another
const physics::StylusPose kAway{.position = {0, 0, 1}};

/// Boundary triangles of a body, by brute force: those that belong to one tetrahedron alone.
std::vector<std::array<int, 3>> boundary(const physics::TetMesh& mesh) {
  std::map<std::array<int, 3>, std::array<int, 4>> seen;  // sorted corners -> as seen from outside, times seen
  for (const auto& tet : mesh.tets) {
    for (int apex = 0; apex < 4; ++apex) {
      std::array<int, 3> face{};
      for (int k = 0, n = 0; k < 4; ++k) {
        if (k != apex) face[static_cast<std::size_t>(n++)] = tet[static_cast<std::size_t>(k)];
      }
      const Vector3d a = mesh.nodes[face[0]], b = mesh.nodes[face[1]], c = mesh.nodes[face[2]];
      if ((b - a).cross(c - a).dot(mesh.nodes[tet[static_cast<std::size_t>(apex)]] - a) > 0)
        std::swap(face[1], face[2]);
      std::array<int, 3> key = face;
      std::sort(key.begin(), key.end());
      auto& entry = seen[key];
      entry = {face[0], face[1], face[2], entry[3] + 1};
    }
  }
  std::vector<std::array<int, 3>> faces;
  for (const auto& [key, face] : seen) {
    if (face[3] == 1) faces.push_back({face[0], face[1], face[2]});
  }
  return faces;
}

/// Signed crossings of a segment with all triangles of a body: +1 in, -1 out.
int crossings(const std::vector<std::array<int, 3>>& faces, const Eigen::Matrix3Xd& x, const Vector3d& from,
              const Vector3d& to) {
  const auto volume = [](const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
    return (b - a).cross(c - a).dot(d - a);
  };
  const Vector3d low = from.cwiseMin(to), high = from.cwiseMax(to);
  int sum = 0;
  for (const auto& face : faces) {
    const Vector3d a = x.col(face[0]), b = x.col(face[1]), c = x.col(face[2]);
    if ((a.cwiseMax(b).cwiseMax(c).array() < low.array()).any()) continue;
    if ((a.cwiseMin(b).cwiseMin(c).array() > high.array()).any()) continue;
    const double s = volume(a, b, c, from), t = volume(a, b, c, to);  // > 0: outside, beyond the outward side
    if ((s > 0) == (t > 0)) continue;
    const double u = volume(from, to, a, b), v = volume(from, to, b, c), w = volume(from, to, c, a);
    if ((u > 0) != (v > 0) || (v > 0) != (w > 0)) continue;
    sum += s > 0 ? 1 : -1;
  }
  return sum;
}

/// What the insertions of a scenario came to.
struct Tally {
  int insertions = 0, surfaces = 0, missed = 0, late = 0, left_unfelt = 0;
  int unknown_steps = 0, steps = 0, bent = 0;
  double deepest = 0;  // m gone beyond a surface that was not felt, with no other body round the tip
};

class FastInsertions {
public:
  FastInsertions(content::Scene& scene, std::uint64_t seed)
      : scene_(with_rate(scene)),
        random_(seed),
        loops_(fresh()),
        patch_(loops_->make_patch()),
        nothing_(loops_->make_patch()) {
    for (const content::DeformableBody& body : scene_.bodies) faces_.push_back(boundary(body.mesh));
    come_to_rest();
  }

  void insert(Tally& tally) {
    // A needle that has been bent points elsewhere than the hand goes.
    if (loops_->needle().damage.bend > kBent) {
      ++tally.bent;
      hub_ = kAway;
      loops_ = fresh();
      come_to_rest();
    }
    const auto [aim, axis] = choose_aim();
    const double before = uniform(0.002, 0.040);
    const double travel = before + uniform(0.020, 0.080);
    const double speed = uniform(0.2, 0.999);
    const double aside = uniform(0, 0.3);
    const Vector3d across = Eigen::AngleAxisd(uniform(0, 2 * std::numbers::pi), axis) * axis.unitOrthogonal();
    const Vector3d way = (axis + aside * across).normalized();
    go_through_air(aim - before * axis, axis);
    come_to_rest();

    const int period = static_cast<int>(std::lround(1 / (kSimulationHz * loops_->haptic_dt())));
    const int stalled = static_cast<int>(uniform(0, 4));
    int next = static_cast<int>(uniform(0, period));  // when the hand starts is as it comes
    int step_of_simulation = 0;
    double gone = 0;
    begin_watch();
    ++tally.insertions;
    for (int step = 0; gone < travel; ++step) {
      if (step == next) {
        simulate();
        next += period + (++step_of_simulation == stalled ? static_cast<int>(kStall / loops_->haptic_dt()) : 0);
      }
      const double t = step * loops_->haptic_dt();
      const double advance = speed * std::min(1.0, t / kRise) * loops_->haptic_dt();
      gone += advance;
      hub_.position += advance * way;
      watch(haptic(patch_), tally);
    }
  }

private:
  static content::Scene& with_rate(content::Scene& scene) {
    scene.rates.simulation_hz = kSimulationHz;
    scene.breathing.amplitude = 0;
    return scene;
  }

  std::unique_ptr<session::CoupledLoops> fresh() const {
    return std::make_unique<session::CoupledLoops>(scene_, session::coupling_from_name(scene_.coupling), hub_,
                                                   std::vector<session::StepListener*>{});
  }

  double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }

  /// As a session in lockstep does: a factor asked for in one step is there for the next.
  double simulate() {
    const auto report = loops_->simulation_step(time_s_, loops_->needle(), true, true, patch_);
    loops_->worker().step();
    time_s_ += 1 / kSimulationHz;
    return report.residual_n;
  }

  /// A patch says where tissue goes to, and brute force knows where it is: an insertion begins where that is the
  /// same.
  void come_to_rest() {
    for (int step = 0; step < kMostSteps && simulate() > kAtRest; ++step) {
    }
  }

  const physics::NeedleState& haptic(const physics::TissuePatch& patch) {
    return loops_->haptic_step(
        {.time_s = time_s_, .position = hub_.position, .orientation = hub_.orientation, .valid = true}, patch);
  }

  /// A point of the skin and a way in, up to 50 degrees off its normal, with nothing before it.
  std::pair<Vector3d, Vector3d> choose_aim() {
    const Eigen::Matrix3Xd& x = loops_->tissue().positions[0];
    while (true) {
      const auto& face = faces_[0][std::uniform_int_distribution<std::size_t>(0, faces_[0].size() - 1)(random_)];
      const double u = uniform(0, 1), v = uniform(0, 1);
      const Vector3d a = x.col(face[0]), b = x.col(face[1]), c = x.col(face[2]);
      const Vector3d aim =
          u + v < 1 ? Vector3d(a + u * (b - a) + v * (c - a)) : Vector3d(a + (1 - u) * (b - a) + (1 - v) * (c - a));
      const Vector3d normal = (b - a).cross(c - a).normalized();
      const double slant = uniform(0, 50) * std::numbers::pi / 180;
      const Vector3d across = Eigen::AngleAxisd(uniform(0, 2 * std::numbers::pi), normal) * normal.unitOrthogonal();
      const Vector3d axis = -(std::cos(slant) * normal + std::sin(slant) * across);
      bool free = true;
      for (std::size_t body = 0; body < faces_.size(); ++body) {
        const Eigen::Matrix3Xd& at = loops_->tissue().positions[body];
        const Vector3d from = aim - 1e-6 * axis;
        for (double s = 0; s < 0.2; s += 0.02) {
          free = free && crossings(faces_[body], at, from - (s + 0.02) * axis, from - s * axis) == 0;
        }
      }
      if (free) return {aim, axis};
    }
  }

  /// Without tissue: the needle forgets its track, and goes where it likes.
  void go_through_air(const Vector3d& tip, const Vector3d& axis) {
    const Eigen::Quaterniond orientation = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), axis);
    hub_ = {tip - scene_.needle.length * axis, orientation};
    const auto there = [&] {
      const physics::NeedleState& needle = loops_->needle();
      return (needle.positions.col(needle.node_count - 1) - tip).norm() < 1e-7;
    };
    for (int step = 0; step < 5000 && !there(); ++step) haptic(nothing_);
  }

  struct Crossing {
    int body = 0;
    bool again = false;  // the shaft goes through the body already
    int steps = 0;       // since, in which the tip was in no body
    double beyond = 0;   // m gone in these
  };

  void begin_watch() {
    const physics::NeedleState& needle = loops_->needle();
    tip_ = needle.positions.col(needle.node_count - 1);
    open_.clear();
  }

  void watch(const physics::NeedleState& needle, Tally& tally) {
    const Vector3d tip = needle.positions.col(needle.node_count - 1);
    const bool known = (needle.flags & (physics::kNeedlePatchLeft | physics::kNeedleSurfaceLate)) == 0;
    ++tally.steps;
    tally.unknown_steps += known ? 0 : 1;
    for (int body = 0; body < static_cast<int>(faces_.size()); ++body) {
      const int sum = crossings(faces_[static_cast<std::size_t>(body)],
                                loops_->tissue().positions[static_cast<std::size_t>(body)], tip_, tip);
      const bool felt = needle.tip != physics::TipState::outside && needle.tip_body == body;
      const auto same = std::find_if(open_.begin(), open_.end(), [&](const Crossing& c) { return c.body == body; });
      if (sum > 0 && same == open_.end()) {
        ++tally.surfaces;
        const auto there = std::span(needle.contacts).first(static_cast<std::size_t>(needle.contact_count));
        const bool again = std::ranges::any_of(there, [&](const auto& contact) { return contact.body == body; });
        if (!felt) open_.push_back({.body = body, .again = again});
      } else if (same != open_.end() && felt) {
        open_.erase(same);
      } else if (same != open_.end() && sum < 0) {
        ++tally.left_unfelt;
        open_.erase(same);
      }
    }
    for (auto it = open_.begin(); it != open_.end();) {
      // In the track through another body it is felt when that ends.
      if (needle.tip == physics::TipState::outside) {
        ++it->steps;
        it->beyond += (tip - tip_).norm();
        if (!it->again) tally.deepest = std::max(tally.deepest, it->beyond);
      }
      if (it->again ? it->beyond > kLip : it->steps > kLate) {
        ++tally.missed;
        it = open_.erase(it);
      } else {
        ++it;
      }
    }
    if ((needle.flags & physics::kNeedleSurfaceLate) != 0) ++tally.late;
    tip_ = tip;
  }

  content::Scene& scene_;
  std::mt19937_64 random_;
  physics::StylusPose hub_ = kAway;
  std::unique_ptr<session::CoupledLoops> loops_;
  physics::TissuePatch patch_, nothing_;
  std::vector<std::vector<std::array<int, 3>>> faces_;
  double time_s_ = 0;
  Vector3d tip_ = Vector3d::Zero();
  std::vector<Crossing> open_;
};

}  // namespace

Report mechanics_swept(const BenchOptions& options) {
  const int per_scenario = options.quick ? 5 : 125;
  std::uint64_t seed = 23;
  Tally all;
  Report report;
  for (const readers::ScenarioEntry& entry : readers::list_scenarios(readers::content_directory() / "scenarios")) {
    if (entry.name == "liver_biopsy_fine") continue;  // the patient of liver_biopsy, in small tetrahedra
    content::Scene scene = readers::load_scene(entry.path);
    FastInsertions insertions(scene, ++seed);
    Tally tally;
    for (int i = 0; i < per_scenario; ++i) insertions.insert(tally);
    std::fprintf(stderr,
                 "  %s: %d insertions, %d needles bent, %d surfaces, %d missed, %d late, %d left unfelt, %d of %d "
                 "steps beyond "
                 "the patch, %.2f mm untouched\n",
                 entry.name.c_str(), tally.insertions, tally.bent, tally.surfaces, tally.missed, tally.late,
                 tally.left_unfelt, tally.unknown_steps, tally.steps, 1e3 * tally.deepest);
    all.insertions += tally.insertions;
    all.surfaces += tally.surfaces;
    all.missed += tally.missed;
    all.late += tally.late;
    all.bent += tally.bent;
    all.left_unfelt += tally.left_unfelt;
    all.unknown_steps += tally.unknown_steps;
    all.steps += tally.steps;
    all.deepest = std::max(all.deepest, tally.deepest);
  }
  report.add(at_least("swept.insertions", all.insertions, "1", options.quick ? 20 : 500));
  report.add(noted({.name = "swept.bent", .value = static_cast<double>(all.bent), .unit = "1"},
                   "insertions that bent the needle for good; the next had another"));
  report.add({.name = "swept.surfaces", .value = static_cast<double>(all.surfaces), .unit = "1"});
  report.add(noted(at_most("swept.missed", all.missed, "1", 0),
                   "crossed by the tip, brute force over all triangles, and not pressed on within 3 ms"));
  report.add({.name = "swept.untouched", .value = 1e3 * all.deepest, .unit = "mm"});
  report.add({.name = "swept.late", .value = static_cast<double>(all.late), .unit = "1"});
  report.add({.name = "swept.left_unfelt", .value = static_cast<double>(all.left_unfelt), .unit = "1"});
  report.add(
      {.name = "swept.beyond_patch", .value = 100.0 * all.unknown_steps / std::max(1, all.steps), .unit = "%"});
  return report;
}

}  // namespace stylet::bench
