// What `stylet validate` calls sound can be trained: scenarios whose files were changed key by key are validated, and
// the sound ones run from the first step to the numbers of the debrief.
#include "engine/app/validate.h"
#include "engine/debrief/collect.h"
#include "engine/debrief/debrief_files.h"
#include "engine/debrief/live_footage.h"
#include "engine/debrief/page.h"
#include "engine/files/error.h"
#include "engine/files/json_reader.h"
#include "engine/gltf/gltf.h"
#include "engine/gltf/gltf_writer.h"
#include "engine/mesh/decimation.h"
#include "engine/readers/formats.h"
#include "engine/readers/scenario.h"
#include "engine/recording/recording.h"
#include "engine/session/held_breath.h"
#include "engine/session/held_probe.h"
#include "engine/session/live_session.h"
#include "engine/session/recorded_stylus.h"
#include "engine/session/session_report.h"
#include "engine/session/start_pose.h"
#include "engine/training/training_report.h"
#include "engine/training/training_session.h"
#include "tests/support/key_mutation.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace stylet::app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using support::KeyMutation;

constexpr double kSession = 0.5;  // s
constexpr double kApproach = 0.35;

/// A shipped scenario with all that it names, small enough to run in a moment: organs of few triangles and
/// tetrahedra, large voxels, a hand that goes the last 80 mm to where the shipped one ends up in half a second.
struct SmallFiles {
  std::map<std::string, Json> json{};  ///< by name of file: scenario.json and what it names
  std::map<std::string, std::string> organs{};

  void write(const support::TemporaryFolder& folder) const {
    for (const auto& [name, object] : json) {
      folder.write(name, object.dump(1, ' ', false, Json::error_handler_t::replace));
    }
    for (const auto& [name, bytes] : organs) folder.write(name, bytes);
  }
};

Json read(const fs::path& path) {
  return Json::parse(files::read_file(path, 8u << 20));
}

/// The same organs in few triangles, where that leaves them solid.
std::string coarse_organs(const fs::path& path) {
  const std::string bytes = files::read_file(path, 64u << 20);
  const gltf::GltfScene scene = gltf::read_gltf(std::as_bytes(std::span(bytes.data(), bytes.size())), path);
  std::vector<gltf::AnnotatedSurface> coarse;
  for (const gltf::GltfOrgan& organ : scene.organs) {
    coarse.push_back({.name = organ.organ.id.empty() ? organ.name : organ.organ.id,
                      .role = organ.organ.role,
                      .tissue = organ.tissue ? organ.tissue->preset : "",
                      .body = organ.organ.body,
                      .mesh = mesh::decimate(organ.mesh, {.triangles = 1200})});
  }
  const auto glb = gltf::write_glb(coarse, {}, {.generator = "test", .copyright = {}, .scene = "coarse"});
  return {reinterpret_cast<const char*>(glb.data()), glb.size()};
}

/// Straight along the needle to where it comes closest to the target, then as it stays there.
Json short_track(const content::Scene& scene) {
  const auto tip = [&](const content::MotionSample& sample) {
    return Eigen::Vector3d(sample.pose.position +
                           sample.pose.orientation * Eigen::Vector3d(0, 0, scene.needle.length));
  };
  const content::MotionSample& there = *std::ranges::min_element(
      scene.motion.stylus, {}, [&](const auto& sample) { return (tip(sample) - scene.targets[0].centre).norm(); });
  const Eigen::Vector3d ahead = there.pose.orientation * Eigen::Vector3d::UnitZ();
  Json track = Json::array();
  for (const double t : {0.0, 0.05, kApproach, 60.0}) {
    const Eigen::Vector3d hub = there.pose.position - (t < kApproach ? 0.08 : 0.0) * ahead;
    const Eigen::Quaterniond& q = there.pose.orientation;
    track.push_back({t, hub.x(), hub.y(), hub.z(), q.w(), q.x(), q.y(), q.z()});
  }
  return track;
}

