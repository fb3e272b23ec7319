#include "physics/tissue/quadratic.h"

#include "physics/tissue/corotational.h"
#include "physics/tissue/lanes.h"
#include "physics/tissue/quadratic_shape.h"
#include "physics/tissue/refinement.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

namespace stylet::physics {
namespace {

using Gradients = Eigen::Matrix<double, 3, 10>;

[[noreturn]] void refuse(std::size_t element, const std::string& what) {
  throw std::invalid_argument("tissue model: quadratic element " + std::to_string(element) + " " + what);
}

/// Gradients of the shape functions in the element's own coordinates xi_k = L_(k + 1), at barycentric L.
Gradients natural_gradients(const Eigen::Vector4d& l) {
  Eigen::Matrix<double, 4, 10> by_barycentric = Eigen::Matrix<double, 4, 10>::Zero();
  for (int a = 0; a < 4; ++a) by_barycentric(a, a) = 4 * l[a] - 1;
  for (std::size_t e = 0; e < kTetEdges.size(); ++e) {
    const auto [a, b] = kTetEdges[e];
    by_barycentric(a, static_cast<Eigen::Index>(e) + 4) = 4 * l[b];
    by_barycentric(b, static_cast<Eigen::Index>(e) + 4) = 4 * l[a];
  }
  return by_barycentric.bottomRows<3>().rowwise() - by_barycentric.row(0);
}

/// Of the four points.
const std::array<Gradients, kLanes>& gradients_at_points() {
  static const std::array<Gradients, kLanes> natural = [] {
    std::array<Gradients, kLanes> of_points;
    for (int p = 0; p < kLanes; ++p) {
      Eigen::Vector4d l = Eigen::Vector4d::Constant(kPointFar);
      l[p] = kPointNear;
      of_points[static_cast<std::size_t>(p)] = natural_gradients(l);
    }
    return of_points;
  }();
  return natural;
}

std::array<int, 10> nodes_of(const TetMesh& mesh, std::size_t element) {
  const std::size_t first = kTetsOfRefined * element;
  std::array<int, 10> nodes{};
  for (std::size_t i = 0; i < 4; ++i) nodes[i] = mesh.tets[first + i][i];
  for (std::size_t e = 0; e < kTetEdges.size(); ++e) {
    const auto i = static_cast<std::size_t>(kTetEdges[e].first);
    const auto j = static_cast<std::size_t>(kTetEdges[e].second);
    nodes[4 + e] = mesh.tets[first + i][j];
    if (mesh.tets[first + j][i] != nodes[4 + e]) refuse(element, "is no refined tetrahedron");
  }
  return nodes;
}

/// Ends of the diagonal that an element's last four tetrahedra lie around, and the ring that they go round it in.
std::array<int, 6> inner_of(const TetMesh& mesh, std::size_t element) {
  const auto around = std::span(mesh.tets).subspan(kTetsOfRefined * element + 4, 4);
  std::array<int, 6> inner{around[0][0], around[0][1], -1, -1, -1, -1};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& tet = around[i];
    const auto& last = around[(i + 3) % 4];
    for (const int node : {tet[2], tet[3]}) {
      if (node == last[2] || node == last[3]) inner[2 + i] = node;
    }
    if (tet[0] != inner[0] || tet[1] != inner[1] || inner[2 + i] < 0) refuse(element, "is no refined tetrahedron");
  }
  return inner;
}

Gradients rest_of(const TetMesh& mesh, const std::array<int, 10>& nodes) {
  Gradients x;
  for (int a = 0; a < 10; ++a) x.col(a) = mesh.nodes[nodes[static_cast<std::size_t>(a)]];
  return x;
}

/// Rotations of an element's points, [row][column].
LaneMatrix rotations_of(std::span<const Eigen::Quaterniond> rotations, std::size_t element) {
  return matrix_of(quaternions_of(rotations, kLanes * element));
}

Lanes trace(const LaneMatrix& m) {
  return m[0][0] + m[1][1] + m[2][2];
}

/// Edge without stress over that at rest.
double size_of(std::span<const double> rest_size, std::size_t element) {
  return rest_size.empty() ? 1 : rest_size[kTetsOfRefined * element];
}

double cubed(double size) {
  return size * size * size;
}

/// Relative, of moduli along layers and across: rounding.
constexpr double kSameAcross = 1e-9;

/// Null: none.
const LayerLaw* layers_of(const QuadraticRest& rest) {
  return rest.layered ? &rest : nullptr;
}

const StrainMemory* memory_of(std::span<const StrainMemory> memory, std::size_t element) {
  return memory.empty() ? nullptr : &memory[element];
}

/// `from` is not read again before all other elements have been: it need not be fetched to be overwritten.
void store_past_caches(const StrainMemory& from, StrainMemory& to) {
  static_assert(alignof(StrainMemory) >= sizeof(__m256d));
  for (std::size_t i = 0; i < from.alpha.size(); ++i) {
    for (std::size_t c = 0; c < from.alpha[i].size(); ++c)
      _mm256_stream_pd(to.alpha[i][c].data(), _mm256_loadu_pd(from.alpha[i][c].data()));
  }
}

// The element holds its volume in the mean; what a part of it answers to losing its own with is its shape. A barrier
// (eq. 40) as stiff as the mean would be unlike all around it, and cut steps short whose factor does not have it yet.
Barrier barrier_at(const QuadraticRest& rest, int point, double j) {
  return barrier({.gradients = {}, .volume = 0, .lambda = 0, .mu = rest.mu[point]}, j);
}

Barrier barrier_of(const TissueModel& model, std::size_t tet, double j) {
  return barrier({.gradients = {}, .volume = 0, .lambda = 0, .mu = model.tets[tet].mu}, j);
}

/// The first element of a run and the one after its last.
std::pair<std::size_t, std::size_t> elements_of(const TetRun& run) {
  return {static_cast<std::size_t>(run.begin) / kTetsOfRefined, static_cast<std::size_t>(run.end) / kTetsOfRefined};
}

/// each(element) for every one; parts of them by the companion, which must not matter.
template <typename Each>
void for_elements(const TissueModel& model, Companion* companion, const Each& each) {
  if (!model.is_quadratic()) return;
  in_parts(companion, static_cast<int>(model.runs.size()), [&](int r) {
    const auto [begin, end] = elements_of(model.runs[r]);
    for (std::size_t e = begin; e < end; ++e) each(e);
  });
}

/// det F of the eight tetrahedra.
OfTets volume_ratios(const QuadraticRest& rest, const NodeLanes& x, const Eigen::Matrix3Xd& positions) {
  const OfTets now = tet_determinants(rest, x, positions);
  return {now[0] / rest.tets[0], now[1] / rest.tets[1]};
}

/// An element now.
struct Deformed {
  Deformed(const QuadraticRest& rest, const Eigen::Matrix3Xd& positions) {
    const NodeLanes x = node_lanes(rest, positions);
    f = deformation_gradients(rest, x);
    j = determinant(f);
    of_tets = volume_ratios(rest, x, positions);
  }
  int inverted_tets() const {
    return static_cast<int>(kTetsOfRefined) - static_cast<int>((of_tets[0] > 0).count() + (of_tets[1] > 0).count());
  }
  LaneMatrix f;
  Lanes j;         // det F
  OfTets of_tets;  // det F of the eight tetrahedra
};

/// Brings the rotations of an element's points to F; returns how many of them are inverted.
/// @param[out] r  the rotations
int turn(const Deformed& now, std::span<Eigen::Quaterniond> of_points, LaneMatrix& r) {
  std::array<Lanes, 4> q = quaternions_of(of_points, 0);
  if ((now.j > 0).all() && closest_rotations(now.f, q)) {
    set_quaternions(q, of_points, 0);
    r = matrix_of(q);
    return 0;
  }
  int inverted = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    auto& rotation = of_points[static_cast<std::size_t>(lane)];
    rotation = closest_rotation(of_lane(now.f, lane), rotation);
    if (!(now.j[lane] > 0)) ++inverted;
  }
  r = rotations_of(of_points, 0);
  return inverted;
}

