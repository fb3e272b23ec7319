#include "engine/session/random_frame.h"

#include "engine/content/tissue_locator.h"
#include "engine/files/error.h"
#include "engine/readers/motion.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/frame_publisher.h"
#include "engine/session/lockstep.h"
#include "engine/session/random_stream.h"
#include "haptic/recorded_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::session {
namespace {

// What of a frame a stream is for: a new kind of drawing leaves the others as they were.
enum Part : std::uint64_t { kProbe, kNeedle, kTissue, kBreath, kSpeckle };

constexpr int kAttempts = 200;        // to place the probe on the skin
constexpr double kNeedleSpeed = 0.1;  // m/s; a quick hand: what cutting takes more by it is gone once it stops
constexpr double kTurnSpeed = 1.0;    // rad/s
constexpr double kApproach = 0.020;   // m of way outside the patient, for the probe's press and the breath
constexpr double kSettle = 0.35;      // s of rest before and after the needle's way

double radians(double degrees) {
  return degrees * std::numbers::pi / 180;
}

Eigen::Vector3d tip(const content::Scene& scene, const content::MotionSample& hub) {
  return hub.pose.position + hub.pose.orientation * Eigen::Vector3d(0, 0, scene.needle.length);
}

bool in_patient(const content::LabelVolume& labels, const Eigen::Vector3d& point) {
  const Eigen::Vector3d grid = (point - labels.origin.cast<double>()) / labels.spacing;
  const Eigen::Array3d nearest = (grid.array() + 0.5).floor();
  if ((nearest < 0).any() || (nearest >= labels.size.cast<double>().array()).any()) return false;
  const Eigen::Matrix<std::size_t, 3, 1> v = nearest.cast<std::size_t>();
  const auto nx = static_cast<std::size_t>(labels.size.x());
  const auto ny = static_cast<std::size_t>(labels.size.y());
  return labels.labels[(v.z() * ny + v.y()) * nx + v.x()] != 0;
}

/// First sample of a way whose tip is in the patient at rest; its size where none is.
std::size_t first_inside(const content::Scene& scene, const std::vector<content::MotionSample>& way) {
  std::size_t i = 0;
  while (i < way.size() && !in_patient(scene.labels, tip(scene, way[i]))) ++i;
  return i;
}

/// Rigid motion that shifts the way across itself and turns it about where it enters.
Eigen::Isometry3d needle_move(const content::Scene& scene, const std::vector<content::MotionSample>& way,
                              const RandomRanges& ranges, RandomStream& random) {
  const content::MotionSample& entry = way[std::min(first_inside(scene, way), way.size() - 1)];
  const Eigen::Matrix3d axes = entry.pose.orientation.toRotationMatrix();
  const double shift = ranges.needle_shift_mm * 1e-3;
  const Eigen::Vector3d across = random.within(shift) * axes.col(0) + random.within(shift) * axes.col(1);
  const double angle = random.within(radians(ranges.needle_tilt_deg));
  const double about = random.uniform(0, std::numbers::pi);
  const Eigen::Vector3d axis = std::cos(about) * axes.col(0) + std::sin(about) * axes.col(1);
  const Eigen::Vector3d pivot = tip(scene, entry);
  return Eigen::Translation3d(pivot + across) * Eigen::AngleAxisd(angle, axis) * Eigen::Translation3d(-pivot);
}

/// The way up to a moment, moved, from a little outside the patient on, at an even speed.
std::vector<content::MotionSample> needle_way(const content::Scene& scene, const Eigen::Isometry3d& move,
                                              double motion_s) {
  std::vector<content::MotionSample> way;
  for (const content::MotionSample& sample : scene.motion.stylus) {
    if (sample.time_s < motion_s) way.push_back(sample);
  }
  way.push_back(readers::sample_motion(scene.motion.stylus, motion_s));
  const Eigen::Quaterniond turn(move.linear());
  for (content::MotionSample& sample : way) {
    sample.pose.position = move * sample.pose.position;
    sample.pose.orientation = (turn * sample.pose.orientation).normalized();
  }
  const std::size_t inside = first_inside(scene, way);
  std::size_t start = std::min(inside, way.size() - 1);
  if (inside < way.size()) {
    const Eigen::Vector3d entry = tip(scene, way[inside]);
    while (start > 0 && (tip(scene, way[start]) - entry).norm() < kApproach) --start;
  }
  way.erase(way.begin(), way.begin() + static_cast<std::ptrdiff_t>(start));
  double time_s = kSettle;
  std::vector<content::MotionSample> even{way.front()};
  even.front().time_s = time_s;
  for (const content::MotionSample& sample : way) {
    const content::MotionSample& last = even.back();
    const double length = (sample.pose.position - last.pose.position).norm();
    const double angle = sample.pose.orientation.angularDistance(last.pose.orientation);
    const double duration = std::max(length / kNeedleSpeed, angle / kTurnSpeed);
    if (duration < 1e-3 && &sample != &way.back()) continue;  // pauses, and steps finer than the loop's
    time_s += std::max(duration, 1e-4);
    even.push_back(sample);
    even.back().time_s = time_s;
  }
  return even;
}

content::ProbeMove draw_move(const RandomRanges& ranges, RandomStream& random) {
  content::ProbeMove move;
  move.lateral = random.within(ranges.slide_mm * 1e-3);
  move.elevation = random.within(ranges.slide_across_mm * 1e-3);
  move.press = random.within(ranges.press_mm * 1e-3);
  move.tilt = random.within(radians(ranges.tilt_deg));
  move.rock = random.within(radians(ranges.rock_deg));
  move.twist = random.within(radians(ranges.twist_deg));
  return move;
}

void place_probe(const content::Scene& scene, const RandomRanges& ranges, RandomStream random, RandomFrame& frame) {
  const physics::RigidPose base = probe_pose(scene, frame.motion_s);
  content::Probe probe = scene.probe;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    frame.move = draw_move(ranges, random);
    const auto pose = content::moved_on_skin(base, scene.labels, frame.move);
    if (!pose) continue;
    probe.pose = *pose;
    if (!content::odd_probe_placement(probe, scene.labels).empty()) continue;
    frame.probe = *pose;
    return;
  }
  throw files::ContentError(
      fmt::format("{}: none of {} random poses of the probe lies on the skin; make the slides and turns smaller",
                  scene.scenario.string(), kAttempts));
}

}  // namespace

