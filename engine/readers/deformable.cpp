#include "engine/readers/deformable.h"

#include "engine/mesh/solid.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/mesh/tet_quality.h"
#include "engine/mesh/tetrahedralise.h"
#include "physics/messages/messages.h"
#include "physics/tissue/refinement.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numbers>

namespace stylet::readers {
namespace {

constexpr double kMostOfLinear = 0.45;  // Poisson's ratio: closer to 0.5 linear tetrahedra hardly bend any more
constexpr double kLeastFilled = 0.9;    // of an organ by its tetrahedra; coarse ones lose some percent at the surface

/// Fills fixed_nodes and held_motion. Where regions overlap, the later one says how its nodes move.
void hold_nodes(const BodyRequest& request, std::span<const Organ> organs, const std::string& scenario,
                content::DeformableBody& body, std::vector<std::string>& problems) {
  const physics::TetMesh& mesh = body.mesh;
  std::vector<bool> fixed(mesh.nodes.size(), false);
  std::vector<Eigen::Vector3d> motion(mesh.nodes.size(), Eigen::Vector3d::Zero());
  bool moves = false;
  for (const FixedRegion& region : request.fixed) {
    std::vector<std::unique_ptr<mesh::Solid>> near;
    for (const std::string& id : region.near) {
      const Organ* organ = find_organ(organs, id);
      if (organ == nullptr) {
        problems.push_back(
            fmt::format("{}:{}/near: there is no organ \"{}\"; correct its id", scenario, region.pointer, id));
        continue;
      }
      near.push_back(std::make_unique<mesh::Solid>(organ->mesh));
    }
    std::size_t held = 0;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
      const Eigen::Vector3d& x = mesh.nodes[n];
      if (region.box && !region.box->contains(x)) continue;
      if (region.outside_box && region.outside_box->contains(x)) continue;
      if (region.plane && region.plane->signedDistance(x) < 0) continue;
      if (!region.near.empty() && std::none_of(near.begin(), near.end(), [&](const auto& solid) {
            return solid->bounds().exteriorDistance(x) <= region.distance &&
                   solid->signed_distance(x) <= region.distance;
          })) {
        continue;
      }
      fixed[n] = true;
      motion[n] = region.breathing;
      ++held;
    }
    moves = moves || !region.breathing.isZero();
    if (held == 0) {
      problems.push_back(
          fmt::format("{}:{}: holds no node of {}; enlarge the region", scenario, region.pointer, request.name));
    }
  }
  std::vector<int>& nodes = body.fixed_nodes;
  for (std::size_t n = 0; n < fixed.size(); ++n) {
    if (!fixed[n]) continue;
    nodes.push_back(static_cast<int>(n));
    if (moves) body.held_motion.push_back(motion[n]);
  }
  if (nodes.size() < 3) {
    problems.push_back(fmt::format("{}:{}/fixed: holds {} nodes of {}, at least 3 are needed or it floats away",
                                   scenario, request.pointer, nodes.size(), request.name));
  } else if (nodes.size() == fixed.size()) {
    problems.push_back(
        fmt::format("{}:{}/fixed: holds all {} nodes of {}, so that nothing of it moves; narrow the "
                    "regions, or leave the body out: it is rigid then",
                    scenario, request.pointer, nodes.size(), request.name));
  }
}

/// Barycentric weights of 20 points spread evenly over a tetrahedron.
std::vector<Eigen::Vector4d> sample_points() {
  std::vector<Eigen::Vector4d> points;
  for (int a = 0; a <= 3; ++a) {
    for (int b = 0; a + b <= 3; ++b) {
      for (int c = 0; a + b + c <= 3; ++c)
        points.emplace_back(Eigen::Vector4d(a, b, c, 3 - a - b - c).array() / 4 + 1.0 / 16);
    }
  }
  return points;
}

/// Mean over a volume: of the law beyond E and nu, by stiffness, so that the stress is the mean one.
class MeanMaterial {
public:
  explicit MeanMaterial(std::size_t samples) : samples_(static_cast<double>(samples)) {}

