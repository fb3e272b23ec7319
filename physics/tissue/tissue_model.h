// A deformable body as the solvers see it: everything that never changes after load.
#pragma once

#include "physics/messages/material.h"
#include "physics/tissue/closest_rotation.h"
#include "physics/tissue/strain_law.h"
#include "physics/tissue/tet_mesh.h"
#include "physics/tissue/tet_topology.h"

#include <Eigen/Core>

#include <array>
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

/// TetRest of four tetrahedra side by side: what a simulation step reads of them.
struct TetLanes {
  LaneMatrix gradients;  ///< [axis][node - 1], 1/m
  Lanes volume;          ///< m^3
  Lanes lambda;          ///< Pa
  Lanes mu;              ///< Pa
};

/// A run of tetrahedra and the nodes that they may have. Forces are summed run by run, then over the runs.
struct TetRun {
  int begin = 0;  ///< a multiple of eight
  int end = 0;
  int first_node = 0;
  int end_node = 0;
};

/// Rest shape and material of a quadratic tetrahedron (eq. 42); of its four points one a lane.
struct QuadraticRest : StrainLaw, LayerLaw {
  std::array<int, 10> nodes{};                     ///< corners, then the middles of kTetEdges
  std::array<int, 6> inner{};                      ///< ends of the inner diagonal, and the ring around it
  LaneMatrix natural{};                            ///< d xi_k / dX, [k][axis], 1/m (eq. 42b)
  std::array<Lanes, 2> tets{};                     ///< tet_determinants() at rest, m^3
  Eigen::Array4d volume = Eigen::Array4d::Zero();  ///< of a point, m^3
  Eigen::Array4d mu = Eigen::Array4d::Zero();      ///< shear modulus, of layers that across them, Pa
  double lambda = 0;                               ///< first Lame parameter, Pa
};

/// A triangle of a capsule (eq. 49).
struct MembraneTriangle {
  std::array<int, 3> nodes{};             ///< counter-clockwise from outside
  Eigen::Matrix<double, 3, 2> frame;      ///< its plane at rest, orthonormal
  Eigen::Matrix<double, 2, 3> gradients;  ///< column a: of the shape function of node a in that plane, 1/m
  double shear_energy = 0;                ///< shear modulus times volume, J
};

/// Constant model of a body; shared, read-only, by the simulation loop and the factorisation worker.
/// Degrees of freedom are those of the free nodes only: DOF 3 * free_index[node] + axis.
struct TissueModel {
  /// @param tet_materials  one a tetrahedron
  /// @param fixed_nodes    held at rest (Dirichlet), ascending, at least three
  /// @param element        quadratic: of each eight tetrahedra, as refined() makes them
  /// @param capsule        Young's modulus times thickness of a membrane over the whole surface, N/m; 0: none
  /// @throws std::invalid_argument if sizes disagree, an index is out of range, a tetrahedron is not positively
  ///         oriented, a material is out of range, or the tetrahedra make no quadratic elements
  TissueModel(TetMesh rest_mesh, std::span<const ElasticMaterial> tet_materials, std::span<const int> fixed_nodes,
              double damping_time_s = 0, Element element = Element::linear, double capsule = 0);

  int node_count() const { return static_cast<int>(mesh.nodes.size()); }
  int tet_count() const { return static_cast<int>(mesh.tets.size()); }
  int dof_count() const { return 3 * free_node_count; }
  bool is_quadratic() const { return !quadratics.empty(); }
  bool stiffens() const { return stiffens_; }  ///< some point does (eq. 45)
  bool relaxes() const { return relaxes_; }    ///< some point does (eq. 46)
  /// Where strain is measured: tetrahedra, or four points of each quadratic element.
  int point_count() const { return is_quadratic() ? 4 * static_cast<int>(quadratics.size()) : tet_count(); }

  /// Of what remembers strain, four points each: quadratic elements, or four tetrahedra.
  std::size_t memory_count() const { return is_quadratic() ? quadratics.size() : laws.size(); }

  TetMesh mesh;
  TetTopology topology;
  std::vector<ElasticMaterial> materials;  ///< [tets]
  std::vector<TetRest> tets;               ///< [tets]
  std::vector<TetLanes> lanes;             ///< [tets / 4] of linear elements
  std::vector<StrainLaw> laws;             ///< [tets / 4, rounded up] of linear elements; empty: none has one
  std::vector<TetRun> runs;                ///< all tetrahedra; one where they are few
  std::vector<QuadraticRest> quadratics;   ///< [tets / 8]; empty: the tetrahedra themselves are the elements
  std::vector<MembraneTriangle> membrane;  ///< empty: no capsule
  std::vector<int> free_index;             ///< [nodes] index among the free nodes, -1 where fixed
  int free_node_count = 0;
  double damping_time_s = 0;  ///< Kelvin-Voigt: B = damping_time K (eq. 5)
  // Nodes -> incident tetrahedra, compressed: incident_tets[incident_start[n] .. incident_start[n+1])
  std::vector<int> incident_start;
  std::vector<int> incident_tets;
  std::vector<NodeSurroundings> surroundings;  ///< [nodes]

private:
  void find_laws();
  void find_surroundings(double capsule);
  void find_runs();
  bool stiffens_ = false;
  bool relaxes_ = false;
};

/// Rest positions as the loops carry them [3 x nodes], m.
Eigen::Matrix3Xd rest_positions(const TissueModel& model);

/// The free DOFs of `all` [3 x nodes]; where that is empty `free` [free DOFs] stays as it is.
void take_free(const TissueModel& model, const Eigen::Matrix3Xd& all, Eigen::VectorXd& free);
/// target += scale * x, x over the free DOFs, target over all nodes.
void add_free(const TissueModel& model, const Eigen::VectorXd& x, double scale, Eigen::Matrix3Xd& target);

}  // namespace stylet::physics
