#include "engine/mesh/tetrahedralise.h"

#include "engine/files/error.h"
#include "engine/files/pulse.h"
#include "engine/mesh/quadratic_mesh.h"
#include "engine/mesh/solid.h"
#include "engine/mesh/stuffing.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/mesh/tet_quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace stylet::mesh {
namespace {

constexpr double kMostLatticePoints = 2e7;  // 1 GB of lattice and more: refuse instead
constexpr double kNodeExponent = -2.6;      // measured: nodes ~ cell^-2.6 on organs of 500 to 15 000 nodes
constexpr double kNodesOfCell = 3.5;        // two inside, and nearly as many again at the surface
constexpr int kSearchSteps = 5;
constexpr int kVolumeSteps = 12;
constexpr int kFewNodes = 600;   // where the search for a volume begins
constexpr int kFewerSteps = 3;   // then back to a larger cell
constexpr double kEnough = 0.5;  // of the error accepted; a better mesh has more nodes than were asked for
constexpr int kSmoothing = 6;    // passes
constexpr double kFewCells = 4;  // that a piece holds at least, by volume

bool too_many_points(const SolidShape& solid, double cell) {
  return !(2 * ((solid.box.sizes() / cell).array() + 3).prod() < kMostLatticePoints);
}

/// What the search may cost, and whether it is still wanted.
class Work {
public:
  explicit Work(const TetrahedraliseSettings& settings) : settings_(settings) {}

  /// The same distance, counted.
  SignedDistance counted(const SignedDistance& distance) {
    return [this, &distance](const Eigen::Vector3d& x) {
      pulse_(files::Pulse::kDistance);
      if (++distances_ > settings_.most_distances) too_many();
      return distance(x);
    };
  }
  /// What follows is done with cells of this size.
  void with(double cell) { cell_ = cell; }
  const files::Pulse& pulse() const { return pulse_; }
  void at(int step, int steps) { share_ = static_cast<double>(step) / steps; }

private:
  [[noreturn]] void too_many() const {
    throw files::ContentError(
        fmt::format("{}: takes more than {:.2g} looks at its surface, with a cell of {:.3g} mm at last: it is long, "
                    "thin or ragged; give a larger cell, fewer nodes or a larger volume error, or leave it out",
                    settings_.where, static_cast<double>(settings_.most_distances), cell_ * 1e3));
  }

  const TetrahedraliseSettings& settings_;
  const files::Pulse pulse_ = [this] {
    if (settings_.progress) settings_.progress(cell_, share_);
  };
  std::size_t distances_ = 0;
  double cell_ = 0;
  double share_ = 0;
};

bool is_graded(const SolidShape& piece, const TetrahedraliseSettings& settings) {
  return settings.grading && piece.distance(settings.grading->target) < 0;
}

double volume_of(std::span<const SolidShape> pieces) {
  double volume = 0;
  for (const SolidShape& piece : pieces) volume += piece.volume;
  return volume;
}

// So many nodes take minutes to make, and no computer simulates them.
void check_cell(std::span<const SolidShape> pieces, const TetrahedraliseSettings& settings) {
  const double nodes = kNodesOfCell * volume_of(pieces) / (settings.cell * settings.cell * settings.cell);
  if (nodes <= settings.most_asked) return;
  throw files::ContentError(fmt::format(
      "{}: cells of {:.3g} mm make about {:.2g} nodes of it, accepted are {:.2g}; choose cells of {:.3g} mm "
      "or more",
      settings.where, settings.cell * 1e3, nodes, settings.most_asked,
      std::ceil(1e4 * settings.cell * std::cbrt(nodes / settings.most_asked)) / 10));
}

// The mesh of each piece; empty: it is left out.
std::vector<physics::TetMesh> fill(std::span<const SolidShape> pieces, double cell, int smoothing,
                                   const TetrahedraliseSettings& settings, Work& work) {
  std::vector<physics::TetMesh> meshes(pieces.size());
  work.with(cell);
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    const SolidShape& piece = pieces[p];
    if (pieces.size() > 1 && piece.volume < kFewCells * cell * cell * cell) continue;
    if (too_many_points(piece, cell)) {
      throw files::ContentError(
          fmt::format("{}: a cell of {:.3g} mm needs more than {:.2g} lattice points; choose a larger cell",
                      settings.where, cell * 1e3, kMostLatticePoints));
    }
    if (settings.cell > 0) check_cell(pieces, settings);
    const SignedDistance distance = work.counted(piece.distance);
    const bool quadratic = settings.element == physics::Element::quadratic;
    const double lattice = quadratic ? 2 * cell : cell;
    meshes[p] = is_graded(piece, settings)
                    ? stuff_graded(distance, piece.box, lattice, smoothing, *settings.grading)
                    : stuff(distance, piece.box, lattice, smoothing, Parts::largest, work.pulse());
    if (quadratic) meshes[p] = refined_on_surface(meshes[p], distance, work.pulse());
    if (pieces.size() > 1 && 2 * tet_quality(meshes[p]).volume < piece.volume) meshes[p] = {};
  }
  return meshes;
}