  void add(const physics::ElasticMaterial& m) {
    softness_ += 1 / (m.young_modulus * samples_);
    mean_.young_modulus += m.young_modulus / samples_;
    mean_.poisson_ratio += m.poisson_ratio / samples_;
    mean_.stiffening += m.stiffening * m.young_modulus / samples_;
    for (std::size_t i = 0; i < m.relaxation.size(); ++i) {
      const double fading = m.relaxation[i].share * m.young_modulus / samples_;
      mean_.relaxation[i].share += fading;
      rate_[i] += fading / m.relaxation[i].time_s;
    }
  }
  physics::ElasticMaterial get() const {
    physics::ElasticMaterial mean = mean_;
    mean.layers.across = std::min(1.0, 1 / (softness_ * mean.young_modulus));
    mean.stiffening /= mean.young_modulus;
    for (std::size_t i = 0; i < rate_.size(); ++i) {
      physics::Relaxation& term = mean.relaxation[i];
      if (rate_[i] > 0) term.time_s = term.share / rate_[i];
      term.share /= mean.young_modulus;
    }
    return mean;
  }

private:
  double samples_;
  double softness_ = 0;  // 1/Pa
  physics::ElasticMaterial mean_{.young_modulus = 0, .poisson_ratio = 0};
  std::array<double, 2> rate_{};
};

/// Where the tissues of an element differ: normals of the nearest surfaces between them, the nearer the more.
void find_layers(std::span<const mesh::Solid* const> regions, content::DeformableBody& body) {
  constexpr double kReach = 3;        // of the radius of a tetrahedron
  constexpr double kOnSurface = 0.1;  // of it
  for (std::size_t first = 0; first < body.mesh.tets.size(); first += physics::kTetsOfRefined) {
    const std::span<physics::ElasticMaterial> materials =
        std::span(body.tet_mechanics).subspan(first, physics::kTetsOfRefined);
    if (std::ranges::all_of(materials, [&](const physics::ElasticMaterial& m) {
          return m.young_modulus == materials[0].young_modulus && m.layers.across == 1;
        })) {
      continue;
    }
    for (std::size_t i = 0; i < materials.size(); ++i) {
      Eigen::Matrix<double, 3, 4> corners;
      for (int c = 0; c < 4; ++c) corners.col(c) = body.mesh.nodes[body.mesh.tets[first + i][c]];
      const Eigen::Vector3d centroid = corners.rowwise().mean();
      const double radius = (corners.colwise() - centroid).colwise().norm().maxCoeff();
      Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();
      for (const mesh::Solid* region : regions) {
        if (region->bounds().exteriorDistance(centroid) >= kReach * radius) continue;
        const mesh::Solid::Nearest nearest = region->nearest(centroid);
        normals += nearest.normal * nearest.normal.transpose() /
                   (nearest.distance * nearest.distance + std::pow(kOnSurface * radius, 2));
      }
      const Eigen::Vector3d normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(normals).eigenvectors().col(2);
      materials[i].layers.normal = {normal.x(), normal.y(), normal.z()};
    }
  }
}

/// Around a cavity, as far as it is thick: it has stretched that as it grew, and what has come to terms with being
/// stretched does not stiffen where it comes back.
void take_grown(const mesh::Solid& cavity, double volume, content::DeformableBody& body) {
  const double radius = std::cbrt(0.75 / std::numbers::pi * volume);
  for (std::size_t t = 0; t < body.mesh.tets.size(); ++t) {
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
    for (const int n : body.mesh.tets[t]) centroid += body.mesh.nodes[n] / 4;
    if (cavity.bounds().exteriorDistance(centroid) > radius || cavity.signed_distance(centroid) > radius) continue;
    body.tet_mechanics[t].stiffening = 0;
  }
}

}  // namespace

void give_tissues(const Organ& boundary, std::span<const Organ> organs, std::span<const content::Tissue> tissues,
                  content::DeformableBody& body) {
  const content::Tissue& outermost = tissues[static_cast<std::size_t>(boundary.tissue)];
  body.capsule = outermost.capsule_modulus * outermost.capsule_thickness;
  struct Region {
    std::uint8_t tissue;
    bool labels;  // a vessel changes how the tetrahedra around it yield, not what they are called
    mesh::Solid solid;
    double volume;  // m^3
  };
  std::vector<Region> regions;
  for (const Organ& organ : organs) {
    const bool part = organ.role == content::SurfaceRole::region || organ.role == content::SurfaceRole::target;
    if (organ.body != body.name || (!part && organ.role != content::SurfaceRole::vessel)) continue;
    regions.push_back(
        {static_cast<std::uint8_t>(organ.tissue), part, mesh::Solid(organ.mesh), mesh::inspect(organ.mesh).volume});
  }
  const std::vector<Eigen::Vector4d> samples = sample_points();
  enum class Overlap { outside, inside, partly };
  std::vector<Overlap> overlaps(regions.size());
  for (const auto& tet : body.mesh.tets) {
    Eigen::Matrix<double, 3, 4> corners;
    for (int c = 0; c < 4; ++c) corners.col(c) = body.mesh.nodes[tet[c]];
    const Eigen::Vector3d centroid = corners.rowwise().mean();
    const double radius = (corners.colwise() - centroid).colwise().norm().maxCoeff();
    const auto whole = static_cast<std::uint8_t>(boundary.tissue);
    std::uint8_t label = whole;
    std::uint8_t fills = whole;  // the last region that holds all of it
    bool mixed = false;
    for (std::size_t r = 0; r < regions.size(); ++r) {
      overlaps[r] = Overlap::outside;
      if (regions[r].solid.bounds().exteriorDistance(centroid) >= radius) continue;
      const double distance = regions[r].solid.signed_distance(centroid);
      if (distance < 0 && regions[r].labels) label = regions[r].tissue;
      if (distance >= radius) continue;
      overlaps[r] = distance <= -radius ? Overlap::inside : Overlap::partly;
      mixed = overlaps[r] == Overlap::partly || (mixed && overlaps[r] != Overlap::inside);
      if (overlaps[r] == Overlap::inside) fills = regions[r].tissue;
    }
    body.tet_tissue.push_back(label);
    if (!mixed) {
      body.tet_mechanics.push_back(tissues[fills].mechanics);
      continue;
    }
    MeanMaterial mean(samples.size());
    for (const Eigen::Vector4d& weights : samples) {
      const Eigen::Vector3d x = corners * weights;
      std::uint8_t tissue = whole;
      for (std::size_t r = regions.size(); r-- > 0;) {
        if (overlaps[r] == Overlap::outside) continue;
        if (overlaps[r] == Overlap::partly && !regions[r].solid.contains(x)) continue;
        tissue = regions[r].tissue;
        break;
      }
      mean.add(tissues[tissue].mechanics);
    }
    body.tet_mechanics.push_back(mean.get());
  }
  if (body.element == physics::Element::linear) {
    for (physics::ElasticMaterial& m : body.tet_mechanics) m.poisson_ratio = std::min(m.poisson_ratio, kMostOfLinear);
  }
  for (const Region& region : regions) {
    if (region.labels && tissues[region.tissue].fluid) take_grown(region.solid, region.volume, body);
  }
  if (body.element != physics::Element::quadratic) return;
  std::vector<const mesh::Solid*> solids;
  for (const Region& region : regions) solids.push_back(&region.solid);
  find_layers(solids, body);
}

