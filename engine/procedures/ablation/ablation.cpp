#include "engine/procedures/ablation/ablation.h"

#include "engine/content/embedding.h"
#include "engine/content/voxel.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/procedures/ablation/iso_surface.h"
#include "engine/procedures/ablation/plan.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::procedures::ablation {
namespace {

CellGrid grid_around(const Electrode& electrode) {
  const Eigen::Vector3d low = electrode.tip.cwiseMin(electrode.base).array() - Ablation::kReach;
  const Eigen::Vector3d high = electrode.tip.cwiseMax(electrode.base).array() + Ablation::kReach;
  CellGrid grid{.origin = low, .spacing = Ablation::kCell};
  grid.size = ((high - low) / grid.spacing).array().ceil().cast<int>() + 1;
  return grid;
}

/// [tissues] whether it is the blood of vessels.
std::vector<bool> blood(const content::Scene& scene) {
  std::vector<bool> is(scene.tissues.size(), false);
  for (const content::Surface& surface : scene.surfaces) {
    if (surface.role == content::SurfaceRole::vessel) is[surface.tissue] = true;
  }
  return is;
}

}  // namespace

Ablation::Ablation(const content::Scene& scene, const Electrode& electrode, int target)
    : scene_(scene), heat_(grid_around(electrode)), gas_(heat_.grid().count(), 0.0F) {
  const std::vector<bool> vessel = blood(scene);
  const CellGrid& grid = heat_.grid();
  for (int k = 0; k < grid.size.z(); ++k) {
    for (int j = 0; j < grid.size.y(); ++j) {
      for (int i = 0; i < grid.size.x(); ++i) {
        const std::ptrdiff_t voxel = content::voxel_at(scene.labels, grid.centre(i, j, k));
        if (voxel >= 0 && vessel[scene.labels.labels[voxel]]) heat_.hold(grid.index(i, j, k));
      }
    }
  }
  if (target >= 0) find_region(target);
  place(electrode);
}

void Ablation::place(const Electrode& electrode) {
  heat_.set_source(power_density(heat_.grid(), electrode));
}

void Ablation::find_region(int target) {
  const content::LabelVolume& labels = scene_.labels;
  const content::Target& wanted = scene_.targets[target];
  const std::ptrdiff_t centre = content::voxel_at(labels, wanted.centre);
  if (centre < 0) return;
  const std::vector<bool> vessel = blood(scene_);
  const std::uint8_t tissue = labels.labels[centre];
  const std::int8_t body = labels.bodies[centre];
  const auto label_at = [&](const Eigen::Vector3d& x) {
    const std::ptrdiff_t voxel = content::voxel_at(labels, x);
    const bool same = voxel >= 0 && labels.bodies[voxel] == body;
    return same ? static_cast<int>(labels.labels[voxel]) : -1;
  };
  const auto each_voxel = [&](double reach, const auto& visit) {
    const int voxels = static_cast<int>(std::ceil(reach / labels.spacing));
    for (int k = -voxels; k <= voxels; ++k) {
      for (int j = -voxels; j <= voxels; ++j) {
        for (int i = -voxels; i <= voxels; ++i) {
          const Eigen::Vector3d off = static_cast<double>(labels.spacing) * Eigen::Vector3d(i, j, k);
          if (off.norm() <= reach) visit(wanted.centre + off);
        }
      }
    }
  };
  // The target, and those of its voxels that others are near to.
  double radius = 0;
  std::vector<Eigen::Vector3d> rim;
  each_voxel(2 * wanted.radius, [&](const Eigen::Vector3d& x) {
    if (label_at(x) != tissue) return;
    region_.push_back({x, 0});
    radius = std::max(radius, (x - wanted.centre).norm());
    bool inner = true;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = static_cast<double>(labels.spacing) * Eigen::Vector3d::Unit(axis);
      inner = inner && label_at(x + step) == tissue && label_at(x - step) == tissue;
    }
    if (!inner) rim.push_back(x);
  });
  const double margin = plan_of(scene_.exercise).margin;
  each_voxel(radius + margin, [&](const Eigen::Vector3d& x) {
    const int label = label_at(x);
    if (label < 0 || label == tissue || vessel[label]) return;
    double nearest = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& of_target : rim) nearest = std::min(nearest, (x - of_target).squaredNorm());
    if (nearest <= margin * margin) region_.push_back({x, std::sqrt(nearest)});
  });
}

