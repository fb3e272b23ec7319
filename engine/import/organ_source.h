// What an author gives: files of surfaces or labels, and which parts of them make which organ.
#pragma once

#include "engine/files/pulse.h"
#include "engine/gltf/gltf.h"
#include "engine/import/nifti.h"
#include "engine/import/source_surface.h"

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace stylet::import {

/// A part of a file: a glTF node, an STL solid, an OBJ object, or one label of a volume.
struct SourcePart {
  std::string name;
  std::string place;            ///< file:place, for messages
  mesh::TriangleMesh mesh;      ///< patient frame, m; not welded; empty for a label
  gltf::OrganAnnotation organ;  ///< glTF extras
  std::optional<content::TissueAnnotation> tissue;
  std::array<float, 4> colour{0.8F, 0.8F, 0.8F, 1.0F};
  int label = -1;  ///< of `image`
};

struct SourceFile {
  std::filesystem::path path;
  std::string format;  ///< glTF, STL, OBJ, NIfTI
  std::vector<SourcePart> parts;
  std::optional<LabelImage> image;
  std::vector<std::string> assumptions;  ///< about unit and axes, one line each
  std::vector<std::string> warnings;     ///< one line each
};

/// How files without unit and axes of their own are meant. STL and OBJ: what they say, else this; glTF has both.
struct SourceSettings {
  std::optional<Axes> axes;                 ///< absent: as the file says, else LPS
  std::optional<double> metres_per_unit{};  ///< absent: millimetres
};

/// Reads a file, whatever its name ends with. @throws files::ContentError
/// @param pulse  called often meanwhile; may throw to end it
SourceFile read_source(const std::filesystem::path& path, const SourceSettings& settings,
                       const files::Pulse& pulse = {});

/// Parts that make one organ.
struct OrganRequest {
  std::string id;
  std::vector<std::string> patterns;  ///< of part names: fnmatch, `*` and `?`; the case does not count
  bool of_several_files = false;      ///< its surfaces may come from more than one file, in one frame
  std::string role = "boundary";
  std::string body{};  ///< id of the organ that carries it; empty: none
};

/// An organ to be made.
struct OrganParts {
  std::string id;
  const SourceFile* file = nullptr;
  std::vector<const SourcePart*> parts;
  std::vector<const SourceFile*> other_files{};  ///< of a request that allows them: surfaces
  std::string role = "boundary";
  std::string body{};  ///< id of the organ that carries it; empty: none

  bool lies_inside() const { return role == "region" || role == "vessel" || role == "target"; }
};

/// Which parts make which organ. Ids that come from a file become lower-case letters, digits and underscores. With
/// requests: those, in their order. Without: parts with the same extras.organ.id belong together, but regions,
/// vessels and targets apart from a boundary of that id, which then carries them as ID_ROLE; if no part has one,
/// parts that are closed by themselves are an organ each, and the others of their file one together, named after the
/// file.
/// @throws files::ContentError  a pattern that fits nothing, with the names there are; an organ in two files
/// where that was not allowed, or one of them a volume; without requests: more than 2000 organs
/// @param pulse  called often meanwhile; may throw to end it
std::vector<OrganParts> assign_parts(const std::vector<SourceFile>& files, const std::vector<OrganRequest>& requests,
                                     const files::Pulse& pulse = {});

}  // namespace stylet::import
