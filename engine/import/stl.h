// Surfaces from STL, binary and text.
#pragma once

#include "engine/files/pulse.h"
#include "engine/import/source_surface.h"

#include <cstddef>
#include <filesystem>
#include <span>

namespace stylet::import {

/// Whether these bytes are an STL: a binary one by its length, a text one by its first words.
bool looks_like_stl(std::span<const std::byte> bytes);

/// Every solid of the file (a binary one has one, named after the file). Normals are ignored, degenerate triangles
/// dropped. `name` stands for the file in messages.
/// @throws files::ContentError  truncated, over the limits, not finite, not a number
/// @param pulse  called often meanwhile; may throw to end it
SurfaceFile read_stl(std::span<const std::byte> bytes, const std::filesystem::path& name,
                     const SurfaceLimits& limits = {}, const files::Pulse& pulse = {});

}  // namespace stylet::import