SmallFiles small_files(const std::string& name) {
  const fs::path path = readers::find_scenario(name);
  SmallFiles small;
  Json scenario = read(path);
  const auto take = [&](Json& key, const std::string& as) {
    small.json[as] = read(path.parent_path() / key.get<std::string>());
    key = as;
  };
  take(scenario["tissues"], "tissues.json");
  take(scenario["needle"], "needle.json");
  take(scenario["motion"], "motion.json");
  take(scenario["probe"]["file"], "probe.json");
  small.json["motion.json"]["tracks"] = {{"stylus", short_track(readers::load_scene(path))}};
  for (Json& organ : scenario["organs"]) {
    const fs::path file = path.parent_path() / organ["file"].get<std::string>();
    organ["file"] = file.filename().string();
    small.organs[file.filename().string()] = coarse_organs(file);
  }
  for (Json& body : scenario["bodies"]) body["mesh"] = {{"target_nodes", 250}};
  scenario["labels"]["spacing_mm"] = 4;
  small.json["scenario.json"] = std::move(scenario);
  return small;
}

/// Sizes that only cost time are kept small, whatever was made of them: what they do is the same.
void keep_small(Json& scenario) {
  const auto at_most = [](Json& object, const char* key, double most) {
    if (object.is_object() && object.contains(key) && object[key].is_number() && object[key] > most) {
      object[key] = most;
    }
  };
  const auto at_least = [](Json& object, const char* key, double least) {
    if (object.is_object() && object.contains(key) && object[key].is_number() && object[key] < least &&
        object[key] > 0.3) {
      object[key] = least;
    }
  };
  if (!scenario.is_object()) return;
  if (scenario.contains("labels")) at_least(scenario["labels"], "spacing_mm", 3);
  if (!scenario.contains("bodies") || !scenario["bodies"].is_array()) return;
  for (Json& body : scenario["bodies"]) {
    if (!body.is_object() || !body.contains("mesh")) continue;
    at_most(body["mesh"], "target_nodes", 600);
    at_least(body["mesh"], "cell_mm", 20);
  }
}

bool one_line(const std::string& text) {
  return !text.empty() && text.find('\n') == std::string::npos;
}

/// The place of a number that is none; empty: all are.
std::string not_a_number(const Json& value, const std::string& at = "") {
  if (value.is_number_float() && !std::isfinite(value.get<double>())) return at.empty() ? "/" : at;
  if (!value.is_structured()) return {};
  for (const auto& [key, inner] : value.items()) {
    if (std::string found = not_a_number(inner, at + "/" + key); !found.empty()) return found;
  }
  return {};
}

bool all_finite(const state::FrameState& frame) {
  const auto finite = [](const auto& points) {
    return std::ranges::all_of(points, [](const Eigen::Vector3f& x) { return x.allFinite(); });
  };
  return std::ranges::all_of(frame.bodies, finite) && finite(frame.needle_positions) && frame.force.allFinite() &&
         frame.probe_position.allFinite() && frame.probe_orientation.coeffs().allFinite() && frame.breath.allFinite();
}

