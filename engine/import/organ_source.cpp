#include "engine/import/organ_source.h"

#include "engine/files/error.h"
#include "engine/files/json_reader.h"
#include "engine/files/json_scan.h"
#include "engine/import/obj.h"
#include "engine/import/stl.h"
#include "engine/mesh/surface_mesh.h"

#include <fnmatch.h>

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <string_view>

namespace stylet::import {
namespace {

using files::ContentError;

constexpr std::size_t kFileBytes = 512u << 20;
constexpr std::size_t kMostOrgans = 2000;  // without a request: a folder each
constexpr double kLargestOrgan = 3.0;      // m

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

/// A name that can be an id and the name of a folder, whatever the file says: lower-case letters, digits,
/// underscores.
std::string id_of(std::string_view name) {
  std::string id;
  for (const char c : lower(name)) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0;
    if (plain) {
      id += c;
    } else if (!id.empty() && id.back() != '_') {
      id += '_';
    }
  }
  while (!id.empty() && id.back() == '_') id.pop_back();
  return id.empty() ? "organ" : id.substr(0, 60);
}

/// `pattern` with * and ? against the whole of `text`, without regard to case.
bool fits(const std::string& pattern, const std::string& text) {
  return ::fnmatch(pattern.c_str(), text.c_str(), FNM_CASEFOLD) == 0;
}

SourceFile from_gltf(std::span<const std::byte> bytes, const std::filesystem::path& path, const files::Pulse& pulse) {
  SourceFile file{.path = path, .format = "glTF", .parts = {}, .image = {}, .assumptions = {}, .warnings = {}};
  gltf::GltfScene scene = gltf::read_gltf(bytes, path, {}, pulse);
  for (gltf::GltfOrgan& organ : scene.organs) {
    file.parts.push_back({.name = std::move(organ.name),
                          .place = path.string() + ":/" + organ.place,
                          .mesh = std::move(organ.mesh),
                          .organ = std::move(organ.organ),
                          .tissue = std::move(organ.tissue),
                          .colour = organ.colour});
  }
  file.warnings = std::move(scene.warnings);
  file.warnings.insert(file.warnings.end(), scene.unknown_annotations.begin(), scene.unknown_annotations.end());
  return file;
}

SourceFile from_surfaces(SurfaceFile&& surfaces, const std::filesystem::path& path, const std::string& format,
                         const SourceSettings& settings) {
  SourceFile file{.path = path, .format = format, .parts = {}, .image = {}, .assumptions = {}, .warnings = {}};
  const Axes axes = settings.axes.value_or(surfaces.axes.value_or(Axes::lps));
  const char* name = axes == Axes::lps ? "LPS" : axes == Axes::ras ? "RAS" : "patient";
  const double unit = settings.metres_per_unit.value_or(1e-3);
  const char* origin = settings.axes ? "as asked" : surfaces.axes ? "as the file says" : "assumed; --axes changes it";
  file.assumptions.push_back(fmt::format("axes {} ({})", name, origin));
  file.assumptions.push_back(fmt::format("one unit is {:g} mm ({})", unit * 1e3,
                                         settings.metres_per_unit ? "as asked" : "assumed; --unit changes it"));
  const Eigen::Affine3d patient = patient_from_file(axes, unit);
  Eigen::AlignedBox3d box;
  for (SourceSurface& surface : surfaces.surfaces) {
    surface.name = files::one_line(surface.name);
    for (Eigen::Vector3d& vertex : surface.mesh.vertices) box.extend(vertex = patient * vertex);
    file.parts.push_back({.name = surface.name,
                          .place = fmt::format("{}:{}", path.string(), surface.name),
                          .mesh = std::move(surface.mesh),
                          .organ = {},
                          .tissue = {}});
  }
  file.warnings = std::move(surfaces.warnings);
  if (!box.isEmpty() && box.sizes().maxCoeff() > kLargestOrgan) {
    file.warnings.push_back(fmt::format("{}: is {:.3g} m wide: are its numbers millimetres? --unit mm", path.string(),
                                        box.sizes().maxCoeff()));
  }
  return file;
}

SourceFile from_labels(LabelImage&& image, const std::filesystem::path& path) {
  SourceFile file{.path = path, .format = "NIfTI", .parts = {}, .image = {}, .assumptions = {}, .warnings = {}};
  std::set<std::string> used;
  for (const auto& [label, voxels] : image.counts()) {
    if (label == 0) continue;  // background
    const auto named = image.names.find(label);
    const std::string name = named != image.names.end() && used.insert(named->second).second
                                 ? named->second
                                 : fmt::format("label_{}", label);
    file.parts.push_back({.name = name,
                          .place = fmt::format("{}:{}", path.string(), name),
                          .mesh = {},
                          .organ = {},
                          .tissue = {},
                          .label = label});
  }
  if (file.parts.empty()) throw ContentError(path.string() + ": every voxel is background (0)");
  file.warnings = std::move(image.warnings);
  file.image = std::move(image);
  return file;
}

std::string names_of(const std::vector<SourceFile>& files) {
  std::string names;
  for (const SourceFile& file : files) {
    for (const SourcePart& part : file.parts) {
      if (names.size() > 300) return names + ", ...";
      names += (names.empty() ? "" : ", ") + part.name;
    }
  }
  return names;
}

/// Ids of the annotated parts that are boundaries.
std::set<std::string> boundary_ids(const SourceFile& file) {
  std::set<std::string> ids;
  for (const SourcePart& part : file.parts) {
    const bool boundary = part.organ.role.empty() || part.organ.role == "boundary";
    if (boundary && !part.organ.id.empty()) ids.insert(id_of(part.organ.id));
  }
  return ids;
}

/// Which organ an annotated part belongs to.
OrganRequest by_annotation(const SourcePart& part, const std::set<std::string>& boundaries) {
  OrganRequest request{.id = id_of(part.organ.id), .patterns = {}};
  if (part.organ.role != "region" && part.organ.role != "vessel" && part.organ.role != "target") return request;
  request.role = part.organ.role;
  if (!part.organ.body.empty()) request.body = id_of(part.organ.body);
  if (boundaries.contains(request.id)) {
    if (request.body.empty()) request.body = request.id;
    request.id += "_" + request.role;
  }
  return request;
}

}  // namespace