std::size_t node_count(const std::vector<physics::TetMesh>& meshes) {
  std::size_t nodes = 0;
  for (const physics::TetMesh& mesh : meshes) nodes += mesh.nodes.size();
  return nodes;
}

// A cell size whose mesh has about the wanted number of nodes: secant in log-log, started with the law above.
double cell_for_nodes(std::span<const SolidShape> pieces, const TetrahedraliseSettings& settings, Work& work) {
  const double target = std::log(settings.target_nodes);
  double cell = std::cbrt(kNodesOfCell * volume_of(pieces) / settings.target_nodes);
  double best_cell = cell;
  double best_error = std::numeric_limits<double>::infinity();
  double slope = kNodeExponent;
  double last_log_cell = 0;
  double last_log_nodes = 0;
  for (int step = 0; step < kSearchSteps; ++step) {
    work.at(step, kSearchSteps + 1);
    const std::size_t nodes = node_count(fill(pieces, cell, 0, settings, work));
    const double log_nodes = std::log(std::max<double>(4, static_cast<double>(nodes)));
    const double log_cell = std::log(cell);
    if (std::abs(log_nodes - target) < best_error) {
      best_error = std::abs(log_nodes - target);
      best_cell = cell;
    }
    if (best_error < settings.node_tolerance) break;
    if (step > 0 && log_cell != last_log_cell) {
      // Node counts of neighbouring cell sizes are noisy: keep the slope near the law.
      slope = std::clamp((log_nodes - last_log_nodes) / (log_cell - last_log_cell), -3.5, -1.8);
    }
    last_log_cell = log_cell;
    last_log_nodes = log_nodes;
    cell *= std::exp(std::clamp((target - log_nodes) / slope, -0.7, 0.7));
  }
  return best_cell;
}

// How far the meshes are from the volume of their pieces, and what they leave out: the worse of both, relative.
double volume_missed(std::span<const SolidShape> pieces, const std::vector<physics::TetMesh>& meshes) {
  double filled = 0, wanted = 0, left_out = 0;
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    (meshes[p].tets.empty() ? left_out : wanted) += pieces[p].volume;
    filled += tet_quality(meshes[p]).volume;
  }
  if (wanted == 0) return 1;
  return std::max(std::abs(filled / wanted - 1), left_out / (left_out + wanted));
}

