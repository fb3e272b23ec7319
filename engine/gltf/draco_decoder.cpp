#include "engine/gltf/draco_decoder.h"

#include "engine/files/error.h"
#include "engine/files/isolated_process.h"
#include "engine/gltf/draco_request.h"

#include <fmt/format.h>

#include <system_error>

namespace stylet::gltf {
namespace {

std::size_t plain_bytes(const DracoMesh& mesh) {
  return 12 * mesh.vertices + 4 * mesh.indices;
}

void append(std::vector<std::byte>& out, std::span<const std::byte> bytes) {
  out.insert(out.end(), bytes.begin(), bytes.end());
}

}  // namespace

std::filesystem::path draco_decoder() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / "stylet-draco";
  return std::filesystem::is_regular_file(program, error) ? program : std::filesystem::path();
}

std::vector<std::byte> decode_draco(const std::vector<DracoMesh>& meshes, const std::string& file) {
  const auto fail = [&](const DracoMesh& mesh, const std::string& what) {
    throw files::ContentError(fmt::format("{}:/{}: {}", file, mesh.place, what));
  };
  const auto program = draco_decoder();
  if (program.empty()) fail(meshes.front(), kWithoutDraco);
  files::IsolationLimits limits;
  std::vector<std::byte> input;
  for (const DracoMesh& mesh : meshes) {
    const DracoRequest request{.position_id = mesh.position_id,
                               .vertices = static_cast<std::uint32_t>(mesh.vertices),
                               .indices = static_cast<std::uint32_t>(mesh.indices),
                               .bytes = static_cast<std::uint32_t>(mesh.compressed.size())};
    append(input, std::as_bytes(std::span(&request, 1)));
    append(input, mesh.compressed);
    limits.output_bytes += plain_bytes(mesh);
  }
  files::IsolatedResult result = files::run_isolated(program, input, limits);
  if (result.status == 0 && result.output.size() == limits.output_bytes) return std::move(result.output);
  if (result.status == 127) fail(meshes.front(), program.string() + " cannot be started; build or install it again");
  // The first mesh that did not arrive whole.
  std::size_t culprit = 0;
  for (std::size_t bytes = result.output.size(); culprit + 1 < meshes.size(); ++culprit) {
    if (bytes < plain_bytes(meshes[culprit])) break;
    bytes -= plain_bytes(meshes[culprit]);
  }
  fail(meshes[culprit], result.status == kDracoNotAsDeclared
                            ? "its Draco data hold other counts than its accessors declare; export it again"
                            : "its Draco data are broken; copy the file or export it again");
  return {};
}

}  // namespace stylet::gltf
