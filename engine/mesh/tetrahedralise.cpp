#include "engine/mesh/tetrahedralise.h"

#include "engine/files/error.h"
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
constexpr int kSearchSteps = 5;
constexpr int kVolumeSteps = 12;
constexpr int kFewNodes = 600;               // where the search for a volume begins
constexpr std::size_t kManyNodes = 200'000;  // and where it gives up
constexpr int kSmoothing = 6;                // passes
constexpr double kFewCells = 4;              // that a piece holds at least, by volume

bool too_many_points(const SolidShape& solid, double cell) {
  return !(2 * ((solid.box.sizes() / cell).array() + 3).prod() < kMostLatticePoints);
}

bool is_graded(const SolidShape& piece, const TetrahedraliseSettings& settings) {
  return settings.grading && piece.distance(settings.grading->target) < 0;
}

// The mesh of each piece; empty: it is left out.
std::vector<physics::TetMesh> fill(std::span<const SolidShape> pieces, double cell, int smoothing,
                                   const TetrahedraliseSettings& settings) {
  std::vector<physics::TetMesh> meshes(pieces.size());
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    const SolidShape& piece = pieces[p];
    if (pieces.size() > 1 && piece.volume < kFewCells * cell * cell * cell) continue;
    if (too_many_points(piece, cell)) {
      throw files::ContentError(
          fmt::format("{}: a cell of {:.3g} mm needs more than {:.2g} lattice points; choose a larger cell",
                      settings.where, cell * 1e3, kMostLatticePoints));
    }
    meshes[p] = is_graded(piece, settings)
                    ? stuff_graded(piece.distance, piece.box, cell, smoothing, *settings.grading)
                    : stuff(piece.distance, piece.box, cell, smoothing);
    if (pieces.size() > 1 && 2 * tet_quality(meshes[p]).volume < piece.volume) meshes[p] = {};
  }
  return meshes;
}

std::size_t node_count(const std::vector<physics::TetMesh>& meshes) {
  std::size_t nodes = 0;
  for (const physics::TetMesh& mesh : meshes) nodes += mesh.nodes.size();
  return nodes;
}

double volume_of(std::span<const SolidShape> pieces) {
  double volume = 0;
  for (const SolidShape& piece : pieces) volume += piece.volume;
  return volume;
}

// A cell size whose mesh has about the wanted number of nodes: secant in log-log, started with the law above.
double cell_for_nodes(std::span<const SolidShape> pieces, const TetrahedraliseSettings& settings) {
  const double target = std::log(settings.target_nodes);
  // Two nodes a cell inside, and nearly as many again at the surface.
  double cell = std::cbrt(3.5 * volume_of(pieces) / settings.target_nodes);
  double best_cell = cell;
  double best_error = std::numeric_limits<double>::infinity();
  double slope = kNodeExponent;
  double last_log_cell = 0;
  double last_log_nodes = 0;
  for (int step = 0; step < kSearchSteps; ++step) {
    const std::size_t nodes = node_count(fill(pieces, cell, 0, settings));
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

// The largest cell whose mesh has the wanted volume: from few nodes on, at least a quarter smaller each time.
double cell_for_volume(std::span<const SolidShape> pieces, const TetrahedraliseSettings& settings) {
  double cell = std::cbrt(3.5 * volume_of(pieces) / kFewNodes);
  double missed = 1;
  for (int step = 0; step < kVolumeSteps; ++step) {
    // Smoothing costs volume too: with it.
    const std::vector<physics::TetMesh> meshes = fill(pieces, cell, kSmoothing, settings);
    missed = volume_missed(pieces, meshes);
    if (missed <= settings.volume_error) return cell;
    // The error falls with the square of the cell, where the cell is small enough.
    const double next = cell * std::clamp(std::sqrt(settings.volume_error / missed), 0.5, 0.75);
    const bool too_many =
        std::any_of(pieces.begin(), pieces.end(), [&](const SolidShape& p) { return too_many_points(p, next); });
    if (too_many || node_count(meshes) > kManyNodes) break;
    cell = next;
  }
  throw files::ContentError(fmt::format(
      "{}: with a cell of {:.3g} mm the mesh still misses {:.0f} % of the volume, more than {:g} %: it is "
      "thinner than that in places; choose a cell size yourself",
      settings.where, cell * 1e3, 100 * missed, 100 * settings.volume_error));
}

}  // namespace

void append(physics::TetMesh& to, const physics::TetMesh& from) {
  const int base = static_cast<int>(to.nodes.size());
  to.nodes.insert(to.nodes.end(), from.nodes.begin(), from.nodes.end());
  for (const auto& [a, b, c, d] : from.tets) to.tets.push_back({base + a, base + b, base + c, base + d});
}

FilledPieces fill_pieces(std::span<const SolidShape> pieces, const TetrahedraliseSettings& settings) {
  FilledPieces filled;
  filled.cell = settings.cell > 0           ? settings.cell
                : settings.target_nodes > 0 ? cell_for_nodes(pieces, settings)
                                            : cell_for_volume(pieces, settings);
  for (const physics::TetMesh& mesh : fill(pieces, filled.cell, kSmoothing, settings)) {
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