RandomFrame draw_random_frame(const content::Scene& scene, const RandomRanges& ranges, std::uint64_t seed,
                              std::uint64_t index) {
  if (scene.motion.stylus.empty()) {
    throw files::ContentError(scene.scenario.string() +
                              ": names no motion; random frames take the needle's way from it");
  }
  RandomFrame frame;
  RandomStream needle(seed, index, kNeedle);
  frame.motion_s = needle.uniform(ranges.from_s, ranges.to_s);
  frame.needle_move = needle_move(scene, scene.motion.stylus, ranges, needle);
  frame.way = needle_way(scene, frame.needle_move, frame.motion_s);
  place_probe(scene, ranges, RandomStream(seed, index, kProbe), frame);

  // A breath at a random phase, as often at each depth as breathing itself is (Lujan's sin^4).
  const double s = std::sin(RandomStream(seed, index, kBreath).uniform(0, std::numbers::pi));
  frame.inspiration = s * s * s * s;

  RandomStream tissue(seed, index, kTissue);
  for (std::size_t i = 0; i < scene.tissues.size(); ++i) {
    content::Acoustics acoustics = scene.tissues[i].acoustics;
    const double attenuation = tissue.within(ranges.attenuation_share);
    const double backscatter = tissue.within(ranges.backscatter_db);
    const double impedance = tissue.within(ranges.impedance_share);
    const double texture = tissue.within(ranges.texture_share);
    if (i > 0 && !content::is_bone(scene.tissues[i])) {
      acoustics.attenuation_db_per_cm_mhz *= 1 + attenuation;
      acoustics.backscatter_db += backscatter;
      acoustics.impedance_rayl *= 1 + impedance;
      acoustics.texture_db *= 1 + texture;
    }
    frame.tissues.push_back(acoustics);
  }
  frame.seed = static_cast<std::uint32_t>(RandomStream(seed, index, kSpeckle).next() >> 32);
  return frame;
}

void apply_frame(content::Scene& scene, const RandomFrame& frame) {
  scene.probe.pose = frame.probe;
  scene.motion.probe.clear();
  scene.breathing.drawn_once = frame.inspiration;
  for (std::size_t i = 0; i < scene.tissues.size(); ++i) scene.tissues[i].acoustics = frame.tissues[i];
}

SettledFrame settle(const content::Scene& scene, physics::Coupling coupling, const RandomFrame& frame,
                    const std::function<void(double share)>& progress) {
  std::vector<haptic::StylusSample> track;
  for (const content::MotionSample& sample : frame.way) {
    track.push_back({sample.time_s, sample.pose.position, sample.pose.orientation, sample.buttons, true});
  }
  haptic::RecordedDevice hand(std::move(track));
  FramePublisher publisher(scene);
  CoupledLoops loops(scene, coupling, frame.way.front().pose, {&publisher});
  run_lockstep(loops, hand, scene, frame.way.back().time_s + kSettle, progress);
  const state::StateBuffer& buffer = publisher.buffer();
  SettledFrame settled{.state = buffer.make_frame()};
  state::FrameState before = buffer.make_frame();
  const double step_s = 1 / scene.rates.simulation_hz;
  buffer.sample(buffer.newest_s(), settled.state);
  buffer.sample(buffer.newest_s() - step_s, before);
  const auto compare = [&](const std::vector<Eigen::Vector3f>& now, const std::vector<Eigen::Vector3f>& then) {
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (!now[i].allFinite()) {
        throw files::ContentError(scene.scenario.string() +
                                  ": a random frame has no finite state; make the ranges smaller");
      }
      settled.speed = std::max(settled.speed, static_cast<double>((now[i] - then[i]).norm()) / step_s);
    }
  };
  for (std::size_t b = 0; b < settled.state.bodies.size(); ++b) compare(settled.state.bodies[b], before.bodies[b]);
  compare(settled.state.needle_positions, before.needle_positions);
  settled.state.time_s = frame.motion_s;
  return settled;
}

}  // namespace stylet::session