/// Half a second of a trainee who begins, lets the needle in, and presses whatever can be pressed.
/// @return what is wrong with it; empty: nothing
std::string train(const fs::path& path, std::uint32_t seed) {
  const content::Scene scene = readers::load_scene(path);
  content::ProbeMove probe_start;
  if (!scene.targets.empty()) {
    const session::StartPose start = session::drawn_start(scene, seed);
    if (!start.hub.position.allFinite() || !start.hub.orientation.coeffs().allFinite())
      return "a start of no numbers";
    if (seed % 2 == 1) probe_start = start.probe;
  }
  haptic::RecordedDevice device = session::recorded_stylus(scene.motion);
  const fs::path file = path.parent_path() / "session.rec";
  session::HeldProbe probe(scene, probe_start);
  session::HeldBreath breath(scene.breathing);
  training::TraceRecorder trace(scene, kSession);
  training::TrainingSession course(scene, {.automatic = false});
  debrief::LiveFootage footage(scene);
  session::LiveSession live(scene, device,
                            {.coupling = session::coupling_from_name(scene.coupling),
                             .duration_s = kSession,
                             .lockstep = true,
                             .recording = file,
                             .build = "test",
                             .probe = &probe,
                             .listeners = {&trace, &course.watch(), &footage, &breath}});
  footage.watch(live.frames());
  live.start();
  std::mt19937 random(seed);
  state::FrameState frame = live.frames().make_frame();
  std::string wrong;
  for (int i = 0; !live.finished() && wrong.empty(); ++i) {
    live.advance(session::kLockstepFrame);
    std::vector<procedures::Action> actions;
    if (i == 1) actions.push_back(procedures::Action::start);
    if (i > 1 && random() % 4 == 0 && course.state().trigger) actions.push_back(*course.state().trigger);
    if (i > 20 && random() % 6 == 0 && !course.state().possible.empty()) {
      actions.push_back(course.state().possible[random() % course.state().possible.size()]);
    }
    std::erase_if(actions, [](const procedures::Action& action) {  // anew; time would stand
      return action == procedures::Action::reset || action == procedures::Action::pause;
    });
    (void)course.poll(live, actions);
    if (i == 15) breath.ask(true);
    (void)live.frames().sample(live.time_s(), frame);
    course.show(frame);
    if (!all_finite(frame)) wrong = "a picture of no numbers at " + std::to_string(live.time_s()) + " s";
  }
  course.end(live);
  session::SessionReport report{.scenario = path.string()};
  report.run = live.stop();
  if (!wrong.empty()) return wrong;
  if (report.run.needle_flags & physics::kNeedleNonFinite) return "a needle of no numbers";
  report.force = live.force().summary();
  report.passivity = live.passivity();
  report.closest_target_distance = live.closest_target_distance();
  report.probe = live.probe();
  report.state_hash = live.state_hash();
  const recording::Recording recording = recording::read_recording(file);
  if (!recording.complete()) return "its recording: " + recording.condition();
  const training::TrainingReport assessed = training::assess(trace.take(recording.events), scene);
  const Json json = training::with_training(session::to_json(report), assessed);
  if (const std::string at = not_a_number(json); !at.empty()) return "no number in session.json: " + at;
  (void)training::in_words(assessed);
  (void)course.result_in_words();
  footage.complete(assessed.trace, course.shown(), recording.haptic.back().time_s);
  const debrief::DebriefData data = debrief::collect(scene, recording, footage, assessed.metrics, std::nullopt);
  if (const std::string at = not_a_number(debrief::to_json(data)); !at.empty())
    return "no number in debrief.json: " + at;
  return debrief::debrief_page(data).empty() ? "an empty page" : "";
}

enum class Outcome : std::uint8_t { trained, refused, broken };

/// In this process.
Outcome outcome_of(const fs::path& scenario, std::uint32_t seed, std::string& why) {
  try {
    const Verdict verdict = validate(scenario);
    for (const std::string& problem : verdict.problems) {
      if (!one_line(problem)) why = "validate says in more than a line: " + problem;
    }
    for (const std::string& warning : verdict.warnings) {
      if (!one_line(warning)) why = "validate warns in more than a line: " + warning;
    }
    if (!why.empty()) return Outcome::broken;
    if (!verdict.sound()) {
      why = verdict.problems.front();
      return Outcome::refused;
    }
    why = train(scenario, seed);
  } catch (const std::exception& error) {
    why = std::string("throws: ") + error.what();
  }
  return why.empty() ? Outcome::trained : Outcome::broken;
}

/// In a process of its own: what aborts ends nothing else.
Outcome outcome_apart(const fs::path& scenario, std::uint32_t seed, std::string& why) {
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    std::string because;
    const Outcome outcome = outcome_of(scenario, seed, because);
    if (FILE* out = std::fopen((scenario.parent_path() / "why.txt").c_str(), "w"); out != nullptr) {
      std::fputs(because.c_str(), out);
      std::fclose(out);
    }
    std::_Exit(static_cast<int>(outcome));
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  if (!WIFEXITED(status)) {
    why = "ended by signal " + std::to_string(WTERMSIG(status));
    return Outcome::broken;
  }
  why = files::read_file(scenario.parent_path() / "why.txt", 1u << 20);
  return WEXITSTATUS(status) <= 2 ? static_cast<Outcome>(WEXITSTATUS(status)) : Outcome::broken;
}

const files::KeyTable& table_of(const std::string& file) {
  static const std::vector<files::FileFormat> formats = readers::formats();
  return std::ranges::find(formats, file.substr(0, file.find('.')), &files::FileFormat::name)->table();
}

int cases() {
  const char* asked = std::getenv("STYLET_SCENARIO_CASES");
  return asked != nullptr ? std::atoi(asked) : support::kSanitized ? 10 : 12;
}
std::uint32_t first_seed() {
  const char* asked = std::getenv("STYLET_SCENARIO_SEED");
  return asked != nullptr ? static_cast<std::uint32_t>(std::atoi(asked)) : 1;
}