/// Forces of an element on its nodes, to add(node of the element, axis, N); returns how many points are in the
/// barrier.
template <typename Add>
int forces_of_points(const QuadraticRest& rest, const Deformed& now, const LaneMatrix& r, double size,
                     bool linearised, const StrainMemory* memory, const Add& add) {
  int squeezed = 0;
  const auto& f = now.f;
  const auto& j = now.j;
  const LaneMatrix s = stretch_of(r, f);
  const LaneMatrix& volume_gradient = linearised ? r : cofactors_of(f);
  const Lanes dilatation = linearised ? Lanes(trace(s) - 2) : j;
  Lanes tension = rest.volume * (rest.lambda * ((rest.volume * dilatation).sum() / rest.volume.sum() - cubed(size)));
  if (!linearised && size == 1 && (j < kSqueezed).any()) {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!(j[lane] < kSqueezed)) continue;
      tension[lane] += rest.volume[lane] * barrier_at(rest, lane, j[lane]).slope;
      ++squeezed;
    }
  }
  // First Piola-Kirchhoff stress times volume, 2 mu R (S - g I) + lambda (J - g^3) cof F.
  LaneMatrix strain = strain_of(s, Lanes::Constant(size));
  if (!rest.linear && !linearised) strain = stress_of(rest, strain, Lanes::Constant(size), memory, layers_of(rest));
  if (rest.layered && linearised) {
    const LaneMatrix along = along_layers(rest, strain);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) strain[i][k] += rest.sheets * along[i][k];
    }
  }
  const Lanes twice_mu = 2 * rest.mu * rest.volume;
  LaneMatrix p;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      p[i][k] = twice_mu * (r[i][0] * strain[0][k] + r[i][1] * strain[1][k] + r[i][2] * strain[2][k]) +
                tension * volume_gradient[i][k];
    }
  }
  add_nodal_forces(rest, p, add);
  return squeezed;
}

