// Meshes compressed by Draco, decoded by a program of its own (tools/draco): the decoder is not made for hostile
// input, and Debian's library brings a tinygltf that takes the place of ours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace stylet::gltf {

/// One compressed mesh, and how much of it is declared outside.
struct DracoMesh {
  std::string place;  ///< of the primitive, for messages
  std::span<const std::byte> compressed;
  std::uint32_t position_id = 0;  ///< unique id of the positions among the attributes of Draco
  std::size_t vertices = 0;
  std::size_t indices = 0;
};

/// The program that decodes, beside this one; empty where it was not built (STYLET_DRACO).
std::filesystem::path draco_decoder();

/// What to do about a compressed file without it.
inline constexpr const char* kWithoutDraco =
    "KHR_draco_mesh_compression is not in this build; decompress the file (gltf-transform cp IN OUT), or build with "
    "-DSTYLET_DRACO=ON";

/// Bytes of the plain meshes one after the other: positions as three floats, then indices of 32 bits, neither checked
/// but for their number. @throws ContentError  "file:/place: what" where one does not decode to what is declared
std::vector<std::byte> decode_draco(const std::vector<DracoMesh>& meshes, const std::string& file);

}  // namespace stylet::gltf