class SoundScenario : public testing::TestWithParam<const char*> {};

TEST_P(SoundScenario, IsTrainedToItsDebriefWhateverItsKeysSay) {
  const SmallFiles sound = small_files(GetParam());
  std::vector<std::string> names;
  for (const auto& [file, json] : sound.json) {
    if (file != "motion.json") support::collect_texts(json, names);
  }
  std::map<Outcome, int> outcomes;
  for (int i = 0; i < cases(); ++i) {
    const std::uint32_t seed = first_seed() + static_cast<std::uint32_t>(i);
    KeyMutation mutation(seed, names);
    SmallFiles files = sound;
    std::string changes;
    // The first is the scenario itself.
    for (std::size_t edits = i == 0 ? 0 : 1 + mutation.pick(3); edits > 0; --edits) {
      auto file = files.json.find("scenario.json");
      if (mutation.one_in(3))
        file = std::next(files.json.begin(), static_cast<long>(mutation.pick(files.json.size())));
      changes += file->first + mutation.change(file->second, table_of(file->first)) + "; ";
    }
    keep_small(files.json["scenario.json"]);
    const support::TemporaryFolder folder;
    files.write(folder);
    std::string why;
    const Outcome outcome = outcome_apart(folder / "scenario.json", seed, why);
    ++outcomes[outcome];
    EXPECT_NE(outcome, Outcome::broken) << "seed " << seed << ": " << changes << '\n' << why;
    if (i == 0) {
      EXPECT_EQ(outcome, Outcome::trained) << why;
    }
  }
  std::printf("%s: %d trained, %d refused\n", GetParam(), outcomes[Outcome::trained], outcomes[Outcome::refused]);
  EXPECT_GT(outcomes[Outcome::trained], cases() / 8) << "most are refused: nothing was tried";
  EXPECT_GT(outcomes[Outcome::refused], cases() / 8);
}

/// The tutorial with every object that a scenario can have, so that each key is there to be changed.
SmallFiles full_files() {
  SmallFiles full = small_files("tutorial");
  Json& scenario = full.json["scenario.json"];
  scenario["bodies"][0]["mesh"] = {{"target_nodes", 100}};
  scenario["labels"]["spacing_mm"] = 6;
  scenario["room_from_patient"] = {{"position", {0, 0, 0}}};
  scenario["breathing"] = Json::parse(R"({"amplitude": 0.5, "holds": [[0.1, 0.2]]})");
  scenario["bodies"][0]["fixed"][0]["breathing_mm"] = {0, 0, 2};
  scenario["start"]["probe_off_mm"] = {1, 4};
  scenario["organs"][0]["nodes"] = Json::object();
  return full;
}

/// Of the values of a sweep, where nobody asks for all. No multiple of what a key has: each key is met.
constexpr int kOneOf = support::kSanitized ? 17 : 3;

TEST(SoundScenarioSweep, IsTrainedWithEachKeyAtItsOddestValues) {
  const SmallFiles full = full_files();
  const char* asked = std::getenv("STYLET_SCENARIO_CASES");
  int number = 0, trained = 0, refused = 0;
  for (const char* file : {"scenario.json", "needle.json", "probe.json", "tissues.json"}) {
    KeyMutation::sweep(full.json.at(file), table_of(file), [&](const Json& changed, const std::string& what) {
      if (asked == nullptr && number++ % kOneOf != 0) return;
      SmallFiles files = full;
      files.json[file] = changed;
      keep_small(files.json["scenario.json"]);
      const support::TemporaryFolder folder;
      files.write(folder);
      std::string why;
      const Outcome outcome = outcome_apart(folder / "scenario.json", 1, why);
      EXPECT_NE(outcome, Outcome::broken) << file << what << '\n' << why;
      ++(outcome == Outcome::trained ? trained : refused);
    });
  }
  std::printf("%d trained, %d refused\n", trained, refused);
  EXPECT_GT(trained, refused / 4) << "most are refused: nothing was tried";
}

INSTANTIATE_TEST_SUITE_P(Shipped, SoundScenario,
                         testing::Values("tutorial", "liver_biopsy", "rfa", "cyst_aspiration"),
                         [](const auto& tested) { return std::string(tested.param); });

}  // namespace
}  // namespace stylet::app