// The largest cell whose mesh has the wanted volume: from few nodes on, at least a quarter smaller each time, then
// back where the last step went too far.
double cell_for_volume(std::span<const SolidShape> pieces, const TetrahedraliseSettings& settings, Work& work) {
  double cell = std::cbrt(kNodesOfCell * volume_of(pieces) / kFewNodes);
  double missed = 1;
  std::size_t nodes = 0;
  // Smoothing costs volume too: with it.
  const auto miss = [&](double of_cell) {
    const std::vector<physics::TetMesh> meshes = fill(pieces, of_cell, kSmoothing, settings, work);
    nodes = node_count(meshes);
    return volume_missed(pieces, meshes);
  };
  double too_large = 0;
  bool large_box = false;
  for (int step = 0; step < kVolumeSteps; ++step) {
    work.at(step, kVolumeSteps + kFewerSteps);
    missed = miss(cell);
    if (missed <= settings.volume_error && nodes <= settings.most_nodes) {
      if (too_large == 0) return cell;
      for (int back = 0; back < kFewerSteps && missed < kEnough * settings.volume_error; ++back) {
        work.at(kVolumeSteps + back, kVolumeSteps + kFewerSteps);
        const double larger = std::sqrt(cell * too_large);
        const double of_larger = miss(larger);
        if (of_larger > settings.volume_error) {
          too_large = larger;
        } else {
          cell = larger;
          missed = of_larger;
        }
      }
      return cell;
    }
    // The error falls with the square of the cell, where the cell is small enough.
    const double next = cell * std::clamp(std::sqrt(settings.volume_error / missed), 0.5, 0.75);
    const bool too_many =
        std::any_of(pieces.begin(), pieces.end(), [&](const SolidShape& p) { return too_many_points(p, next); });
    large_box = too_many;
    if (too_many || nodes > settings.most_nodes) break;
    too_large = cell;
    cell = next;
  }
  if (large_box) {
    throw files::ContentError(fmt::format(
        "{}: with a cell of {:.3g} mm the mesh still misses {:.0f} % of the volume (accepted: {:g} %), and its "
        "box is too large for smaller ones: it is long and thin; split it into shorter parts, or leave it out",
        settings.where, cell * 1e3, 100 * missed, 100 * settings.volume_error));
  }
  throw files::ContentError(fmt::format(
      "{}: with a cell of {:.3g} mm the mesh has {} nodes (accepted: {}) and misses {:.2g} % of the volume "
      "(accepted: "
      "{:g} %): it is thinner than that in places; give a cell size, a number of nodes or a larger volume error",
      settings.where, cell * 1e3, nodes, settings.most_nodes, 100 * missed, 100 * settings.volume_error));
}

}  // namespace

void append(physics::TetMesh& to, const physics::TetMesh& from) {
  const int base = static_cast<int>(to.nodes.size());
  to.nodes.insert(to.nodes.end(), from.nodes.begin(), from.nodes.end());
  for (const auto& [a, b, c, d] : from.tets) to.tets.push_back({base + a, base + b, base + c, base + d});
}

FilledPieces fill_pieces(std::span<const SolidShape> pieces, const TetrahedraliseSettings& settings) {
  FilledPieces filled;
  Work work(settings);
  filled.cell = settings.cell > 0           ? settings.cell
                : settings.target_nodes > 0 ? cell_for_nodes(pieces, settings, work)
                                            : cell_for_volume(pieces, settings, work);
  for (const physics::TetMesh& mesh : fill(pieces, filled.cell, kSmoothing, settings, work)) {
    filled.volumes.push_back(tet_quality(mesh).volume);
    append(filled.mesh, mesh);
  }
  filled.graded =
      std::any_of(pieces.begin(), pieces.end(), [&](const SolidShape& p) { return is_graded(p, settings); });
  if (filled.mesh.tets.empty()) {
    throw files::ContentError(
        fmt::format("{}: no tetrahedron at a cell size of {:.3g} mm; the solid is thinner than that, "
                    "choose a smaller one",
                    settings.where, filled.cell * 1e3));
  }
  const TetQuality quality = tet_quality(filled.mesh);
  if (quality.inverted > 0 || quality.min_dihedral_deg < settings.min_dihedral_deg) {
    throw files::ContentError(
        fmt::format("{}: worst dihedral angle {:.1f} degrees, {} inverted tetrahedra at a cell size of "
                    "{:.3g} mm; choose a smaller cell or smooth the surface",
                    settings.where, quality.min_dihedral_deg, quality.inverted, filled.cell * 1e3));
  }
  return filled;
}

physics::TetMesh tetrahedralise(const SolidShape& solid, const TetrahedraliseSettings& settings) {
  return fill_pieces({&solid, 1}, settings).mesh;
}

physics::TetMesh tetrahedralise(const TriangleMesh& surface, const TetrahedraliseSettings& settings) {
  TriangleMesh closed = solid_surface(surface, settings.where);
  const double volume = inspect(closed).volume;
  const Solid solid(std::move(closed));
  return tetrahedralise({.distance = [&](const Eigen::Vector3d& x) { return solid.signed_distance(x); },
                         .box = solid.bounds(),
                         .volume = volume},
                        settings);
}

}  // namespace stylet::mesh