void Ablation::heat_to(double heated_s) {
  const Plan& plan = plan_of(scene_.exercise);
  while (heated_s >= kStep * (steps_ + 1)) {
    power_w_ = heat_.step(kStep, plan.power_w, plan.max_temperature);
    energy_j_ += power_w_ * kStep;
    ++steps_;
    rested_ = 0;
    dissolve();
    for (std::size_t c = 0; c < gas_.size(); ++c) {
      const double share = (heat_.temperature()[c] - kFirstGas) / (kFullGas - kFirstGas);
      if (share > gas_[c]) gas_[c] = static_cast<float>(std::min(share, 1.0));
    }
  }
}

void Ablation::rest_to(double rested_s) {
  rested_s = std::min(rested_s, kGasGone);
  for (; rested_s >= kStep * (rested_ + 1); ++rested_) dissolve();
}

void Ablation::dissolve() {
  const auto left = static_cast<float>(std::exp(-kStep / kGasLasts));
  for (float& gas : gas_) gas *= left;
  ++changes_;
}

double Ablation::volume() const {
  std::size_t cells = 0;
  for (std::size_t c = 0; c < heat_.grid().count(); ++c) cells += heat_.destroyed(c) ? 1 : 0;
  return static_cast<double>(cells) * heat_.grid().volume();
}

// The dose spans many powers of ten from cell to cell: between them its logarithm is what is nearly linear.
std::vector<double> Ablation::log_dose() const {
  std::vector<double> values;
  values.reserve(heat_.dose().size());
  for (const double dose : heat_.dose()) values.push_back(std::log((dose + 1) / (Bioheat::kLethal + 1)));
  return values;
}

AblationCoverage Ablation::coverage() const {
  const CellGrid& grid = heat_.grid();
  const std::vector<double> values = log_dose();
  // Linear between the cells, as the surface is.
  const auto destroyed = [&](const Eigen::Vector3d& x) {
    const Eigen::Array3d at = ((x - grid.origin) / grid.spacing).array();
    const Eigen::Array3i low = at.floor().cast<int>();
    if ((low < 0).any() || (low + 1 >= grid.size.array()).any()) return false;
    double value = 0;
    for (int c = 0; c < 8; ++c) {
      const Eigen::Array3i step(c & 1, c >> 1 & 1, c >> 2);
      const Eigen::Array3d weight = 1 - (at - (low + step).cast<double>()).abs();
      const Eigen::Array3i corner = low + step;
      value += weight.prod() * values[grid.index(corner[0], corner[1], corner[2])];
    }
    return value > 0;
  };
  std::size_t target = 0;
  std::size_t target_destroyed = 0;
  std::size_t all_destroyed = 0;
  AblationCoverage out{.least_margin = plan_of(scene_.exercise).margin};
  for (const Voxel& voxel : region_) {
    const bool gone = destroyed(voxel.at);
    if (voxel.distance <= 0) {
      ++target;
      target_destroyed += gone ? 1 : 0;
    }
    all_destroyed += gone ? 1 : 0;
    if (!gone) out.least_margin = std::min(out.least_margin, voxel.distance);
  }
  if (target == 0) return {};
  out.tumour = static_cast<double>(target_destroyed) / static_cast<double>(target);
  out.with_margin = static_cast<double>(all_destroyed) / static_cast<double>(region_.size());
  return out;
}

mesh::TriangleMesh Ablation::zone() const {
  return iso_surface(heat_.grid(), log_dose(), 0);
}

content::Surface Ablation::surface(int body) const {
  const mesh::TriangleMesh mesh = zone();
  content::Surface surface;
  surface.name = "ablation_zone";
  surface.role = content::SurfaceRole::visual;
  surface.body = body;
  for (const Eigen::Vector3d& vertex : mesh.vertices) surface.positions.push_back(vertex.cast<float>());
  surface.normals = mesh::smooth_normals(mesh);
  for (const auto& triangle : mesh.triangles) {
    surface.indices.insert(surface.indices.end(), triangle.begin(), triangle.end());
  }
  if (body >= 0) {
    surface.embedding = content::embed(surface.positions, scene_.bodies[body].mesh);
  }
  return surface;
}

std::shared_ptr<const content::HeatedZone> Ablation::shown(std::shared_ptr<const content::HeatedZone> before,
                                                           int body, bool exactly) const {
  const auto version = static_cast<std::uint64_t>(1 + changes_);
  const std::uint64_t old = before ? before->version : 0;
  if (old == version || (!exactly && old / kShownEvery == version / kShownEvery)) return before;
  const CellGrid& grid = heat_.grid();
  auto zone = std::make_shared<content::HeatedZone>();
  zone->surface = surface(body);
  zone->origin = grid.origin.cast<float>();
  zone->spacing = static_cast<float>(grid.spacing);
  zone->size = grid.size;
  zone->gas = gas_;
  for (const double value : log_dose()) zone->dose.push_back(static_cast<float>(value));
  zone->version = version;
  return zone;
}

}  // namespace stylet::procedures::ablation