/// each(t, det F) of the eight tetrahedra of an element.
template <typename Each>
void for_tets(const TissueModel& model, const Eigen::Matrix3Xd& positions, std::size_t element, const Each& each) {
  const QuadraticRest& rest = model.quadratics[element];
  const OfTets j = volume_ratios(rest, node_lanes(rest, positions), positions);
  for (std::size_t k = 0; k < kTetsOfRefined; ++k)
    each(kTetsOfRefined * element + k, j[k / kLanes][static_cast<Eigen::Index>(k % kLanes)]);
}

/// Forces of the barriers of an element's tetrahedra, as forces_of_points(); returns how many are in it.
/// @param of_tets  det F of them
template <typename Add>
int forces_of_flat_tets(const TissueModel& model, const Eigen::Matrix3Xd& positions, std::size_t element, double size,
                        const OfTets& of_tets, const Add& add) {
  if (size != 1 || (of_tets[0].min(of_tets[1]) >= kSqueezed).all()) return 0;
  int squeezed = 0;
  for (std::size_t which = 0; which < kTetsOfRefined; ++which) {
    const double j = of_tets[which / kLanes][static_cast<Eigen::Index>(which % kLanes)];
    if (!(j < kSqueezed) || !(j > 0)) continue;
    ++squeezed;
    const std::size_t t = kTetsOfRefined * element + which;
    const TetRest& rest = model.tets[t];
    const Eigen::Matrix3d f = deformation_gradient(model, positions, static_cast<int>(t));
    const Eigen::Matrix<double, 3, 4> forces =
        rest.volume * barrier_of(model, t, j).slope * cofactor(f) * rest.gradients;
    const std::array<std::size_t, 4> places = places_of(model, static_cast<int>(t));
    for (std::size_t k = 0; k < places.size(); ++k) {
      for (std::size_t i = 0; i < 3; ++i) {
        add(places[k], i, forces(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)));
      }
    }
  }
  return squeezed;
}

