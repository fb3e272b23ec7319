#include "engine/session/start_pose.h"

#include "engine/session/coupled_loops.h"
#include "engine/session/random_stream.h"

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

namespace stylet::session {
namespace {

constexpr int kTries = 64;

enum StartPart : std::uint64_t { kStartTip, kStartAim, kStartProbe };

/// Even over a ring.
Eigen::Vector2d in_ring(RandomStream& random, double least, double most) {
  const double angle = random.uniform(0, 2 * std::numbers::pi);
  const double radius = std::sqrt(random.uniform(least * least, most * most));
  return radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
}

content::ProbeMove drawn_probe(const content::Scene& scene, std::uint32_t seed) {
  const content::StartSpread& spread = scene.start;
  const physics::RigidPose held = probe_pose(scene, 0);
  for (int i = 0; i < kTries; ++i) {
    RandomStream random(seed, static_cast<std::uint64_t>(i), kStartProbe);
    const Eigen::Vector2d slide = in_ring(random, spread.probe_off.x(), spread.probe_off.y());
    const content::ProbeMove move{
        .lateral = slide.x(), .elevation = slide.y(), .twist = random.within(spread.probe_turned)};
    if (content::moved_on_skin(held, scene.labels, move)) return move;
  }
  return {};
}

}  // namespace

StartPose start_of(const content::Scene& scene) {
  StartPose start;
  start.hub = scene.motion.stylus.front().pose;
  start.tip = start.hub.position + start.hub.orientation * Eigen::Vector3d(0, 0, scene.needle.length);
  start.aim = scene.targets.front().centre;
  return start;
}

StartPose drawn_start(const content::Scene& scene, std::uint32_t seed) {
  StartPose start = start_of(scene);
  start.seed = seed;
  const content::StartSpread& spread = scene.start;
  const Eigen::Vector3d planned = (start.aim - start.tip).normalized();
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = planned.unitOrthogonal();
  across.col(1) = planned.cross(across.col(0));
  RandomStream entry(seed, 0, kStartTip), aim(seed, 0, kStartAim);
  start.tip += across * in_ring(entry, 0, spread.entry_off);
  start.aim += across * in_ring(aim, spread.aim_off.x(), spread.aim_off.y());
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(planned, start.aim - start.tip);
  start.hub.orientation = (turn * start.hub.orientation).normalized();
  start.hub.position = start.tip - start.hub.orientation * Eigen::Vector3d(0, 0, scene.needle.length);
  if (spread.probe_off.y() > 0 || spread.probe_turned > 0) start.probe = drawn_probe(scene, seed);
  return start;
}

}  // namespace stylet::session