content::DeformableBody build_body(const BodyRequest& request, std::span<const Organ> organs,
                                   std::span<const content::Tissue> tissues, const std::string& scenario,
                                   std::vector<std::string>& problems, std::vector<std::string>& warnings) {
  content::DeformableBody body;
  body.name = request.name;
  const Organ* boundary = find_organ(organs, request.boundary);
  if (boundary == nullptr) {
    problems.push_back(fmt::format("{}:{}/boundary: there is no organ \"{}\" in the organ files; correct its id",
                                   scenario, request.pointer, request.boundary));
    return body;
  }
  try {
    body.element = request.element;
    body.mesh = mesh::tetrahedralise(boundary->mesh, {.element = request.element,
                                                      .cell = request.cell,
                                                      .target_nodes = request.target_nodes,
                                                      .where = boundary->place});
  } catch (const files::ContentError& error) {
    problems.emplace_back(error.what());
    return body;
  }
  const double volume = mesh::inspect(boundary->mesh).volume, filled = mesh::tet_quality(body.mesh).volume;
  if (filled < kLeastFilled * volume) {
    warnings.push_back(
        fmt::format("{}: of the {:.3g} ml of {} its tetrahedra fill {:.3g} ml: of several pieces the "
                    "largest moves, thin parts are lost; use a smaller cell, or give the piece alone",
                    boundary->place, volume * 1e6, boundary->name, filled * 1e6));
  }
  give_tissues(*boundary, organs, tissues, body);
  hold_nodes(request, organs, scenario, body, problems);
  return body;
}

std::vector<content::Cavity> find_cavities(std::span<const Organ> organs, std::span<const content::Tissue> tissues,
                                           std::span<const content::DeformableBody> bodies,
                                           std::vector<std::string>& problems) {
  std::vector<content::Cavity> cavities;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const content::DeformableBody& body = bodies[b];
    for (const Organ& organ : organs) {
      const bool part = organ.role == content::SurfaceRole::region || organ.role == content::SurfaceRole::target;
      if (!part || organ.body != body.name || !tissues[organ.tissue].fluid) continue;
      content::Cavity cavity{.name = organ.id, .body = static_cast<int>(b), .tets = {}, .volume = 0};
      const mesh::Solid solid(organ.mesh);
      // Of whole elements: each counts where most of it does.
      const std::size_t run = body.element == physics::Element::quadratic ? physics::kTetsOfRefined : 1;
      for (std::size_t first = 0; first < body.mesh.tets.size(); first += run) {
        double whole = 0, filled = 0;
        for (std::size_t t = first; t < first + run; ++t) {
          Eigen::Matrix<double, 3, 4> x;
          for (int c = 0; c < 4; ++c) x.col(c) = body.mesh.nodes[body.mesh.tets[t][c]];
          const double volume = (x.col(1) - x.col(0)).cross(x.col(2) - x.col(0)).dot(x.col(3) - x.col(0)) / 6;
          whole += volume;
          if (body.tet_tissue[t] == organ.tissue && solid.contains(x.rowwise().mean())) filled += volume;
        }
        if (2 * filled < whole || filled == 0) continue;
        for (std::size_t t = first; t < first + run; ++t) cavity.tets.push_back(static_cast<int>(t));
        cavity.volume += whole;
      }
      if (cavity.tets.empty()) {
        problems.push_back(fmt::format("{}: no tetrahedron of {} has its middle in the fluid {}; use a smaller cell",
                                       organ.place, body.name, organ.id));
        continue;
      }
      cavities.push_back(std::move(cavity));
    }
  }
  if (std::ssize(cavities) > physics::kMaxCavities) {
    problems.push_back(fmt::format("{} regions are of a fluid, at most {} can be; take some out", cavities.size(),
                                   physics::kMaxCavities));
  }
  return cavities;
}

}  // namespace stylet::readers