/// Forces of element e on its nodes, to add(node of the element, axis, N); returns how many points and tetrahedra are
/// in the barrier.
template <typename Add>
int forces_of(const TissueModel& model, const Eigen::Matrix3Xd& positions, std::size_t e, const Deformed& now,
              const LaneMatrix& r, std::span<const double> rest_size, const StrainMemory* memory, const Add& add) {
  const double size = size_of(rest_size, e);
  return forces_of_points(model.quadratics[e], now, r, size, false, memory, add) +
         forces_of_flat_tets(model, positions, e, size, now.of_tets, add);
}

/// add() of forces_of() for element e of a run.
auto add_to(Eigen::Ref<Eigen::Matrix3Xd>& forces, const QuadraticRest& rest, const TetRun& run) {
  return [&forces, &rest, &run](std::size_t a, std::size_t i, double force) {
    forces(static_cast<Eigen::Index>(i), rest.nodes[a] - run.first_node) += force;
  };
}

}  // namespace

std::array<std::array<Lanes, 3>, 10> gradients_of(const QuadraticRest& rest) {
  std::array<std::array<Lanes, 3>, 10> gradients;
  for (std::size_t a = 0; a < gradients.size(); ++a) {
    std::array<Lanes, 3> natural;  // dN_a/dxi_k
    for (std::size_t k = 0; k < 3; ++k) {
      for (int p = 0; p < kLanes; ++p) {
        natural[k][p] = gradients_at_points()[static_cast<std::size_t>(p)](static_cast<Eigen::Index>(k),
                                                                           static_cast<Eigen::Index>(a));
      }
    }
    for (std::size_t i = 0; i < 3; ++i) {
      gradients[a][i] =
          natural[0] * rest.natural[0][i] + natural[1] * rest.natural[1][i] + natural[2] * rest.natural[2][i];
    }
  }
  return gradients;
}

std::array<std::size_t, 4> places_of(const TissueModel& model, int tet) {
  const auto t = static_cast<std::size_t>(tet);
  const std::array<int, 10>& nodes = model.quadratics[t / kTetsOfRefined].nodes;
  std::array<std::size_t, 4> places{};
  for (std::size_t k = 0; k < places.size(); ++k) {
    const auto* const found = std::find(nodes.begin(), nodes.end(), model.mesh.tets[t][k]);
    places[k] = static_cast<std::size_t>(found - nodes.begin());
  }
  return places;
}