SourceFile read_source(const std::filesystem::path& path, const SourceSettings& settings, const files::Pulse& pulse) {
  const std::string text = files::read_file(path, kFileBytes);
  const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
  const std::string ending = lower(path.extension().string());
  const std::size_t first = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  SourceFile file;
  if (text.starts_with("glTF") || (first != std::string::npos && text[first] == '{')) {
    file = from_gltf(bytes, path, pulse);
  } else if (looks_like_nifti(bytes)) {
    file = from_labels(read_nifti_labels(bytes, path, {}, pulse), path);
  } else if (looks_like_stl(bytes) || ending == ".stl") {  // by its name: to hear what is wrong with it
    file = from_surfaces(read_stl(bytes, path, {}, pulse), path, "STL", settings);
  } else if (ending == ".obj" || text.starts_with("v ") || text.find("\nv ") != std::string::npos) {
    file = from_surfaces(read_obj(bytes, path, {}, pulse), path, "OBJ", settings);
  } else {
    throw ContentError(path.string() + ": is neither glTF, STL, OBJ nor NIfTI; export it as one of these");
  }
  return file;
}

std::vector<OrganParts> assign_parts(const std::vector<SourceFile>& files, const std::vector<OrganRequest>& requests,
                                     const files::Pulse& pulse) {
  std::vector<OrganParts> organs;
  std::map<std::string, std::size_t> index;
  const auto add = [&](const SourceFile& file, const OrganRequest& request, const SourcePart& part) {
    const std::string& id = request.id;
    const bool of_several_files = request.of_several_files;
    const auto [found, is_new] = index.try_emplace(id, organs.size());
    if (is_new) organs.push_back({.id = id, .file = &file, .parts = {}, .role = request.role, .body = request.body});
    if (organs.size() > kMostOrgans && requests.empty()) {
      throw ContentError(fmt::format("{}: {} parts make more than {} organs; choose some with --organ, or join them",
                                     file.path.string(), file.parts.size(), kMostOrgans));
    }
    OrganParts& organ = organs[found->second];
    if (organ.file != &file && of_several_files && !organ.file->image && !file.image) {
      const auto& others = organ.other_files;
      if (std::find(others.begin(), others.end(), &file) == others.end()) organ.other_files.push_back(&file);
    } else if (organ.file != &file) {
      throw ContentError(
          fmt::format("organ {}: has parts in {} and in {}; import one file at a time, or tell them apart "
                      "with --organ",
                      id, organ.file->path.string(), file.path.string()));
    }
    organ.parts.push_back(&part);
  };
  for (const OrganRequest& request : requests) {
    for (const std::string& pattern : request.patterns) {
      bool fitted = false;
      for (const SourceFile& file : files) {
        for (const SourcePart& part : file.parts) {
          pulse(64);
          const bool by_number = part.label >= 0 && fits(pattern, fmt::format("label_{}", part.label));
          if (!by_number && !fits(pattern, part.name)) continue;
          add(file, request, part);
          fitted = true;
        }
      }
      if (!fitted) {
        throw ContentError(
            fmt::format("organ {}: no part is called \"{}\"; there are {}", request.id, pattern, names_of(files)));
      }
    }
  }
  if (!requests.empty()) return organs;

  for (const SourceFile& file : files) {
    const bool annotated = std::any_of(file.parts.begin(), file.parts.end(),
                                       [](const SourcePart& part) { return !part.organ.id.empty(); });
    const std::set<std::string> boundaries = boundary_ids(file);
    std::vector<const SourcePart*> patches;
    for (const SourcePart& part : file.parts) {
      pulse(64);
      if (annotated) {
        if (!part.organ.id.empty() && part.organ.role != "ignore") add(file, by_annotation(part, boundaries), part);
        continue;
      }
      bool whole = part.label >= 0;
      if (!whole) {
        try {
          mesh::solid_surface(part.mesh, part.place, pulse);
          whole = true;
        } catch (const ContentError&) {
          whole = false;  // a patch of something
        }
      }
      if (whole) {
        add(file, {.id = id_of(part.name), .patterns = {}}, part);
      } else {
        patches.push_back(&part);
      }
    }
    for (const SourcePart* part : patches) {
      add(file, {.id = id_of(file.path.stem().string()), .patterns = {}}, *part);
    }
  }
  return organs;
}

}  // namespace stylet::import
