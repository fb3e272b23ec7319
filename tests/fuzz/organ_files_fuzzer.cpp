// STL, OBJ and NIfTI from memory: sound surfaces and labels, or one line.
#include "engine/files/error.h"
#include "engine/import/nifti.h"
#include "engine/import/obj.h"
#include "engine/import/stl.h"
#include "tests/fuzz/claim.h"
#include "tests/fuzz/libfuzzer.h"

#include <algorithm>
#include <span>

namespace {

using namespace stylet;

constexpr import::SurfaceLimits kSurfaces{.file_bytes = 1u << 20, .elements = 100'000, .surfaces = 100};
constexpr import::NiftiLimits kVolumes{.file_bytes = 1u << 20, .voxels = 4'000'000};

void claim_sound(const import::SurfaceFile& file) {
  fuzz::claim(!file.surfaces.empty() && file.surfaces.size() <= kSurfaces.surfaces, "surfaces are limited");
  std::size_t triangles = 0;
  for (const import::SourceSurface& surface : file.surfaces) {
    fuzz::claim_one_line(surface.name);
    for (const Eigen::Vector3d& v : surface.mesh.vertices) {
      fuzz::claim(v.allFinite() && v.cwiseAbs().maxCoeff() <= kSurfaces.coordinate, "vertices are in range");
    }
    for (const auto& t : surface.mesh.triangles) {
      fuzz::claim(std::ranges::max(t) < surface.mesh.vertices.size(), "indices are in range");
    }
    triangles += surface.mesh.triangles.size();
  }
  fuzz::claim(triangles <= kSurfaces.elements, "triangles are limited");
}

void claim_sound(const import::LabelImage& image) {
  fuzz::claim((image.size.array() > 0).all(), "a volume has voxels");
  fuzz::claim(image.labels.size() == static_cast<std::size_t>(image.size.cast<std::int64_t>().prod()),
              "every voxel has a label");
  fuzz::claim(image.labels.size() <= kVolumes.voxels, "voxels are limited");
  fuzz::claim(image.patient_from_voxel.matrix().allFinite(), "voxels have a place");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  try {
    if (import::looks_like_nifti(bytes)) {
      claim_sound(import::read_nifti_labels(bytes, "fuzz.nii", kVolumes));
    } else if (import::looks_like_stl(bytes)) {
      claim_sound(import::read_stl(bytes, "fuzz.stl", kSurfaces));
    } else {
      claim_sound(import::read_obj(bytes, "fuzz.obj", kSurfaces));
    }
  } catch (const files::ContentError& error) {
    fuzz::claim_one_line(error.what());
  }
  return 0;
}
