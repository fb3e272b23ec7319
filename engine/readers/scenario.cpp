#include "engine/readers/scenario.h"

#include "engine/content/embedding.h"
#include "engine/content/probe_placement.h"
#include "engine/content/tissue_table.h"
#include "engine/files/json_reader.h"
#include "engine/files/json_scan.h"
#include "engine/gltf/gltf.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/readers/anatomy.h"
#include "engine/readers/calibration_file.h"
#include "engine/readers/deformable.h"
#include "engine/readers/device_profile_file.h"
#include "engine/readers/instruments.h"
#include "engine/readers/label_volume.h"
#include "engine/readers/motion_file.h"
#include "engine/readers/patient_procedure.h"
#include "engine/readers/scenario_file.h"
#include "engine/readers/scene_organs.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string_view>

namespace stylet::readers {
namespace {

using Problems = std::vector<std::string>;

/// A vertex may stick out of its body by about this many tetrahedra before its picture would flap.
constexpr float kLargestWeight = 10;

/// Reads one JSON file with `reader`; what is wrong goes to `problems`.
template <typename Reader>
auto read_json(const std::filesystem::path& path, Reader&& reader, Problems& problems,
               const files::JsonLimits& limits = {}) {
  using Result = decltype(reader(std::declval<files::JsonFile&>()));
  Result result{};
  try {
    files::JsonFile file(path, limits);
    result = reader(file);
    problems.insert(problems.end(), file.problems().begin(), file.problems().end());
  } catch (const files::ContentError& error) {
    problems.emplace_back(error.what());
  }
  return result;
}

std::vector<gltf::GltfScene> read_organs(const ScenarioFile& scenario, Problems& problems, Problems& warnings) {
  std::vector<gltf::GltfScene> files(scenario.organs.size());
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (scenario.organs[i].path.empty()) continue;
    try {
      files[i] = gltf::read_gltf(scenario.organs[i].path);
      warnings.insert(warnings.end(), files[i].warnings.begin(), files[i].warnings.end());
      // The file is part of a scenario: a key that nothing reads is a value its author thinks is in use.
      const Problems& unknown = files[i].unknown_annotations;
      problems.insert(problems.end(), unknown.begin(), unknown.end());
    } catch (const files::ContentError& error) {
      problems.emplace_back(error.what());
    }
  }
  return files;
}

/// The body of each organ by name: those that are a boundary, those a scenario lets a body carry.
void assign_bodies(const ScenarioFile& scenario, std::vector<Organ>& organs, Problems& problems) {
  std::set<std::string> names;
  for (const BodyRequest& body : scenario.bodies) {
    names.insert(body.name);
    for (Organ& organ : organs) {
      const bool carried = std::find(body.carries.begin(), body.carries.end(), organ.id) != body.carries.end();
      if (carried || (organ.id == body.boundary && organ.role == content::SurfaceRole::boundary))
        organ.body = body.name;
    }
    for (std::size_t i = 0; i < body.carries.size(); ++i) {
      if (find_organ(organs, body.carries[i]) == nullptr) {
        problems.push_back(
            fmt::format("{}:{}/carries/{}: there is no organ \"{}\" in the organ files; correct its id",
                        scenario.path.string(), body.pointer, i, body.carries[i]));
      }
    }
  }
  // A body that this scenario does not simulate stands still, and what it carries with it.
  for (Organ& organ : organs) {
    if (!names.contains(organ.body)) organ.body.clear();
  }
}

bool breathes(const ScenarioFile& scenario, const Organ& organ) {
  return std::ranges::find(scenario.breathing_organs, organ.id) != scenario.breathing_organs.end();
}

void check_breathing(const ScenarioFile& scenario, const std::vector<Organ>& organs, Problems& problems) {
  for (std::size_t i = 0; i < scenario.breathing_organs.size(); ++i) {
    const std::string& id = scenario.breathing_organs[i];
    const Organ* organ = find_organ(organs, id);
    if (organ != nullptr && organ->body.empty()) continue;
    problems.push_back(fmt::format("{}:/breathing/rigid/organs/{}: {}", scenario.path.string(), i,
                                   organ == nullptr
                                       ? fmt::format("there is no organ \"{}\"; correct its id", id)
                                       : fmt::format("{} moves with the body {}; take it out", id, organ->body)));
  }
}

int body_index(const ScenarioFile& scenario, const std::string& name) {
  for (std::size_t i = 0; i < scenario.bodies.size(); ++i) {
    if (scenario.bodies[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

content::Surface build_surface(const Organ& organ, int body, bool breathes,
                               const std::vector<content::DeformableBody>& bodies, Problems& problems) {
  content::Surface surface;
  surface.name = organ.name;
  surface.tissue = organ.tissue;
  surface.role = organ.role;
  surface.body = body;
  surface.breathes = breathes;
  for (const auto& vertex : organ.mesh.vertices) surface.positions.push_back(vertex.cast<float>());
  surface.normals = mesh::smooth_normals(organ.mesh);
  for (const auto& triangle : organ.mesh.triangles) {
    surface.indices.insert(surface.indices.end(), triangle.begin(), triangle.end());
  }
  if (body >= 0) {
    surface.embedding = content::embed(surface.positions, bodies[body].mesh);
    if (const float weight = content::largest_weight(surface.embedding); weight > kLargestWeight) {
      problems.push_back(
          fmt::format("{}: {} sticks out of the body {} too far to move with it (weight {:.1f}, the "
                      "limit is {}); cut it there, use a smaller cell, or make it rigid",
                      organ.place, organ.name, organ.body, weight, kLargestWeight));
    }
  }
  return surface;
}

content::LabelVolume build_labels(const ScenarioFile& scenario, const std::vector<Organ>& organs,
                                  const std::vector<content::Tissue>& tissues, Problems& problems) {
  std::vector<LabelledSolid> solids;
  LabelFiller filler;
  const LabelRequest& request = scenario.labels;
  for (std::size_t i = 0; i < organs.size(); ++i) {
    if (organs[i].role == content::SurfaceRole::visual) continue;
    if (organs[i].id == request.behind) filler.wall.push_back(solids.size());
    const int body = breathes(scenario, organs[i]) ? content::kBreathes : body_index(scenario, organs[i].body);
    solids.push_back({&organs[i].mesh, static_cast<std::uint8_t>(organs[i].tissue), static_cast<std::int8_t>(body)});
  }
  std::optional<LabelFiller> between;
  if (!request.filler.empty()) {
    const int tissue = content::find_tissue(tissues, request.filler);
    if (tissue < 0) {
      problems.push_back(fmt::format("{}:/labels/filler: the tissue table has no \"{}\"; correct its name",
                                     scenario.path.string(), request.filler));
    }
    if (filler.wall.empty()) {
      problems.push_back(fmt::format("{}:/labels/behind: there is no organ \"{}\"; correct its id",
                                     scenario.path.string(), request.behind));
    }
    filler.label = static_cast<std::uint8_t>(std::max(tissue, 0));
    request.front.cwiseAbs().maxCoeff(&filler.axis);
    filler.positive = request.front[filler.axis] > 0;
    between = filler;
  }
  return voxelise(solids, request.spacing, between, LabelEdges::measured);
}

std::vector<content::Target> build_targets(const ScenarioFile& scenario, const std::vector<Organ>& organs,
                                           Problems& problems) {
  std::vector<content::Target> targets;
  for (const TargetRequest& request : scenario.targets) {
    content::Target target{.name = request.name, .centre = request.centre, .radius = request.radius};
    if (!request.organ.empty()) {
      const Organ* organ = find_organ(organs, request.organ);
      if (organ == nullptr) {
        problems.push_back(fmt::format("{}:{}/organ: there is no organ \"{}\" in the organ files; correct its id",
                                       scenario.path.string(), request.pointer, request.organ));
        continue;
      }
      // Centre and volume of the solid: tetrahedra from the origin to each triangle.
      Eigen::Vector3d moment = Eigen::Vector3d::Zero();
      double volume = 0;
      for (const auto& [a, b, c] : organ->mesh.triangles) {
        const auto& v = organ->mesh.vertices;
        const double tet = v[a].dot(v[b].cross(v[c])) / 6;
        volume += tet;
        moment += tet * 0.25 * (v[a] + v[b] + v[c]);
      }
      target.centre = moment / volume;
      target.radius = std::cbrt(0.75 * volume / std::numbers::pi);
    }
    targets.push_back(target);
  }
  return targets;
}

std::vector<content::Forbidden> build_forbidden(const ScenarioFile& scenario, const std::vector<Organ>& organs,
                                                double spacing, Problems& problems) {
  std::vector<content::Forbidden> forbidden;
  for (std::size_t i = 0; i < scenario.forbidden.size(); ++i) {
    const Organ* organ = find_organ(organs, scenario.forbidden[i]);
    if (organ == nullptr || organ->role == content::SurfaceRole::visual) {
      problems.push_back(fmt::format(
          "{}:/forbidden/{}: {}", scenario.path.string(), i,
          organ == nullptr
              ? fmt::format("there is no organ \"{}\" in the organ files; correct its id", scenario.forbidden[i])
              : fmt::format("\"{}\" is visual, it has no inside; take it out or give it "
                            "another role",
                            scenario.forbidden[i])));
      continue;
    }
    const int body = breathes(scenario, *organ) ? content::kBreathes : body_index(scenario, organ->body);
    const LabelledSolid solid{&organ->mesh, 1, static_cast<std::int8_t>(body)};
    forbidden.push_back({.name = organ->id,
                         .tissue = organ->tissue,
                         .body = body,
                         .inside = voxelise({&solid, 1}, spacing, std::nullopt)});
  }
  return forbidden;
}

bool holds(const physics::TetMesh& mesh, const Eigen::Vector3d& x) {
  return std::ranges::any_of(mesh.tets, [&](const auto& tet) {
    const Eigen::Vector3d& a = mesh.nodes[tet[0]];
    Eigen::Matrix3d edges;
    for (int i = 0; i < 3; ++i) edges.col(i) = mesh.nodes[tet[i + 1]] - a;
    const Eigen::Vector3d weights = edges.inverse() * (x - a);
    return weights.minCoeff() >= 0 && weights.sum() <= 1;
  });
}

/// A target that no needle reaches, or that stays behind when what it seems to lie in moves.
void warn_of_targets_outside(const ScenarioFile& scenario, const std::vector<Organ>& organs,
                             const content::Scene& scene, Problems& warnings) {
  for (std::size_t t = 0; t < scene.targets.size(); ++t) {
    const TargetRequest& request = scenario.targets[t];
    const Eigen::Vector3d& centre = scene.targets[t].centre;
    const Organ* organ = request.organ.empty() ? nullptr : find_organ(organs, request.organ);
    const int body = organ == nullptr ? -1 : body_index(scenario, organ->body);
    const auto warn = [&](const std::string& what) {
      warnings.push_back(fmt::format("{}:{}: its middle at ({:.1f}, {:.1f}, {:.1f}) mm {}", scenario.path.string(),
                                     request.pointer, centre.x() * 1e3, centre.y() * 1e3, centre.z() * 1e3, what));
    };
    const Eigen::Vector3i voxel =
        ((centre.cast<float>() - scene.labels.origin) / scene.labels.spacing).array().round().cast<int>();
    const auto& size = scene.labels.size;
    const bool in_volume = (voxel.array() >= 0).all() && (voxel.array() < size.array()).all();
    const auto index = [&] {
      return static_cast<std::size_t>(voxel.x()) +
             static_cast<std::size_t>(size.x()) *
                 (static_cast<std::size_t>(voxel.y()) +
                  static_cast<std::size_t>(size.y()) * static_cast<std::size_t>(voxel.z()));
    };
    if (!in_volume || scene.labels.labels[index()] == 0) {
      warn("lies outside the patient; move it into an organ");
    } else if (body >= 0 && !holds(scene.bodies[static_cast<std::size_t>(body)].mesh, centre)) {
      warn(fmt::format("lies outside {}, which is to carry it; move it, or name another body", organ->body));
    }
  }
}

/// Steps that need sound input are left out after a problem.
/// @param ids  gets the organ of every surface; may be null
std::optional<content::Scene> scene_of(const std::filesystem::path& path, const LoadProgress& progress,
                                       Problems& problems, Problems& warnings, std::vector<std::string>* ids) {
  const auto report = [&](const std::string& doing, double share) {
    if (progress) progress(doing, share);
  };
  report("reading the scenario", 0);
  const ScenarioFile scenario = read_json(path, read_scenario_file, problems);
  if (!problems.empty() && scenario.path.empty()) return std::nullopt;

  content::Scene scene;
  // Files whose path is wrong were already reported by the scenario.
  if (!scenario.tissues.empty()) {
    content::TissueTable table = read_json(scenario.tissues, content::read_tissues, problems);
    scene.tissues = std::move(table.tissues);
    scene.tissue_table = scenario.tissues;
    scene.tissue_surfaces = std::move(table.surfaces);
    scene.tissue_walls = std::move(table.walls);
  }
  if (!scenario.needle.empty()) scene.needle = read_json(scenario.needle, read_needle, problems);
  if (!scenario.probe.empty()) scene.probe = read_json(scenario.probe, read_probe, problems);
  if (!scenario.motion.empty()) {
    scene.motion = read_json(
        scenario.motion, [](files::JsonFile& file) { return read_motion(file); }, problems, kMotionLimits);
  }
  report("reading the organs", 0.02);
  const std::vector<gltf::GltfScene> files = read_organs(scenario, problems, warnings);
  if (!problems.empty()) return std::nullopt;

  report("checking the surfaces", 0.1);
  std::vector<Organ> organs = build_anatomy(scenario, files, scene.tissues, problems);
  assign_bodies(scenario, organs, problems);
  check_breathing(scenario, organs, problems);
  scene.targets = build_targets(scenario, organs, problems);
  if (!problems.empty()) return std::nullopt;

  for (std::size_t i = 0; i < scenario.bodies.size(); ++i) {
    report("tetrahedralising " + scenario.bodies[i].name,
           0.2 + 0.5 * static_cast<double>(i) / static_cast<double>(scenario.bodies.size()));
    scene.bodies.push_back(
        build_body(scenario.bodies[i], organs, scene.tissues, scenario.path.string(), problems, warnings));
  }
  if (!problems.empty()) return std::nullopt;

  scene.cavities = find_cavities(organs, scene.tissues, scene.bodies, problems);

  report("embedding the surfaces", 0.7);
  for (const Organ& organ : organs) {
    if (ids != nullptr) ids->push_back(organ.id);
    scene.surfaces.push_back(
        build_surface(organ, body_index(scenario, organ.body), breathes(scenario, organ), scene.bodies, problems));
  }
  report("labelling the volume", 0.85);
  scene.labels = build_labels(scenario, organs, scene.tissues, problems);
  scene.forbidden = build_forbidden(scenario, organs, scene.labels.spacing, problems);
  if (!problems.empty()) return std::nullopt;

  scene.name = scenario.name;
  scene.title = scenario.title;
  scene.scenario = scenario.path;
  scene.room_from_patient = scenario.room_from_patient;
  scene.probe.pose = scenario.probe_pose;
  scene.probe.presses = scenario.probe_presses;
  scene.probe.gel = scenario.probe_gel;
  warn_of_targets_outside(scenario, organs, scene, warnings);
  if (const std::string odd = content::odd_probe_placement(scene.probe, scene.labels); !odd.empty()) {
    warnings.push_back(fmt::format("{}:/probe: {}", scenario.path.string(), odd));
  }
  scene.scoring = scenario.scoring;
  scene.pass_mark = scenario.pass_mark;
  scene.camera = scenario.camera;
  scene.rates = scenario.rates;
  scene.coupling = scenario.coupling;
  scene.shaft_friction =
      scenario.shaft_friction == "lugre" ? physics::ShaftFriction::lugre : physics::ShaftFriction::coulomb;
  scene.hand_force = scenario.hand_force;
  scene.start = scenario.start;
  scene.contact_spacing = scenario.contact_spacing;
  scene.damping_time_s = scenario.damping_time_s;
  scene.gravity = scene.room_from_patient.linear().transpose() * Eigen::Vector3d(0, -scenario.gravity, 0);
  scene.contacts = scenario.contacts;
  scene.breathing = scenario.breathing;
  scene.exercise = scenario.exercise;
  report("ready", 1);
  return scene;
}

/// A line each, whatever names the files hold.
void make_lines(Problems& problems) {
  for (std::string& problem : problems) problem = files::one_line(problem);
}

/// Everything load_scene() and validate() do.
std::optional<content::Scene> assemble(const std::filesystem::path& path, const LoadProgress& progress,
                                       Problems& problems, Problems& warnings,
                                       std::vector<std::string>* ids = nullptr) {
  std::optional<content::Scene> scene = scene_of(path, progress, problems, warnings, ids);
  make_lines(problems);
  make_lines(warnings);
  return scene;
}

/// A glTF file on its own: readable, and each annotated organ is what its role asks for.
void validate_gltf(const std::filesystem::path& path, Problems& problems, Problems& warnings) {
  try {
    const gltf::GltfScene file = gltf::read_gltf(path);
    for (const Problems* lines : {&file.warnings, &file.unknown_annotations}) {
      warnings.insert(warnings.end(), lines->begin(), lines->end());
    }
    for (const gltf::GltfOrgan& organ : file.organs) {
      if (organ.organ.role == "ignore" || organ.organ.id.empty()) continue;
      try {
        const std::string place = fmt::format("{}:/{}", path.string(), organ.place);
        (void)(organ.organ.deformable ? mesh::solid_surface(organ.mesh, place)
                                      : mesh::clean_surface(organ.mesh, place));
      } catch (const files::ContentError& error) {
        problems.emplace_back(error.what());
      }
    }
  } catch (const files::ContentError& error) {
    problems.emplace_back(error.what());
  }
}

/// What validate() does with a JSON file: adds problems and warnings, fills in the scene if it is a scenario.
using Check = void (*)(const std::filesystem::path&, Problems&, Problems&, std::optional<content::Scene>&);

template <auto kRead>
void check_file(const std::filesystem::path& path, Problems& problems, Problems&, std::optional<content::Scene>&) {
  read_json(
      path, [](files::JsonFile& file) { return kRead(file); }, problems, kMotionLimits);
}

void check_scenario(const std::filesystem::path& path, Problems& problems, Problems& odd,
                    std::optional<content::Scene>& scene) {
  scene = assemble(path, {}, problems, odd);
}

const std::map<std::string_view, Check> kChecks{
    {"stylet-scenario", check_scenario},
    {"stylet-tissues", check_file<content::read_tissues>},
    {"stylet-needle", check_file<read_needle>},
    {"stylet-probe", check_file<read_probe>},
    {"stylet-procedure", check_file<read_procedure>},
    {"stylet-device", check_file<read_device_profile>},
    {"stylet-calibration", check_file<[](files::JsonFile& file) { return read_calibration(file); }>},
    {"stylet-motion", check_file<[](files::JsonFile& file) {
       RawReports any_frame;
       return read_motion(file, &any_frame);
     }>},
};

}  // namespace

namespace {

content::Scene whole_scene(const std::filesystem::path& scenario, const LoadProgress& progress,
                           std::vector<std::string>* warnings, std::vector<std::string>* organs) {
  Problems problems;
  Problems unwanted;
  std::optional<content::Scene> scene =
      assemble(scenario, progress, problems, warnings != nullptr ? *warnings : unwanted, organs);
  if (!problems.empty()) {
    throw files::ContentError(problems.size() == 1
                                  ? problems.front()
                                  : fmt::format("{} (and {} more; `stylet validate {}` lists them)", problems.front(),
                                                problems.size() - 1, scenario.string()));
  }
  return std::move(*scene);
}

}  // namespace

content::Scene load_scene(const std::filesystem::path& scenario, const LoadProgress& progress,
                          std::vector<std::string>* warnings) {
  return whole_scene(scenario, progress, warnings, nullptr);
}

content::Scene load_scene_with_organs(const std::filesystem::path& scenario, const LoadProgress& progress,
                                      std::vector<std::string>& warnings, std::vector<std::string>& organs) {
  return whole_scene(scenario, progress, &warnings, &organs);
}

std::string format_of(const std::filesystem::path& path) {
  return files::JsonFile(path, kMotionLimits).format();
}

bool is_content_format(std::string_view format) {
  return kChecks.contains(format);
}

std::vector<std::string> validate(const std::filesystem::path& path, std::optional<content::Scene>* scene,
                                  std::vector<std::string>* warnings) {
  Problems problems;
  Problems unwanted;
  Problems& odd = warnings != nullptr ? *warnings : unwanted;
  try {
    const std::string extension = path.extension().string();
    if (extension == ".glb" || extension == ".gltf") {
      validate_gltf(path, problems, odd);
    } else if (const auto found = kChecks.find(format_of(path)); found != kChecks.end()) {
      std::optional<content::Scene> assembled;
      found->second(path, problems, odd, assembled);
      if (scene != nullptr) *scene = std::move(assembled);
    } else {
      std::vector<std::string_view> formats;
      formats.reserve(std::size(kChecks));
      for (const auto& [format, check] : kChecks) formats.push_back(format);
      problems.push_back(fmt::format("{}:/format: names no kind of file; it is one of: {}", path.string(),
                                     fmt::join(formats, ", ")));
    }
  } catch (const files::ContentError& error) {
    problems.emplace_back(error.what());
  }
  return problems;
}

}  // namespace stylet::readers
