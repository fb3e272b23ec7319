#include "tools/reference/tied_needle.h"

#include "physics/contact/delassus.h"
#include "physics/contact/shaft.h"
#include "tools/reference/dense_algebra.h"
#include "tools/reference/kuhn_box.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace stylet::reference {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

physics::TissueModel mesh_cube(const ResolvedCube& cube, const Lattice& lattice) {
  const int cells = lattice.nodes_per_edge - 1;
  const double cell = cube.edge / cells;
  physics::TetMesh mesh = reference::kuhn_box(Vector3d::Zero(), Vector3d::Constant(cube.edge), {cells, cells, cells});
  const double centre = cells % 2 == 0 ? 0 : 0.5;  // cells between the line and the nodes below it
  for (int axis = 0; axis < 2; ++axis) {
    const double offset = lattice.offset[axis];
    if (offset < 0) continue;
    double shift = centre - offset;
    shift -= std::round(shift);
    for (Vector3d& x : mesh.nodes) x[axis + 1] += shift * cell * std::sin(std::numbers::pi * x[axis + 1] / cube.edge);
  }
  if (lattice.jitter > 0) reference::jitter_inner_nodes(mesh, lattice.jitter * cell, 7);
  const double touch = 1e-9 * cube.edge;
  const auto held = reference::nodes_where(mesh, [&](const Vector3d& x) {
    if (cube.support == Support::floor) return x.z() < touch;
    return std::min(x.y(), x.z()) < touch || std::max(x.y(), x.z()) > cube.edge - touch;
  });
  const std::vector<physics::ElasticMaterial> materials(mesh.tets.size(), cube.material);
  return {std::move(mesh), materials, held};
}

// Rows of a needle's points in W: along the given axes, point by point.
MatrixXd rows_of(const MatrixXd& compliance, const std::vector<int>& axes) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index p = 0; p < compliance.rows() / 3; ++p)
    for (const int axis : axes) rows.push_back(3 * p + axis);
  return compliance(rows, rows);
}

double condition_of(const MatrixXd& w) {
  const VectorXd eigenvalues = reference::symmetric_eigenvalues(w);
  const double least = eigenvalues.minCoeff(), most = eigenvalues.maxCoeff();
  return least > most * std::numeric_limits<double>::epsilon() ? most / least
                                                               : std::numeric_limits<double>::infinity();
}

// A displacement of every row and its multipliers; rows that depend on each other share what they carry.
double stiffness_of(const MatrixXd& w, const VectorXd& displacement) {
  return displacement.dot(VectorXd(reference::least_norm_solution(w, displacement)));
}

std::vector<int> axes_of(NeedleMotion motion) {
  return motion == NeedleMotion::axial ? std::vector<int>{0} : std::vector<int>{1, 2};
}

// 1 on the rows along the motion.
VectorXd along_motion(std::size_t points, NeedleMotion motion) {
  const int axes = static_cast<int>(axes_of(motion).size());
  VectorXd d = VectorXd::Zero(static_cast<Eigen::Index>(points) * axes);
  for (Eigen::Index row = 0; row < d.size(); row += axes) d[row] = 1;
  return d;
}

void add_subgrid(MatrixXd& w, const MeshedCube& mesh, const TiedNeedle& needle, NeedleMotion motion) {
  const Eigen::Index axes = static_cast<Eigen::Index>(axes_of(motion).size());
  for (std::size_t p = 0; p < needle.points.size(); ++p) {
    const physics::ShaftCompliance c =
        physics::shaft_compliance(mesh.site(needle.points[p]), mesh.cube().needle_radius, needle.spacing);
    w.diagonal().segment(static_cast<Eigen::Index>(p) * axes, axes).array() +=
        motion == NeedleMotion::axial ? c.axial : c.lateral;
  }
}

}  // namespace

Lattice lattice_of_r1(int nodes_per_edge) {
  const auto offset = [&](double where) {
    const double cells = where * (nodes_per_edge - 1);
    return cells - std::floor(cells);
  };
  return {.nodes_per_edge = nodes_per_edge, .offset = {offset(0.47), offset(0.53)}};
}

MeshedCube::MeshedCube(const ResolvedCube& cube, const Lattice& lattice)
    : cube_(cube),
      model_(mesh_cube(cube, lattice)),
      rest_(physics::rest_positions(model_)),
      pattern_(model_),
      factor_(pattern_, workspace_) {
  const std::vector<Eigen::Quaterniond> upright(model_.tets.size(), Eigen::Quaterniond::Identity());
  std::vector<double> values(pattern_.nonzeros());
  pattern_.assemble(model_, upright, 1, values);
  if (!factor_.factorise(pattern_, values, workspace_)) {
    throw std::runtime_error("tied needle: stiffness is not positive definite");
  }
}

physics::TetPoint MeshedCube::locate(const Vector3d& x) const {
  return model_.topology.locate(rest_, x, 0);
}

physics::SubgridSite MeshedCube::site(const physics::TetPoint& point) const {
  return {.tet_volume = model_.tets[point.tet].volume, .material = cube_.material, .barycentric = point.barycentric};
}

