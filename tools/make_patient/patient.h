// The default patient: all organs as closed surfaces, and where to put needle and probe.
#pragma once

#include "engine/gltf/gltf_writer.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <string>
#include <vector>

namespace stylet::patient {

using Organ = gltf::AnnotatedSurface;

/// Outer to inner: where two overlap, the later one counts.
std::vector<Organ> make_organs();

/// abdomen.glb. @param colours  of the tissue table
std::vector<std::byte> patient_glb(const gltf::TissueColours& colours);

/// The mesh of the organ "tumour", the smallest one that is contoured.
mesh::TriangleMesh tumour_surface();

/// A probe pose: patient_from_probe, see scene.h (origin on the face, +Z into the body, +X image right, +Y
/// elevation).
struct View {
  std::string name;
  std::string shows;
  Eigen::Vector3d position;
  Eigen::Quaterniond orientation;
};

struct Procedure {
  Eigen::Vector3d entry;   ///< on the skin
  Eigen::Vector3d target;  ///< centre of the tumour
  double target_radius = 0;
  std::vector<View> views;  ///< the first one holds the needle in its image plane
};
Procedure make_procedure();

/// A stylet-procedure, specified in content/organs/README.md.
/// @param organs, target  the glTF file and the node in it
std::string procedure_json(const Procedure& procedure, const std::string& organs = "abdomen.glb",
                           const std::string& target = "tumour");

}  // namespace stylet::patient
