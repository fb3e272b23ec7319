#include "engine/import/gmsh.h"

#include "engine/files/child_process.h"
#include "engine/files/error.h"
#include "engine/files/json_reader.h"

#include <fcntl.h>
#include <unistd.h>

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <locale>
#include <map>
#include <optional>
#include <sstream>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace stylet::import {
namespace {

using files::ContentError;

constexpr double kUnit = 1e-3;  // m; Gmsh's tolerances suit lengths of 1 to 1000
constexpr std::size_t kMeshFileBytes = 512u << 20;
constexpr std::size_t kMostElements = 20'000'000;
constexpr std::chrono::milliseconds kPoll{50};

class WorkFolder {
public:
  explicit WorkFolder(const std::string& where) {
    std::string name = (std::filesystem::temp_directory_path() / "stylet-gmsh-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      throw ContentError(fmt::format("{}: no folder for Gmsh: {}: {}", where, name, std::strerror(errno)));
    }
    path_ = name;
  }
  ~WorkFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;

  std::string file(const char* name) const { return (path_ / name).string(); }
  void write(const char* name, const std::string& text) const { std::ofstream(path_ / name) << text; }

private:
  std::filesystem::path path_;
};

std::string stl_text(const mesh::TriangleMesh& surface) {
  std::string text = "solid organ\n";
  const auto out = std::back_inserter(text);
  for (const auto& t : surface.triangles) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const std::uint32_t v : t) {
      const Eigen::Vector3d x = surface.vertices[v] / kUnit;
      fmt::format_to(out, "vertex {:.9g} {:.9g} {:.9g}\n", x.x(), x.y(), x.z());
    }
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid organ\n";
}

/// The surface is taken as smooth everywhere and parametrised, so that it can be meshed anew.
std::string script(double cell) {
  return fmt::format(
      "Merge \"organ.stl\";\n"
      "ClassifySurfaces{{Pi, 1, 1, Pi}};\n"
      "CreateGeometry;\n"
      "s() = Surface{{:}};\n"
      "Surface Loop(1) = s();\nVolume(1) = {{1}};\nPhysical Volume(1) = {{1}};\n"
      "Mesh.MeshSizeFromPoints = 0;\nMesh.MeshSizeFromCurvature = 0;\nMesh.MeshSizeExtendFromBoundary = 0;\n"
      "Mesh.MeshSizeMin = {0:.9g};\nMesh.MeshSizeMax = {0:.9g};\n"
      "Mesh.Algorithm = 6;\nMesh.Optimize = 1;\nMesh.RandomSeed = 1;\n",
      cell / kUnit);
}

/// The last line of Gmsh's log that names an error.
std::string last_error(const std::string& log) {
  std::ifstream in(log);
  std::string reason = "no reason given";
  for (std::string line; std::getline(in, line);) {
    const std::size_t at = line.find("Error   : ");
    const bool rule = line.find("---") != std::string::npos || line.find("summary") != std::string::npos;
    if (at == 0 && !rule) reason = line.substr(10, 200);
  }
  return reason;
}

void run(const WorkFolder& folder, const GmshSettings& settings, const std::function<void()>& still_wanted) {
  const std::string geo = folder.file("organ.geo"), msh = folder.file("organ.msh"), log = folder.file("log");
  const std::vector<std::string> command{settings.program, "-3", geo, "-format", "msh2", "-o", msh, "-nt", "1"};
  const int log_file = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  std::optional<files::ChildProcess> child;
  try {
    child.emplace(files::ChildSettings{.command = command, .output = log_file, .messages = log_file});
  } catch (const std::system_error& error) {
    close(log_file);
    throw ContentError(fmt::format("{}: cannot start '{}' ({}); install gmsh, or leave out --mesher gmsh",
                                   settings.where, settings.program, error.code().message()));
  }
  close(log_file);
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(settings.seconds);
  std::optional<int> status;
  while (!(status = child->ended())) {
    if (std::chrono::steady_clock::now() > end) {
      throw ContentError(fmt::format("{}: '{}' was stopped after {:g} s; choose a larger --cell", settings.where,
                                     settings.program, settings.seconds));
    }
    still_wanted();
    std::this_thread::sleep_for(kPoll);
  }
  if (*status != 0) {
    throw ContentError(fmt::format("{}: '{}' failed: {}; leave out --mesher gmsh", settings.where, settings.program,
                                   last_error(log)));
  }
}