MatrixXd MeshedCube::compliance(const std::vector<physics::TetPoint>& points) {
  MatrixXd b = MatrixXd::Zero(model_.dof_count(), 3 * static_cast<Eigen::Index>(points.size()));
  for (std::size_t p = 0; p < points.size(); ++p) {
    const auto& nodes = model_.topology.nodes(points[p].tet);
    for (std::size_t a = 0; a < 4; ++a) {
      const int f = model_.free_index[nodes[a]];
      const double weight = points[p].barycentric[static_cast<Eigen::Index>(a)];
      for (Eigen::Index axis = 0; f >= 0 && axis < 3; ++axis) {
        b(3 * f + axis, 3 * static_cast<Eigen::Index>(p) + axis) = weight;
      }
    }
  }
  MatrixXd x(b.rows(), b.cols());
  factor_.solve(b, x, workspace_);
  return b.transpose() * x;
}

TiedNeedle tie_needle(MeshedCube& mesh, double y, double z, double depth, int count) {
  TiedNeedle needle;
  needle.spacing = depth / count;
  for (int i = 0; i < count; ++i) {
    needle.x.push_back((i + 0.5) * needle.spacing);
    needle.points.push_back(mesh.locate({needle.x.back(), y, z}));
  }
  needle.compliance = mesh.compliance(needle.points);
  return needle;
}

TiedAnswer rigid_answer(const MeshedCube& mesh, const TiedNeedle& needle, NeedleMotion motion, Subgrid subgrid) {
  MatrixXd w = rows_of(needle.compliance, axes_of(motion));
  if (subgrid == Subgrid::on) add_subgrid(w, mesh, needle, motion);
  return {stiffness_of(w, along_motion(needle.points.size(), motion)), condition_of(w)};
}

TiedAnswer flexible_answer(const MeshedCube& mesh, const TiedNeedle& needle, double depth,
                           const physics::NeedleProperties& properties, Subgrid subgrid) {
  // H_n^T a row a column, with straight edges: what the coupling of the paper does.
  physics::Needle mechanics(properties, {});
  physics::StylusPose hub;
  hub.position = Vector3d(depth - properties.length, 0, 0);
  hub.orientation = physics::orientation_along(Vector3d::UnitX());
  if (!mechanics.linearise(physics::straight_needle(properties, hub), hub, 1e-3)) {
    throw std::runtime_error("tied needle: the needle's stiffness is not positive definite");
  }
  const Eigen::Index rows = 2 * static_cast<Eigen::Index>(needle.points.size());
  MatrixXd on_nodes = MatrixXd::Zero(6 * mechanics.node_count(), rows);
  for (std::size_t p = 0; p < needle.points.size(); ++p) {
    const double along = (needle.x[p] - hub.position.x()) / mechanics.beam_length();
    const int beam = std::min(static_cast<int>(along), mechanics.node_count() - 2);
    for (Eigen::Index axis = 0; axis < 2; ++axis) {
      const Eigen::Index row = 2 * static_cast<Eigen::Index>(p) + axis;
      on_nodes(6 * beam + 1 + axis, row) = 1 - (along - beam);
      on_nodes(6 * (beam + 1) + 1 + axis, row) = along - beam;
    }
  }
  MatrixXd w = rows_of(needle.compliance, {1, 2});
  VectorXd motion(on_nodes.rows());
  for (Eigen::Index row = 0; row < rows; ++row) {
    mechanics.solve(on_nodes.col(row), motion);
    w.col(row) += on_nodes.transpose() * motion;
  }
  if (subgrid == Subgrid::on) add_subgrid(w, mesh, needle, NeedleMotion::lateral);
  return {stiffness_of(w, along_motion(needle.points.size(), NeedleMotion::lateral)), condition_of(w)};
}

double fitted_log_alpha(const MeshedCube& mesh, const TiedNeedle& needle, NeedleMotion motion, double target) {
  const double young = mesh.cube().material.young_modulus;
  const double nu = mesh.cube().material.poisson_ratio;
  const double g = young / (2 * (1 + nu)), pi = std::numbers::pi;
  const double k = motion == NeedleMotion::axial ? 1 / (2 * pi * g) : (3 - 4 * nu) / (8 * pi * g * (1 - nu));
  const MatrixXd w = rows_of(needle.compliance, axes_of(motion));
  const VectorXd d = along_motion(needle.points.size(), motion);
  double size = 0;  // mean of ln(h / r)
  for (const auto& point : needle.points) {
    size += std::log(6 * mesh.site(point).tet_volume) / 3 - std::log(mesh.cube().needle_radius);
  }
  size /= static_cast<double>(needle.points.size());
  double low = 1e-3, high = 8;  // stiffness falls with the logarithm
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    MatrixXd softened = w;
    softened.diagonal().array() += k / needle.spacing * middle;
    (d.dot(reference::solve(softened, d).col(0)) > target ? low : high) = middle;
  }
  return 0.5 * (low + high) - size;
}

double tip_answer(MeshedCube& mesh, const Vector3d& tip, NeedleMotion motion, Subgrid subgrid) {
  const physics::TetPoint point = mesh.locate(tip);
  const double meshed = mesh.compliance({point})(0, 0);
  if (subgrid == Subgrid::off) return meshed;
  const double radius = mesh.cube().needle_radius;
  return meshed + (motion == NeedleMotion::indentation ? physics::surface_tip_compliance(mesh.site(point), radius)
                                                       : physics::channel_tip_compliance(mesh.site(point), radius));
}

}  // namespace stylet::reference
