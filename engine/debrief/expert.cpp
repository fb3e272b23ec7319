#include "engine/debrief/expert.h"

#include "engine/debrief/session_replay.h"
#include "engine/files/error.h"
#include "engine/session/lockstep.h"
#include "engine/session/recorded_stylus.h"
#include "engine/session/session_report.h"
#include "engine/session/state_hash.h"
#include "engine/training/training_session.h"

#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

namespace stylet::debrief {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kName = "expert motion";

/// Of everything that the expert's way depends on.
std::uint64_t scene_hash(const content::Scene& scene, std::string_view build) {
  session::StateHash hash;
  const auto add = [&hash](const Eigen::Vector3d& v) { hash.add({v.data(), 3}); };
  const auto add_text = [&hash](std::string_view text) {
    for (const char c : text) hash.add(static_cast<std::uint64_t>(static_cast<unsigned char>(c)));
  };
  add_text(build);
  add_text(scene.coupling);
  std::ifstream file(scene.scenario, std::ios::binary);
  add_text(std::string(std::istreambuf_iterator<char>(file), {}));
  for (const content::DeformableBody& body : scene.bodies) {
    for (const Eigen::Vector3d& node : body.mesh.nodes) add(node);
    for (const auto& tet : body.mesh.tets) {
      for (const int node : tet) hash.add(static_cast<std::uint64_t>(node));
    }
    for (const int node : body.fixed_nodes) hash.add(static_cast<std::uint64_t>(node));
  }
  for (const content::Tissue& tissue : scene.tissues) {
    hash.add(tissue.mechanics.young_modulus);
    hash.add(tissue.mechanics.poisson_ratio);
    hash.add(tissue.mechanics.stiffening);
    for (const physics::Relaxation& term : tissue.mechanics.relaxation) {
      hash.add(term.share);
      hash.add(term.time_s);
    }
    hash.add(tissue.capsule_modulus);
    hash.add(tissue.capsule_thickness);
    hash.add(tissue.density);
    hash.add(tissue.needle.puncture_force);
    hash.add(tissue.needle.cutting_force);
    hash.add(tissue.needle.cutting_viscosity);
    hash.add(tissue.needle.friction_per_length);
    hash.add(tissue.needle.side_strength);
  }
  for (const double v :
       {scene.needle.length, scene.needle.outer_diameter, scene.needle.inner_diameter, scene.needle.young_modulus,
        scene.needle.yield_strength, scene.needle.bevel_force_ratio, scene.rates.haptic_hz, scene.rates.simulation_hz,
        scene.probe.frequency_hz, scene.probe.depth}) {
    hash.add(v);
  }
  for (const auto* track : {&scene.motion.stylus, &scene.motion.probe}) {
    for (const content::MotionSample& sample : *track) {
      hash.add(sample.time_s);
      add(sample.pose.position);
      hash.add({sample.pose.orientation.coeffs().data(), 4});
    }
  }
  return hash.value();
}

json to_json(const Expert& expert) {
  json path = json::array();
  for (const PathPoint& p : expert.path) {
    path.push_back({p.time_s, p.tip.x(), p.tip.y(), p.tip.z(), p.tissue, p.inserted, p.force, p.axial, p.lateral,
                    p.target_distance});
  }
  json metrics = json::object();
  for (const training::Metric& metric : expert.metrics) {
    if (metric.value) metrics[metric.key] = *metric.value;
  }
  return json{{"format", "stylet-expert"}, {"path", path}, {"metrics", metrics}};
}

/// @throws nlohmann::json::exception  where it is not what to_json() wrote
Expert expert_from(const json& stored) {
  Expert expert{.name = kName};
  for (const auto& row : stored.at("path")) {
    PathPoint& p = expert.path.emplace_back();
    p.time_s = row.at(0);
    for (int axis = 0; axis < 3; ++axis) p.tip[axis] = row.at(1 + axis).get<double>();
    p.tissue = row.at(4);
    p.inserted = row.at(5);
    p.force = row.at(6);
    p.axial = row.at(7);
    p.lateral = row.at(8);
    p.target_distance = row.at(9);
  }
  for (const auto& [key, value] : stored.at("metrics").items()) {
    expert.metrics.push_back(
        {.key = key, .title = {}, .unit = {}, .value = value.get<double>(), .definition = {}, .source = {}});
  }
  return expert;
}

Expert expert_of(const training::Trace& trace, const content::Scene& scene, std::string name) {
  return {.name = std::move(name), .path = path_of(trace), .metrics = training::measure(trace, scene)};
}

}  // namespace

Expert run_expert_motion(const content::Scene& scene, const session::RunProgress& progress) {
  haptic::RecordedDevice hand = session::recorded_stylus(scene.motion, kName);
  const haptic::StylusSample first = hand.read(0);
  const double duration_s = scene.motion.stylus.back().time_s;
  training::TraceRecorder tracer(scene, duration_s);
  // With the course, so that what the motion fires, heats and draws is measured too.
  training::TrainingSession course(scene, {.automatic = true});
  std::vector<recording::EventRecord> events;
  const auto follow = [&](std::span<const training::Action> actions) {
    std::ranges::copy(course.step(actions), std::back_inserter(events));
  };
  session::CoupledLoops loops(scene, session::coupling_from_name(scene.coupling), {first.position, first.orientation},
                              {&tracer, &course.watch()});
  session::run_lockstep(loops, hand, scene, duration_s, [&](double share) {
    if (share > 0) follow({});
    if (progress) progress(share);
  });
  follow({});
  constexpr std::array kFinish{training::Action::finish};
  follow(kFinish);
  return expert_of(tracer.take(std::move(events)), scene, kName);
}

Expert expert_motion(const content::Scene& scene, std::string_view build, const fs::path& cache,
                     const session::RunProgress& progress) {
  if (cache.empty()) return run_expert_motion(scene, progress);
  const fs::path file = cache / fmt::format("expert-{}.json", session::hash_text(scene_hash(scene, build)));
  try {
    std::ifstream in(file);
    if (in) return expert_from(json::parse(in));
  } catch (const json::exception&) {  // torn or foreign: made again
  }
  Expert expert = run_expert_motion(scene, progress);
  std::error_code error;
  fs::create_directories(cache, error);
  const fs::path part = file.string() + fmt::format(".{}", ::getpid());
  if (std::ofstream(part) << to_json(expert)) fs::rename(part, file, error);
  fs::remove(part, error);
  return expert;
}

fs::path expert_cache() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != '\0') {
    return fs::path(cache) / "stylet";
  }
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0') {
    return fs::path(home) / ".cache" / "stylet";
  }
  return {};
}

Expert expert_recording(const content::Scene& scene, const fs::path& path, const session::RunProgress& progress) {
  const recording::Recording recording = recording::read_recording(path);
  if (fs::path(recording.header.scenario).filename() != scene.scenario.filename()) {
    throw files::ContentError(
        fmt::format("--expert {}: is of the scenario {}, not of {}; give a recording of the same", path.string(),
                    recording.header.scenario, scene.scenario.string()));
  }
  SessionReplay replay(scene, recording);
  replay.run(progress);
  return expert_of(replay.trace(), scene, "expert: " + path.filename().string());
}

}  // namespace stylet::debrief
