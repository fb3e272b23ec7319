// A deformable body as the solvers see it: everything that never changes after load.
#pragma once

#include "physics/tissue/tet_mesh.h"
#include "physics/tissue/tet_topology.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace stylet::physics {

/// Rest shape and material of one tetrahedron (physics/README.md eq. 1).
struct TetRest {
  Eigen::Matrix<double, 3, 4> gradients;  ///< column a: gradient of the shape function of node a in rest space, 1/m
  double volume = 0;                      ///< m^3
  double lambda = 0;                      ///< first Lame parameter, Pa
  double mu = 0;                          ///< shear modulus, Pa
};

/// Constant model of a body; shared, read-only, by the simulation loop and the factorisation worker.
/// Degrees of freedom are those of the free nodes only: DOF 3 * free_index[node] + axis.
struct TissueModel {
  /// @param tet_materials  one a tetrahedron
  /// @param fixed_nodes    held at rest (Dirichlet), ascending, at least three
  /// @throws std::invalid_argument if sizes disagree, an index is out of range, a tetrahedron is not positively
  ///         oriented, or a material is out of range
  TissueModel(TetMesh rest_mesh, std::span<const ElasticMaterial> tet_materials, std::span<const int> fixed_nodes,
              double damping_time_s = 0);

  int node_count() const { return static_cast<int>(mesh.nodes.size()); }
  int tet_count() const { return static_cast<int>(mesh.tets.size()); }
  int dof_count() const { return 3 * free_node_count; }

  TetMesh mesh;
  TetTopology topology;
  std::vector<ElasticMaterial> materials;  ///< [tets]
  std::vector<TetRest> tets;               ///< [tets]
  std::vector<int> free_index;             ///< [nodes] index among the free nodes, -1 where fixed
  int free_node_count = 0;
  double damping_time_s = 0;  ///< Kelvin-Voigt: B = damping_time K (eq. 5)
  // Nodes -> incident tetrahedra, compressed: incident_tets[incident_start[n] .. incident_start[n+1])
  std::vector<int> incident_start;
  std::vector<int> incident_tets;
  std::vector<NodeSurroundings> surroundings;  ///< [nodes]

private:
  void find_surroundings();
};

/// Rest positions as the loops carry them [3 x nodes], m.
Eigen::Matrix3Xd rest_positions(const TissueModel& model);

}  // namespace stylet::physics
