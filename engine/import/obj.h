// Surfaces from Wavefront OBJ.
#pragma once

#include "engine/files/pulse.h"
#include "engine/import/source_surface.h"

#include <cstddef>
#include <filesystem>
#include <span>

namespace stylet::import {

/// Every object (o) or group (g) with faces; a file without either is one surface, named after the file. Polygons are
/// cut into fans; normals, texture coordinates, lines, points and materials are ignored.
/// @throws files::ContentError  syntax, an index that is not there, over the limits, not finite; with the line
/// @param pulse  called often meanwhile; may throw to end it
SurfaceFile read_obj(std::span<const std::byte> bytes, const std::filesystem::path& name,
                     const SurfaceLimits& limits = {}, const files::Pulse& pulse = {});

}  // namespace stylet::import
