// KHR_draco_mesh_compression: primitives become plain ones before anything else looks at them.
#pragma once

#include "engine/gltf/gltf.h"
#include "engine/gltf/gltf_buffers.h"

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace stylet::gltf {

/// Gives every primitive whose triangles only Draco holds accessors of its own for the decompressed ones, which the
/// reader then checks like any others.
/// @param document          the file as it is
/// @param[in,out] geometry  the same meshes, accessors and views without extensions, as the parser will get them
/// @param[in,out] buffers   get the decompressed bytes
/// @throws ContentError     broken, not as its accessors declare, over the limits; or a build without Draco
void decompress_draco(const files::JsonFile& document, nlohmann::json& geometry, GltfBuffers& buffers,
                      const GltfLimits& limits);

}  // namespace stylet::gltf