std::vector<QuadraticRest> quadratic_elements(const TetMesh& mesh, std::span<const ElasticMaterial> materials) {
  if (mesh.tets.size() % kTetsOfRefined != 0) {
    throw std::invalid_argument("tissue model: " + std::to_string(mesh.tets.size()) +
                                " tetrahedra are no quadratic elements: those come in eights");
  }
  Eigen::Matrix3Xd positions(3, static_cast<Eigen::Index>(mesh.nodes.size()));
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) positions.col(static_cast<Eigen::Index>(n)) = mesh.nodes[n];
  std::vector<QuadraticRest> elements(mesh.tets.size() / kTetsOfRefined);
  for (std::size_t e = 0; e < elements.size(); ++e) {
    QuadraticRest& rest = elements[e];
    rest.nodes = nodes_of(mesh, e);
    rest.inner = inner_of(mesh, e);
    rest.tets = tet_determinants(rest, node_lanes(rest, positions), positions);
    const Gradients x = rest_of(mesh, rest.nodes);
    double lambda = 0;                                          // integral
    double compressibility = 0;                                 // integral of 1 / lambda
    bool in_layers = false;                                     // it is known how they lie
    std::array<Lanes, 2> fading{Lanes::Zero(), Lanes::Zero()};  // share times rate
    double poisson_ratio = 0;
    for (int p = 0; p < kLanes; ++p) {
      const Gradients& local = gradients_at_points()[static_cast<std::size_t>(p)];
      const Eigen::Matrix3d jacobian = x * local.transpose();
      const double determinant = jacobian.determinant();
      if (!(determinant > 0)) refuse(e, "is not positively oriented");
      set_lane(jacobian.inverse(), p, rest.natural);
      rest.volume[p] = determinant / 24;
      double along = 0;     // mean of mu
      double softness = 0;  // mean of 1 / mu, across layers
      Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();
      for (const std::size_t near : {0U, 4U}) {
        const ElasticMaterial& m = materials[kTetsOfRefined * e + near + static_cast<std::size_t>(p)];
        const double mu = 0.5 * m.young_modulus / (2 * (1 + m.poisson_ratio));
        const double lambda_mu = 2 * m.poisson_ratio / (1 - 2 * m.poisson_ratio);  // lambda / mu
        along += mu;
        softness += 0.25 / (mu * m.layers.across);
        lambda += rest.volume[p] * mu * lambda_mu;
        compressibility += 0.25 * rest.volume[p] / (mu * m.layers.across * lambda_mu);
        poisson_ratio += 0.5 * m.poisson_ratio / kLanes;
        const Eigen::Map<const Eigen::Vector3d> normal(m.layers.normal.data());
        in_layers = in_layers || !normal.isZero();
        normals += normal * normal.transpose();
        rest.stiffening[p] += mu * m.stiffening;
        for (std::size_t i = 0; i < 2; ++i) {
          rest.share[i][p] += mu * m.relaxation[i].share;
          fading[i][p] += mu * m.relaxation[i].share / m.relaxation[i].time_s;
        }
      }
      rest.stiffening[p] /= along;
      for (std::size_t i = 0; i < 2; ++i) {
        rest.rate[i][p] = rest.share[i][p] > 0 ? fading[i][p] / rest.share[i][p] : 0;
        rest.share[i][p] /= along;
      }
      const double stiffer = along * softness - 1;
      if (stiffer < kSameAcross || normals.isZero()) {
        rest.mu[p] = along;
        continue;
      }
      rest.mu[p] = 1 / softness;
      rest.sheets[p] = stiffer;
      const Eigen::Vector3d normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(normals).eigenvectors().col(2);
      for (std::size_t i = 0; i < 3; ++i) rest.normal[i][p] = normal[static_cast<Eigen::Index>(i)];
    }
    rest.spread = poisson_ratio / (1 - poisson_ratio);
    // One pressure: the softer part gives way to it the more.
    rest.lambda = in_layers ? rest.volume.sum() / compressibility : lambda / rest.volume.sum();
    rest.layered = (rest.sheets > 0).any();
    rest.linear =
        !rest.layered && (rest.stiffening == 0).all() && (rest.share[0] == 0).all() && (rest.share[1] == 0).all();
  }
  return elements;
}

Eigen::Array4d volumes_at_points(const TetMesh& mesh, std::size_t element) {
  const Gradients x = rest_of(mesh, nodes_of(mesh, element));
  Eigen::Array4d volumes;
  for (int p = 0; p < kLanes; ++p)
    volumes[p] = (x * gradients_at_points()[static_cast<std::size_t>(p)].transpose()).determinant() / 24;
  return volumes;
}

int update_quadratic_rotations(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                               std::span<Eigen::Quaterniond> rotations) {
  int inverted = 0;
  LaneMatrix r;
  for (std::size_t e = 0; e < model.quadratics.size(); ++e) {
    const Deformed now(model.quadratics[e], positions);
    inverted += turn(now, rotations.subspan(kLanes * e, kLanes), r) + now.inverted_tets();
  }
  return inverted;
}

ElementCount update_quadratic_rotations_and_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                                                   std::span<Eigen::Quaterniond> rotations, const TetRun& run,
                                                   Eigen::Ref<Eigen::Matrix3Xd> forces,
                                                   std::span<const double> rest_size,
                                                   std::span<const StrainMemory> memory, const Relaxing& relaxing) {
  ElementCount count;
  LaneMatrix r;
  StrainMemory relaxed;
  const auto [begin, end] = elements_of(run);
  for (std::size_t e = begin; e < end; ++e) {
    const QuadraticRest& rest = model.quadratics[e];
    const Deformed now(rest, positions);
    count.inverted += turn(now, rotations.subspan(kLanes * e, kLanes), r) + now.inverted_tets();
    const StrainMemory* remembered = memory_of(memory, e);
    if (!rest.linear && !relaxing.after.empty()) {
      relaxed = *remembered;
      relax(rest, strain_of(stretch_of(r, now.f), Lanes::Constant(size_of(rest_size, e))), relaxing.dt, relaxed);
      remembered = &relaxed;
      store_past_caches(relaxed, relaxing.after[e]);
    }
    count.squeezed += forces_of(model, positions, e, now, r, rest_size, remembered, add_to(forces, rest, run));
  }
  _mm_sfence();
  return count;
}