double volume6(const physics::TetMesh& mesh, const std::array<int, 4>& t) {
  const auto node = [&](std::size_t c) { return mesh.nodes[t[c]]; };
  return (node(1) - node(0)).dot((node(2) - node(0)).cross(node(3) - node(0)));
}

}  // namespace

physics::TetMesh read_msh(std::string_view text, const std::string& where) {
  const auto broken = [&](const char* what) {
    return ContentError(fmt::format("{}: the mesh that Gmsh left {}; try another --cell", where, what));
  };
  std::istringstream in{std::string(text)};
  in.imbue(std::locale::classic());
  const auto section = [&](const char* name) {
    for (std::string line; std::getline(in, line);) {
      if (line.starts_with(name)) return;
    }
    throw broken("is broken off");
  };
  const auto count = [&]() {
    long long n = 0;
    if (!(in >> n) || n < 0 || n > static_cast<long long>(kMostElements)) throw broken("has a wrong count");
    return static_cast<std::size_t>(n);
  };
  double version = 0;
  int binary = 1;
  section("$MeshFormat");
  if (!(in >> version >> binary) || version < 2 || version >= 3 || binary != 0) throw broken("is no MSH 2 text");
  section("$Nodes");
  std::map<long long, Eigen::Vector3d> nodes;
  for (std::size_t n = count(); n > 0; --n) {
    long long id = 0;
    Eigen::Vector3d x;
    if (!(in >> id >> x.x() >> x.y() >> x.z()) || !x.allFinite()) throw broken("is broken off");
    nodes[id] = x;
  }
  section("$Elements");
  physics::TetMesh mesh;
  std::map<long long, int> index;
  const std::size_t elements = count();
  std::string line;
  std::getline(in, line);
  for (std::size_t e = 0; e < elements; ++e) {
    if (!std::getline(in, line)) throw broken("is broken off");
    std::istringstream words(line);
    long long id = 0, kind = 0, tags = 0, tag = 0;
    words >> id >> kind >> tags;
    if (!words || tags < 0 || tags > 100) throw broken("is broken off");
    if (kind != 4) continue;  // of Gmsh: a tetrahedron of four nodes
    for (; tags > 0; --tags) words >> tag;
    std::array<int, 4> tet{};
    for (int& corner : tet) {
      words >> id;
      const auto node = nodes.find(id);
      if (!words || node == nodes.end()) throw broken("names a node that is not there");
      const auto [at, is_new] = index.try_emplace(id, static_cast<int>(mesh.nodes.size()));
      if (is_new) mesh.nodes.push_back(node->second);
      corner = at->second;
    }
    const double volume = volume6(mesh, tet);
    if (volume == 0) throw broken("has a flat tetrahedron");
    if (volume < 0) std::swap(tet[2], tet[3]);
    mesh.tets.push_back(tet);
  }
  if (mesh.tets.empty()) throw broken("has no tetrahedra");
  return mesh;
}

physics::TetMesh gmsh_tetrahedra(const mesh::TriangleMesh& surface, const GmshSettings& settings,
                                 const std::function<void()>& still_wanted) {
  const WorkFolder folder(settings.where);
  folder.write("organ.stl", stl_text(surface));
  folder.write("organ.geo", script(settings.cell));
  run(folder, settings, still_wanted);
  const std::filesystem::path msh = folder.file("organ.msh");
  if (!std::filesystem::exists(msh)) {
    throw ContentError(fmt::format("{}: '{}' left no mesh: {}; leave out --mesher gmsh", settings.where,
                                   settings.program, last_error(folder.file("log"))));
  }
  physics::TetMesh mesh = read_msh(files::read_file(msh, kMeshFileBytes), settings.where);
  for (Eigen::Vector3d& node : mesh.nodes) node *= kUnit;
  return mesh;
}

}  // namespace stylet::import
