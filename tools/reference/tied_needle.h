// A straight needle tied to a cube of linear tetrahedra at single points, at rest: what the coupling of the loops
// does, by itself, to be held against the resolved needle.
#pragma once

#include "physics/contact/subgrid_compliance.h"
#include "physics/needle/needle.h"
#include "physics/tissue/factorisation.h"
#include "physics/tissue/tissue_model.h"
#include "tools/reference/resolved_needle.h"

#include <Eigen/Core>

#include <array>
#include <vector>

namespace stylet::reference {

/// How the mesh lies about the line y = z = edge / 2.
struct Lattice {
  int nodes_per_edge = 7;
  /// Cells between the line and a line of nodes along y and z; nothing: as a regular mesh has it. Inner nodes are
  /// moved sideways for it, by less than half a cell.
  std::array<double, 2> offset{-1, -1};
  double jitter = 0;  ///< inner nodes moved at random by up to so many cells
};

/// The middle of the cube lies in its cell where R1's needle (y = 47 mm, z = 53 mm of 100) lies in a regular mesh's:
/// nowhere special, and at another place in every mesh.
Lattice lattice_of_r1(int nodes_per_edge);

/// The cube of a resolved needle, meshed with Kuhn tetrahedra and factorised.
class MeshedCube {
public:
  /// @throws std::runtime_error if the stiffness is not positive definite
  MeshedCube(const ResolvedCube& cube, const Lattice& lattice);

  physics::TetPoint locate(const Eigen::Vector3d& x) const;
  physics::SubgridSite site(const physics::TetPoint& point) const;
  /// Displacement of point i per force on point j, m/N [3 points x 3 points].
  Eigen::MatrixXd compliance(const std::vector<physics::TetPoint>& points);
  const ResolvedCube& cube() const { return cube_; }

private:
  ResolvedCube cube_;
  physics::TissueModel model_;
  Eigen::Matrix3Xd rest_;
  physics::SolveWorkspace workspace_;
  physics::StiffnessPattern pattern_;
  physics::Factorisation factor_;
};

/// A straight needle along x, tied at equal distances.
struct TiedNeedle {
  std::vector<physics::TetPoint> points;
  std::vector<double> x;       ///< of the points, m
  double spacing = 0;          ///< length that each stands for, m
  Eigen::MatrixXd compliance;  ///< [3 points x 3 points], m/N
};

/// Through the cube from x = 0 to x = depth at y, z; points in the middles of `count` equal parts.
TiedNeedle tie_needle(MeshedCube& mesh, double y, double z, double depth, int count);

/// Whether the rows get sub-grid compliance.
enum class Subgrid { off, on };

/// Answer of a tied needle.
struct TiedAnswer {
  double stiffness = 0;  ///< force on the hand per displacement of it, N/m
  double condition = 0;  ///< of W + C, infinite where W is singular
};

/// A rigid needle moved along y or along x (rows along that one alone for x, y and z for y).
TiedAnswer rigid_answer(const MeshedCube& mesh, const TiedNeedle& needle, NeedleMotion motion, Subgrid subgrid);

/// The needle of R1 with its base held in direction and moved along y, its tip at the depth of the last part's end;
/// linearised at rest, straight edges.
TiedAnswer flexible_answer(const MeshedCube& mesh, const TiedNeedle& needle, double depth,
                           const physics::NeedleProperties& properties, Subgrid subgrid);

/// What must be added to ln(h / r) of every contact for a rigid needle's stiffness to be `target`: ln alpha.
double fitted_log_alpha(const MeshedCube& mesh, const TiedNeedle& needle, NeedleMotion motion, double target);

/// Displacement of a flat tip per its force, along x, m/N: on the face x = 0, or in its channel.
double tip_answer(MeshedCube& mesh, const Eigen::Vector3d& tip, NeedleMotion motion, Subgrid subgrid);

}  // namespace stylet::reference
