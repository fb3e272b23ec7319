#include "engine/content/tetrahedralise.h"

#include "engine/content/error.h"
#include "engine/content/solid.h"
#include "engine/content/stuffing.h"
#include "engine/content/surface_mesh.h"
#include "engine/content/tet_quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::content {
namespace {

constexpr double kMostLatticePoints = 2e7;  // 1 GB of lattice and more: refuse instead
constexpr double kNodeExponent = -2.6;      // measured: nodes ~ cell^-2.6 on organs of 500 to 15 000 nodes
constexpr int kSearchSteps = 5;
constexpr int kVolumeSteps = 12;
constexpr int kFewNodes = 600;               // where the search for a volume begins
constexpr std::size_t kManyNodes = 200'000;  // and where it gives up
constexpr int kSmoothing = 6;                // passes

physics::TetMesh stuff_checked(const SolidShape& solid, double cell, int smoothing, const std::string& where) {
  const double points = 2 * ((solid.box.sizes() / cell).array() + 3).prod();
  if (!(points < kMostLatticePoints)) {
    throw ContentError(fmt::format("{}: a cell of {:.3g} mm needs {:.2g} lattice points; choose a larger cell", where,
                                   cell * 1e3, points));
  }
  return stuff(solid.distance, solid.box, cell, smoothing);
}

// A cell size whose mesh has about the wanted number of nodes: secant in log-log, started with the law above.
double cell_for_nodes(const SolidShape& solid, const TetrahedraliseSettings& settings) {
  const double target = std::log(settings.target_nodes);
  // Two nodes a cell inside, and nearly as many again at the surface.
  double cell = std::cbrt(3.5 * solid.volume / settings.target_nodes);
  double best_cell = cell;
  double best_error = std::numeric_limits<double>::infinity();
  double slope = kNodeExponent;
  double last_log_cell = 0;
  double last_log_nodes = 0;
  for (int step = 0; step < kSearchSteps; ++step) {
    const physics::TetMesh mesh = stuff_checked(solid, cell, 0, settings.where);
    const double log_nodes = std::log(std::max<double>(4, static_cast<double>(mesh.nodes.size())));
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

// The largest cell whose mesh has the wanted volume: from few nodes on, a quarter smaller each time.
double cell_for_volume(const SolidShape& solid, const TetrahedraliseSettings& settings) {
  double cell = std::cbrt(3.5 * solid.volume / kFewNodes);
  for (int step = 0; step < kVolumeSteps; ++step, cell *= 0.75) {
    // Smoothing costs volume too: with it.
    const physics::TetMesh mesh = stuff_checked(solid, cell, kSmoothing, settings.where);
    if (std::abs(tet_quality(mesh).volume - solid.volume) <= settings.volume_error * solid.volume) return cell;
    if (mesh.nodes.size() > kManyNodes) break;
  }
  throw ContentError(fmt::format(
      "{}: with a cell of {:.3g} mm the mesh still misses the volume by more than {:g} %: it is thinner than "
      "that, or in several pieces, of which the largest is kept; choose a cell size yourself",
      settings.where, cell * 1e3, 100 * settings.volume_error));
}

}  // namespace

physics::TetMesh tetrahedralise(const SolidShape& solid, const TetrahedraliseSettings& settings) {
  const double cell = settings.cell > 0           ? settings.cell
                      : settings.target_nodes > 0 ? cell_for_nodes(solid, settings)
                                                  : cell_for_volume(solid, settings);
  physics::TetMesh mesh = stuff_checked(solid, cell, kSmoothing, settings.where);
  if (mesh.tets.empty()) {
    throw ContentError(
        fmt::format("{}: no tetrahedron at a cell size of {:.3g} mm; the solid is thinner than that, "
                    "choose a smaller one",
                    settings.where, cell * 1e3));
  }
  const TetQuality quality = tet_quality(mesh);
  if (quality.inverted > 0 || quality.min_dihedral_deg < settings.min_dihedral_deg) {
    throw ContentError(
        fmt::format("{}: worst dihedral angle {:.1f} degrees, {} inverted tetrahedra at a cell size of "
                    "{:.3g} mm; choose a smaller cell or smooth the surface",
                    settings.where, quality.min_dihedral_deg, quality.inverted, cell * 1e3));
  }
  return mesh;
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

}  // namespace stylet::content
