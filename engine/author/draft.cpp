#include "engine/author/draft.h"

#include "engine/author/json_edit.h"
#include "engine/author/picking.h"
#include "engine/content/probe_placement.h"
#include "engine/files/error.h"
#include "engine/files/json_reader.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <utility>

namespace stylet::author {
namespace {

namespace fs = std::filesystem;
using files::ContentError;
using nlohmann::json;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kAlongBody = 0.98;  // cosine: a needle nearer to the body's axis than this has no motion

std::string number(double value) {
  std::string text = fmt::format("{:.6f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string row(const auto& values) {
  std::string text = "[";
  for (const double value : values) text += (text.size() > 1 ? ", " : "") + number(value);
  return text + "]";
}

std::string quoted(const std::string& text) {
  return json(text).dump();
}

std::optional<Eigen::Vector3d> vector_of(const json& object, const char* key) {
  if (!object.is_object() || !object.contains(key)) return {};
  const json& value = object[key];
  if (!value.is_array() || value.size() != 3) return {};
  Eigen::Vector3d out;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!value[i].is_number()) return {};
    out[static_cast<Eigen::Index>(i)] = value[i].get<double>();
  }
  return out;
}

double number_of(const json& object, const char* key, double otherwise) {
  return object.contains(key) && object[key].is_number() ? object[key].get<double>() : otherwise;
}

std::string text_of(const json& object, const char* key) {
  return object.contains(key) && object[key].is_string() ? object[key].get<std::string>() : "";
}

std::string whole(const fs::path& path) {
  return files::read_file(path, files::JsonLimits{}.bytes);
}

fs::path free_name(const fs::path& path, const std::string& ending) {
  for (int i = 1;; ++i) {
    const fs::path tried =
        path.parent_path() / (path.stem().string() + ending + (i > 1 ? fmt::format("_{}", i) : "") + ".json");
    if (!fs::exists(tried)) return tried;
  }
}

/// To the disk, not only to the system's memory: a file, or the names in a folder. What cannot do it stays as it is.
void sync(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return;
  ::fsync(file);
  ::close(file);
}

/// A file on its way: written beside its place, on the disk before it gets there, gone where it does not.
class Staged {
public:
  explicit Staged(fs::path place)
      : place_(std::move(place)),
        path_(place_.parent_path() / fmt::format(".{}.{}", place_.filename().string(), ::getpid())) {}
  ~Staged() {
    std::error_code gone;
    if (!path_.empty()) fs::remove(path_, gone);
  }
  Staged(const Staged&) = delete;
  Staged& operator=(const Staged&) = delete;

  const fs::path& path() const { return path_; }
  void write(const std::string& text) const {
    std::ofstream file(path_, std::ios::binary | std::ios::trunc);
    file << text;
    file.flush();
    if (!file) {
      throw ContentError(place_.string() + ": cannot be written; make the folder writable, or edit a copy");
    }
  }
  /// In the place of what is there, with its rights.
  void put() {
    std::error_code error;
    const fs::perms rights = fs::status(place_, error).permissions();
    if (!error && rights != fs::perms::unknown) fs::permissions(path_, rights, error);
    sync(path_);
    fs::rename(path_, place_, error);
    if (error) throw ContentError(fmt::format("{}: cannot be replaced: {}", place_.string(), error.message()));
    path_.clear();
    sync(place_.parent_path().empty() ? fs::path(".") : place_.parent_path());
  }

private:
  fs::path place_, path_;
};

void write_whole(const fs::path& path, const std::string& text) {
  Staged staged(path);
  staged.write(text);
  staged.put();
}

}  // namespace

Draft::Draft(fs::path path) : path_(std::move(path)), on_disk_(whole(path_)) {
  const files::JsonFile file(path_, on_disk_);  // says what is wrong
  if (!file.tree().is_object()) throw ContentError(path_.string() + ": is no object; open a scenario");
  states_.push_back({.text = on_disk_, .entry = {}});
  saved_ = states_.front();
}

void Draft::push(State state) {
  if (state.text == now().text && state.entry == now().entry) return;
  states_.resize(at_ + 1);
  states_.push_back(std::move(state));
  ++at_;
}