int quadratic_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                     std::span<const Eigen::Quaterniond> rotations, const TetRun& run,
                     Eigen::Ref<Eigen::Matrix3Xd> forces, std::span<const double> rest_size,
                     std::span<const StrainMemory> memory) {
  int squeezed = 0;
  const auto [begin, end] = elements_of(run);
  for (std::size_t e = begin; e < end; ++e) {
    const Deformed now(model.quadratics[e], positions);
    squeezed += forces_of(model, positions, e, now, rotations_of(rotations, e), rest_size, memory_of(memory, e),
                          add_to(forces, model.quadratics[e], run));
  }
  return squeezed;
}

void find_cofactors(const TissueModel& model, const Eigen::Matrix3Xd& positions, std::span<Eigen::Matrix3d> cofactors,
                    Companion* companion) {
  for_elements(model, companion, [&](std::size_t e) {
    const LaneMatrix c = cofactors_of(deformation_gradients(model.quadratics[e], positions));
    for (int lane = 0; lane < kLanes; ++lane)
      cofactors[kLanes * e + static_cast<std::size_t>(lane)] = of_lane(c, lane);
  });
}

void find_squeezed_quadratics(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                              std::span<const double> rest_size, std::vector<SqueezedTet>& found) {
  for (std::size_t e = 0; e < model.quadratics.size(); ++e) {
    if (size_of(rest_size, e) != 1) continue;
    const LaneMatrix f = deformation_gradients(model.quadratics[e], positions);
    const Lanes j = determinant(f);
    for (int lane = 0; lane < kLanes; ++lane) {
      const double curvature = barrier_at(model.quadratics[e], lane, j[lane]).curvature;
      if (curvature > 0) {
        found.push_back({.tet = kSqueezable * static_cast<int>(e) + lane,
                         .curvature = curvature,
                         .cofactor = cofactor(of_lane(f, lane))});
      }
    }
    for_tets(model, positions, e, [&](std::size_t t, double j_of_tet) {
      const double curvature = barrier_of(model, t, j_of_tet).curvature;
      if (!(curvature > 0)) return;
      const int which = kLanes + static_cast<int>(t - kTetsOfRefined * e);
      found.push_back({.tet = kSqueezable * static_cast<int>(e) + which,
                       .curvature = curvature,
                       .cofactor = cofactor(deformation_gradient(model, positions, static_cast<int>(t)))});
    });
  }
}

double uninverted_fraction_of_points(const TissueModel& model, const Eigen::Matrix3Xd& before,
                                     const Eigen::Matrix3Xd& after, const TetRun& run) {
  double fraction = 1;
  const auto [begin, end] = elements_of(run);
  for (std::size_t e = begin; e < end; ++e) {
    const QuadraticRest& rest = model.quadratics[e];
    const LaneMatrix f = deformation_gradients(rest, before);
    const LaneMatrix g = deformation_gradients(rest, after);
    fraction = uninverted_fraction(f, difference(g, f), fraction);
  }
  return fraction;
}

void find_quadratic_stiffening(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                               std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size,
                               std::size_t element, std::span<PointStiffness> stiffness) {
  const QuadraticRest& rest = model.quadratics[element];
  const std::span<PointStiffness> of_points = stiffness.subspan(kLanes * element, kLanes);
  if (rest.linear) {
    std::fill(of_points.begin(), of_points.end(), PointStiffness{});
    return;
  }
  const LaneMatrix r = rotations_of(rotations, element);
  const LaneMatrix stretch = stretch_of(r, deformation_gradients(rest, positions));
  find_stiffness(rest, r, strain_of(stretch, Lanes::Constant(size_of(rest_size, element))), of_points);
}