void Draft::set_target(std::size_t index, const TargetPlan& target) {
  State next = now();
  std::string& text = next.text;
  const std::string i = std::to_string(index);
  const json tree = json::parse(text);
  if (!tree.contains("targets")) text = with_value(text, {"targets"}, "[]");
  if (targets().size() <= index) text = with_value(text, {"targets", i}, "{ \"name\": " + quoted(target.name) + " }");
  text = with_value(text, {"targets", i, "name"}, quoted(target.name));
  if (!target.organ.empty()) {
    text = without_value(without_value(text, {"targets", i, "centre"}), {"targets", i, "radius_mm"});
    text = with_value(text, {"targets", i, "organ"}, quoted(target.organ));
  } else {
    text = without_value(text, {"targets", i, "organ"});
    text = with_value(text, {"targets", i, "centre"}, row(target.centre));
    text = with_value(text, {"targets", i, "radius_mm"}, number(std::round(target.radius * 1e4) / 10));
  }
  push(std::move(next));
}

void Draft::set_probe(const physics::RigidPose& pose) {
  State next = now();
  std::string& text = next.text;
  text = with_value(text, {"probe", "position"}, row(pose.position));
  text = without_value(without_value(text, {"probe", "axis"}), {"probe", "lateral"});
  const Eigen::Quaterniond& q = pose.orientation;
  text = with_value(text, {"probe", "orientation"}, row(std::array{q.w(), q.x(), q.y(), q.z()}));
  push(std::move(next));
}

void Draft::set_camera(const content::Camera& camera) {
  State next = now();
  std::string& text = next.text;
  if (!json::parse(text).contains("camera")) text = with_value(text, {"camera"}, "{}");
  text = without_value(text, {"camera", "frame"});
  text = with_value(text, {"camera", "eye"}, row(camera.eye));
  text = with_value(text, {"camera", "look_at"}, row(camera.look_at));
  text = with_value(text, {"camera", "up"}, row(camera.up));
  text =
      with_value(text, {"camera", "vertical_fov_deg"}, number(std::round(camera.vertical_fov / kDegree * 10) / 10));
  push(std::move(next));
}

void Draft::set_forbidden(const std::vector<std::string>& organs) {
  State next = now();
  std::string list;
  for (const std::string& organ : organs) list += (list.empty() ? "" : ", ") + quoted(organ);
  next.text = with_value(next.text, {"forbidden"}, "[" + list + "]");
  push(std::move(next));
}

void Draft::set_entry(const Eigen::Vector3d& entry) {
  State next = now();
  next.entry = entry;
  push(std::move(next));
}

std::vector<TargetPlan> Draft::targets() const {
  std::vector<TargetPlan> out;
  const json tree = json::parse(text());
  if (!tree.contains("targets") || !tree["targets"].is_array()) return out;
  for (const json& target : tree["targets"]) {
    TargetPlan& plan = out.emplace_back();
    if (!target.is_object()) continue;
    plan.name = text_of(target, "name");
    plan.organ = text_of(target, "organ");
    plan.centre = vector_of(target, "centre").value_or(Eigen::Vector3d::Zero());
    plan.radius = 1e-3 * number_of(target, "radius_mm", 10);
  }
  return out;
}

std::vector<std::string> Draft::forbidden() const {
  std::vector<std::string> out;
  const json tree = json::parse(text());
  if (!tree.contains("forbidden") || !tree["forbidden"].is_array()) return out;
  for (const json& organ : tree["forbidden"]) {
    if (organ.is_string()) out.push_back(organ.get<std::string>());
  }
  return out;
}

std::optional<physics::RigidPose> Draft::probe() const {
  const json tree = json::parse(text());
  if (!tree.contains("probe") || !tree["probe"].is_object()) return {};
  const json& probe = tree["probe"];
  const auto position = vector_of(probe, "position");
  if (!position || !probe.contains("orientation")) return {};
  const json& q = probe["orientation"];
  if (!q.is_array() || q.size() != 4) return {};
  for (const json& part : q) {
    if (!part.is_number()) return {};
  }
  return physics::RigidPose{.position = *position,
                            .orientation = Eigen::Quaterniond(q[0].get<double>(), q[1].get<double>(),
                                                              q[2].get<double>(), q[3].get<double>())
                                               .normalized()};
}

std::optional<content::Camera> Draft::camera() const {
  const json tree = json::parse(text());
  if (!tree.contains("camera") || !tree["camera"].is_object()) return {};
  const json& camera = tree["camera"];
  const auto eye = vector_of(camera, "eye"), look_at = vector_of(camera, "look_at");
  if (text_of(camera, "frame") == "room" || !eye || !look_at) return {};
  return content::Camera{.eye = *eye,
                         .look_at = *look_at,
                         .up = vector_of(camera, "up").value_or(Eigen::Vector3d::UnitY()),
                         .vertical_fov = kDegree * number_of(camera, "vertical_fov_deg", 35)};
}