void relax_quadratic_strain(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                            std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size,
                            double dt, std::span<StrainMemory> memory, Companion* companion) {
  for_elements(model, companion, [&](std::size_t e) {
    const QuadraticRest& rest = model.quadratics[e];
    if (rest.linear) return;
    const LaneMatrix stretch = stretch_of(rotations_of(rotations, e), deformation_gradients(rest, positions));
    relax(rest, strain_of(stretch, Lanes::Constant(size_of(rest_size, e))), dt, memory[e]);
  });
}

int quadratic_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                     std::span<const Eigen::Quaterniond> rotations, Eigen::Ref<Eigen::Matrix3Xd> forces,
                     std::span<const double> rest_size, bool linearised, std::span<const StrainMemory> memory) {
  int squeezed = 0;
  forces.setZero();
  for (std::size_t e = 0; e < model.quadratics.size(); ++e) {
    const QuadraticRest& rest = model.quadratics[e];
    const Deformed now(rest, positions);
    const auto add = [&](std::size_t a, std::size_t i, double force) {
      forces(static_cast<Eigen::Index>(i), rest.nodes[a]) += force;
    };
    const LaneMatrix r = rotations_of(rotations, e);
    squeezed += linearised ? forces_of_points(rest, now, r, size_of(rest_size, e), true, memory_of(memory, e), add)
                           : forces_of(model, positions, e, now, r, rest_size, memory_of(memory, e), add);
  }
  return squeezed;
}

double quadratic_energy(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                        std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size,
                        std::span<const StrainMemory> memory) {
  double energy = 0;
  for (std::size_t e = 0; e < model.quadratics.size(); ++e) {
    const QuadraticRest& rest = model.quadratics[e];
    const LaneMatrix f = deformation_gradients(rest, positions);
    const LaneMatrix s = stretch_of(rotations_of(rotations, e), f);
    const double size = size_of(rest_size, e);
    const Lanes squares = energy_of(rest, strain_of(s, Lanes::Constant(size)), memory_of(memory, e), layers_of(rest));
    energy += (rest.volume * rest.mu * squares).sum();
    const Lanes j = determinant(f);
    const double volume = rest.volume.sum();
    const double change = (rest.volume * j).sum() / volume - cubed(size);
    energy += 0.5 * rest.lambda * volume * change * change;
    for (int lane = 0; lane < kLanes && size == 1; ++lane) {
      energy += rest.volume[lane] * barrier_at(rest, lane, j[lane]).energy;
    }
    if (size != 1) continue;
    for_tets(model, positions, e, [&](std::size_t t, double j_of_tet) {
      energy += model.tets[t].volume * barrier_of(model, t, j_of_tet).energy;
    });
  }
  return energy;
}

ElementWork work_of(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                    std::span<const Eigen::Quaterniond> rotations, int element, double size,
                    std::span<const StrainMemory> memory) {
  const auto e = static_cast<std::size_t>(element);
  const QuadraticRest& rest = model.quadratics[e];
  const LaneMatrix f = deformation_gradients(rest, positions);
  const LaneMatrix s = stretch_of(rotations_of(rotations, e), f);
  Lanes shape = -size * trace(s);  // (S - g I) : S
  for (const auto& row : s) {
    for (const Lanes& entry : row) shape += entry.square();
  }
  if (!rest.linear) {
    const LaneMatrix stress = stress_of(rest, strain_of(s, Lanes::Constant(size)), Lanes::Constant(size),
                                        memory_of(memory, e), layers_of(rest));
    shape.setZero();
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) shape += 0.5 * (stress[i][k] + stress[k][i]) * s[i][k];
    }
  }
  const double volume = (rest.volume * determinant(f)).sum();
  return {.volume = volume,
          .work = (2 * rest.volume * rest.mu * shape).sum() +
                  3 * rest.lambda * (volume / rest.volume.sum() - cubed(size)) * volume};
}

}  // namespace stylet::physics