void Draft::save(const WriteMotion& write_motion) {
  if (whole(path_) != on_disk_) {
    throw ContentError(path_.string() + ": another program has changed it meanwhile; nothing is written over it");
  }
  if (!changed()) return;
  State next = now();
  Staged scenario(path_);
  std::optional<Staged> motion;
  if (next.entry) {
    const fs::path place = own_motion();
    motion.emplace(place);
    write_motion(*next.entry, motion->path());
    next.text = with_value(next.text, {"motion"}, quoted(place.filename().string()));
  }
  scenario.write(next.text);
  if (motion) motion->put();
  scenario.put();
  on_disk_ = next.text;
  states_[at_] = next;
  saved_ = std::move(next);
}

/// The motion file that the scenario names, where an author's save made it; else a free name.
fs::path Draft::own_motion() const {
  const std::string named = text_of(json::parse(text()), "motion"), ours = path_.stem().string() + "_motion";
  if (named.starts_with(ours) && named.ends_with(".json")) {
    const std::string number = named.substr(ours.size(), named.size() - ours.size() - 5);
    if (number.find_first_not_of("_0123456789") == std::string::npos) return path_.parent_path() / named;
  }
  return free_name(path_, "_motion");
}

fs::path Draft::keep() const {
  const fs::path beside = free_name(path_, "_unsaved");
  write_whole(beside, text());
  return beside;
}

std::vector<Oddity> look_over(const content::Scene& scene, const std::vector<TargetPlan>& targets,
                              const std::vector<std::size_t>& forbidden,
                              const std::optional<Eigen::Vector3d>& entry) {
  std::vector<Oddity> odd;
  if (std::string what = content::odd_probe_placement(scene.probe, scene.labels); !what.empty()) {
    odd.push_back({"The probe: " + what, scene.probe.pose.position});
  }
  for (const TargetPlan& target : targets) {
    if (!inside_patient(scene.labels, target.centre)) {
      odd.push_back({"The target lies outside the patient; put it into an organ", target.centre});
    }
    const Eigen::Vector3d seen =
        scene.probe.pose.orientation.conjugate() * (target.centre - scene.probe.pose.position);
    if (std::abs(seen.y()) > target.radius || seen.z() < 0 || seen.z() > scene.probe.depth) {
      odd.push_back({fmt::format("The first image does not show the target: it lies {:.0f} mm beside its plane, "
                                 "{:.0f} mm deep",
                                 std::abs(seen.y()) * 1e3, seen.z() * 1e3),
                     target.centre});
    }
  }
  if (targets.empty()) odd.push_back({"There is no target; put one", scene.camera.look_at});
  if (!entry) {
    odd.push_back({"The needle's motion misses the patient; put an entry", scene.camera.look_at});
  } else if (!targets.empty()) {
    const Eigen::Vector3d way = targets.front().centre - *entry;
    if (way.norm() > scene.needle.length) {
      odd.push_back({fmt::format("The needle of {:.0f} mm does not reach the target, {:.0f} mm away",
                                 scene.needle.length * 1e3, way.norm() * 1e3),
                     *entry});
    }
    if (way.norm() < 1e-3 || std::abs(way.normalized().y()) > kAlongBody) {
      odd.push_back(
          {"The needle would run along the body; choose an entry beside or in front of the target", *entry});
    }
    for (const Chord& chord : chords(scene, {.from = *entry, .along = way.normalized()})) {
      if (chord.from > way.norm() || std::ranges::find(forbidden, chord.surface) == forbidden.end()) continue;
      odd.push_back({fmt::format("The straight way to the target goes through {}, {:.0f} mm deep",
                                 scene.surfaces[chord.surface].name, chord.from * 1e3),
                     *entry + chord.from * way.normalized()});
    }
  }
  return odd;
}

std::string pointer_of(const std::string& line) {
  const std::size_t begin = line.find(":/");
  if (begin == std::string::npos) return {};
  const std::size_t end = line.find(": ", begin);
  return end == std::string::npos ? "" : line.substr(begin + 1, end - begin - 1);
}

}  // namespace stylet::author
