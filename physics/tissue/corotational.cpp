#include "physics/tissue/corotational.h"

#include "physics/tissue/closest_rotation.h"
#include "physics/tissue/inversion.h"
#include "physics/tissue/lanes.h"
#include "physics/tissue/membrane.h"
#include "physics/tissue/quadratic.h"
#include "physics/tissue/refinement.h"

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

namespace stylet::physics {
namespace {

/// Deformation gradients of tetrahedra first .. first + 3.
LaneMatrix deformation_gradients(const TissueModel& model, const Eigen::Matrix3Xd& positions, int first) {
  LaneMatrix edges;  // [axis][edge]
  for (int lane = 0; lane < kLanes; ++lane) {
    const auto& n = model.mesh.tets[static_cast<std::size_t>(first + lane)];
    for (std::size_t e = 0; e < 3; ++e) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<Eigen::Index>(axis);
        edges[axis][e][lane] = positions(i, n[e + 1]) - positions(i, n[0]);
      }
    }
  }
  const LaneMatrix& gradients = model.lanes[static_cast<std::size_t>(first / kLanes)].gradients;
  LaneMatrix f;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      f[i][j] = edges[i][0] * gradients[j][0] + edges[i][1] * gradients[j][1] + edges[i][2] * gradients[j][2];
    }
  }
  return f;
}

/// The law of tetrahedron t and those beside it; null: none.
const StrainLaw* law_of(const TissueModel& model, int t) {
  if (model.laws.empty()) return nullptr;
  const StrainLaw& law = model.laws[static_cast<std::size_t>(t / kLanes)];
  return law.linear ? nullptr : &law;
}

const StrainMemory* memory_of(std::span<const StrainMemory> memory, int t) {
  return memory.empty() ? nullptr : &memory[static_cast<std::size_t>(t / kLanes)];
}

/// A matrix in one of the lanes; in the others nothing.
LaneMatrix in_lane(const Eigen::Matrix3d& m, int lane) {
  LaneMatrix result;
  for (auto& row : result) row.fill(Lanes::Zero());
  set_lane(m, lane, result);
  return result;
}

/// Edges without stress over those at rest of tetrahedra first .. first + 3.
Lanes sizes_of(std::span<const double> rest_size, int first) {
  return rest_size.empty() ? Lanes(Lanes::Ones()) : Lanes(Eigen::Map<const Lanes>(rest_size.data() + first));
}

/// sym(R^T F) - g I of up to four tetrahedra from `first` on, and R.
struct LaneStrain {
  LaneMatrix rotation;
  LaneMatrix strain;
};
LaneStrain strain_at(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                     std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size, int first) {
  LaneStrain found;
  const int count = std::min(kLanes, model.tet_count() - first);
  if (count == kLanes) {
    found.rotation = matrix_of(quaternions_of(rotations, first));
    found.strain = strain_of(stretch_of(found.rotation, deformation_gradients(model, positions, first)),
                             sizes_of(rest_size, first));
    return found;
  }
  found.rotation = found.strain = in_lane(Eigen::Matrix3d::Zero(), 0);
  for (int lane = 0; lane < count; ++lane) {
    const int t = first + lane;
    const Eigen::Matrix3d r = rotations[static_cast<std::size_t>(t)].toRotationMatrix();
    Eigen::Matrix3d strain = r.transpose() * deformation_gradient(model, positions, t);
    strain = (0.5 * (strain + strain.transpose())).eval();
    strain.diagonal().array() -= rest_size.empty() ? 1 : rest_size[static_cast<std::size_t>(t)];
    set_lane(r, lane, found.rotation);
    set_lane(strain, lane, found.strain);
  }
  return found;
}

}  // namespace

CorotatedStress corotated_stress(const TetRest& rest, const Eigen::Matrix3d& f, const Eigen::Matrix3d& r,
                                 double rest_size) {
  const Eigen::Matrix3d m = r.transpose() * f;
  CorotatedStress result;
  result.stretch = 0.5 * (m + m.transpose());
  const Eigen::Matrix3d strain = result.stretch - rest_size * Eigen::Matrix3d::Identity();
  result.stress = 2 * rest.mu * strain;
  result.stress.diagonal().array() += rest.lambda * strain.trace();
  return result;
}

CorotatedStress corotated_stress(const TissueModel& model, int tet, const Eigen::Matrix3d& f,
                                 const Eigen::Matrix3d& r, double rest_size, std::span<const StrainMemory> memory) {
  const TetRest& rest = model.tets[static_cast<std::size_t>(tet)];
  CorotatedStress result = corotated_stress(rest, f, r, rest_size);
  const StrainLaw* const law = law_of(model, tet);
  if (law == nullptr) return result;
  const Eigen::Matrix3d strain = result.stretch - rest_size * Eigen::Matrix3d::Identity();
  const int lane = tet % kLanes;
  const LaneMatrix stress =
      stress_of(*law, in_lane(strain, lane), Lanes::Constant(rest_size), memory_of(memory, tet));
  result.stress = 2 * rest.mu * of_lane(stress, lane);
  result.stress.diagonal().array() += rest.lambda * strain.trace();
  return result;
}

Eigen::Matrix3d deformation_gradient(const TissueModel& model, const Eigen::Matrix3Xd& positions, int tet) {
  const auto& n = model.mesh.tets[tet];
  Eigen::Matrix3d edges;
  for (int a = 0; a < 3; ++a) edges.col(a) = positions.col(n[a + 1]) - positions.col(n[0]);
  return edges * model.tets[tet].gradients.rightCols<3>().transpose();
}

namespace {

int update_rotations_one_by_one(const TissueModel& model, const Eigen::Matrix3Xd& positions, int begin, int end,
                                std::span<Eigen::Quaterniond> rotations) {
  int inverted = 0;
  for (int t = begin; t < end; ++t) {
    const Eigen::Matrix3d f = deformation_gradient(model, positions, t);
    if (!(f.determinant() > 0)) ++inverted;
    auto& q = rotations[t];
    q = closest_rotation(f, q);
  }
  return inverted;
}

/// Adds to the columns from `first_node` on; returns how many tetrahedra are in the barrier.
int add_forces_one_by_one(const TissueModel& model, const Eigen::Matrix3Xd& positions, int begin, int end,
                          std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size,
                          std::span<const StrainMemory> memory, bool linearised, int first_node,
                          Eigen::Ref<Eigen::Matrix3Xd> forces) {
  int squeezed = 0;
  for (int t = begin; t < end; ++t) {
    const TetRest& rest = model.tets[t];
    const double size = rest_size.empty() ? 1 : rest_size[t];
    const Eigen::Matrix3d r = rotations[t].toRotationMatrix();
    const Eigen::Matrix3d f = deformation_gradient(model, positions, t);
    const Eigen::Matrix3d stress = linearised ? corotated_stress(rest, f, r, size).stress
                                              : corotated_stress(model, t, f, r, size, memory).stress;
    // Stress times volume, in the deformed frame.
    Eigen::Matrix3d p = rest.volume * r * stress;
    if (const double j = f.determinant(); j < kSqueezed && size == 1 && !linearised) {
      p += rest.volume * barrier(rest, j).slope * cofactor(f);
      ++squeezed;
    }
    const auto& n = model.mesh.tets[t];
    for (int a = 0; a < 4; ++a) forces.col(n[a] - first_node) += p * rest.gradients.col(a);
  }
  return squeezed;
}

/// Forces of tetrahedra first .. first + 3, none of them in the barrier, at F and R.
void add_forces_of_lanes(const TissueModel& model, const LaneMatrix& f, const LaneMatrix& r, int first,
                         std::span<const double> rest_size, std::span<const StrainMemory> memory, int first_node,
                         Eigen::Ref<Eigen::Matrix3Xd> forces) {
  LaneMatrix s;  // R^T F, its symmetric part, stress times volume
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) s[i][j] = r[0][i] * f[0][j] + r[1][i] * f[1][j] + r[2][i] * f[2][j];
  }
  const TetLanes& rest = model.lanes[static_cast<std::size_t>(first / kLanes)];
  const Lanes size = sizes_of(rest_size, first);
  for (std::size_t i = 0; i < 3; ++i) s[i][i] -= size;
  const Lanes twice_mu = 2 * rest.mu * rest.volume;
  const Lanes pressure = rest.lambda * rest.volume * (s[0][0] + s[1][1] + s[2][2]);
  if (const StrainLaw* const law = law_of(model, first)) {
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < i; ++j) s[i][j] = s[j][i] = 0.5 * (s[i][j] + s[j][i]);
    }
    s = stress_of(*law, s, size, memory_of(memory, first));
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) s[i][j] *= twice_mu;
      s[i][i] += pressure;
    }
  } else {
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < i; ++j) s[i][j] = s[j][i] = 0.5 * twice_mu * (s[i][j] + s[j][i]);
      s[i][i] = twice_mu * s[i][i] + pressure;
    }
  }
  const LaneMatrix& g = rest.gradients;
  LaneMatrix force;  // [axis][node - 1]
  for (std::size_t i = 0; i < 3; ++i) {
    std::array<Lanes, 3> p;
    for (std::size_t j = 0; j < 3; ++j) p[j] = r[i][0] * s[0][j] + r[i][1] * s[1][j] + r[i][2] * s[2][j];
    for (std::size_t e = 0; e < 3; ++e) force[i][e] = p[0] * g[0][e] + p[1] * g[1][e] + p[2] * g[2][e];
  }
  for (int lane = 0; lane < kLanes; ++lane) {
    const auto& n = model.mesh.tets[static_cast<std::size_t>(first + lane)];
    for (std::size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      for (std::size_t e = 0; e < 3; ++e) forces(axis, n[e + 1] - first_node) += force[i][e][lane];
      forces(axis, n[0] - first_node) -= force[i][0][lane] + force[i][1][lane] + force[i][2][lane];
    }
  }
}

/// relax() of up to four tetrahedra from `first` on, at strain(), where they have a law.
template <typename Strain>
void relax_lanes(const TissueModel& model, int first, std::span<const StrainMemory> memory, const Relaxing& relaxing,
                 const Strain& strain) {
  const StrainLaw* const law = law_of(model, first);
  if (law == nullptr || relaxing.after.empty()) return;
  const auto group = static_cast<std::size_t>(first / kLanes);
  relaxing.after[group] = memory[group];
  relax(*law, strain(), relaxing.dt, relaxing.after[group]);
}

/// Rotations, what relaxes, and forces of tetrahedra first .. first + 3; false, and nothing is done, where one is in
/// the barrier or is not near its rotation.
bool add_lanes(const TissueModel& model, const Eigen::Matrix3Xd& positions, int first,
               std::span<Eigen::Quaterniond> rotations, std::span<const double> rest_size,
               std::span<const StrainMemory> memory, const Relaxing& relaxing, int first_node,
               Eigen::Ref<Eigen::Matrix3Xd> forces) {
  const LaneMatrix f = deformation_gradients(model, positions, first);
  std::array<Lanes, 4> q = quaternions_of(rotations, first);
  if (!(determinant(f) >= kSqueezed).all() || !closest_rotations(f, q)) return false;
  set_quaternions(q, rotations, first);
  const LaneMatrix r = matrix_of(q);
  relax_lanes(model, first, memory, relaxing,
              [&] { return strain_of(stretch_of(r, f), sizes_of(rest_size, first)); });
  add_forces_of_lanes(model, f, r, first, rest_size, relaxing.after.empty() ? memory : relaxing.after, first_node,
                      forces);
  return true;
}

/// of_run(run, forces of the run) for all of them, and the forces of all.
template <typename OfRun>
ElementCount sum_over_runs(const TissueModel& model, Eigen::Ref<Eigen::Matrix3Xd> forces, ElementScratch& scratch,
                           const OfRun& of_run) {
  if (scratch.sums.size() < model.runs.size()) scratch.sums.resize(model.runs.size());
  std::vector<ElementCount> counts(model.runs.size());
  in_parts(scratch.companion, static_cast<int>(model.runs.size()), [&](int r) {
    const TetRun& run = model.runs[r];
    const int nodes = run.end_node - run.first_node;
    if (scratch.sums[r].cols() < nodes) scratch.sums[r].resize(3, nodes);
    auto sum = scratch.sums[r].leftCols(nodes);
    sum.setZero();
    counts[r] = of_run(run, sum);
  });
  const int parts = model.runs.size() > 1 ? kSharedParts : 1;
  in_parts(scratch.companion, parts, [&](int part) {
    const int begin = model.node_count() * part / parts, end = model.node_count() * (part + 1) / parts;
    forces.middleCols(begin, end - begin).setZero();
    for (std::size_t r = 0; r < model.runs.size(); ++r) {  // in their order: the same bits whoever did which
      const int first = std::max(begin, model.runs[r].first_node), last = std::min(end, model.runs[r].end_node);
      if (first >= last) continue;
      forces.middleCols(first, last - first) +=
          scratch.sums[r].middleCols(first - model.runs[r].first_node, last - first);
    }
  });
  ElementCount all;
  for (const ElementCount& count : counts) {
    all.inverted += count.inverted;
    all.squeezed += count.squeezed;
  }
  return all;
}

/// What relaxes in up to four tetrahedra from `first` on.
void relax_four(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size, int first,
                double dt, std::span<StrainMemory> memory) {
  if (const StrainLaw* const law = law_of(model, first)) {
    relax(*law, strain_at(model, positions, rotations, rest_size, first).strain, dt,
          memory[static_cast<std::size_t>(first / kLanes)]);
  }
}

/// each(first) of every four tetrahedra; parts of them by the companion, which must not matter.
template <typename Each>
void for_fours(const TissueModel& model, Companion* companion, const Each& each) {
  in_parts(companion, static_cast<int>(model.runs.size()), [&](int r) {
    for (int first = model.runs[r].begin; first < model.runs[r].end; first += kLanes) each(first);
  });
}

/// What strain is measured in at a time: a quadratic element, or four tetrahedra.
int tets_a_group(const TissueModel& model) {
  return model.is_quadratic() ? kTetsOfRefined : kLanes;
}

void find_stiffening_of_group(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                              std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size,
                              int group, std::span<PointStiffness> stiffness) {
  if (model.is_quadratic()) {
    find_quadratic_stiffening(model, positions, rotations, rest_size, static_cast<std::size_t>(group), stiffness);
    return;
  }
  const int first = kLanes * group;
  std::array<PointStiffness, kLanes> found;
  if (const StrainLaw* const law = law_of(model, first)) {
    const LaneStrain at = strain_at(model, positions, rotations, rest_size, first);
    find_stiffness(*law, at.rotation, at.strain, found);
  }
  std::copy_n(found.begin(), std::min(kLanes, model.tet_count() - first), stiffness.begin() + first);
}

}  // namespace

int update_rotations(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                     std::span<Eigen::Quaterniond> rotations) {
  if (model.is_quadratic()) return update_quadratic_rotations(model, positions, rotations);
  int inverted = 0;
  const int in_lanes = model.tet_count() / kLanes * kLanes;
  for (int first = 0; first < in_lanes; first += kLanes) {
    const LaneMatrix f = deformation_gradients(model, positions, first);
    std::array<Lanes, 4> q = quaternions_of(rotations, first);
    if ((determinant(f) > 0).all() && closest_rotations(f, q)) {
      set_quaternions(q, rotations, first);
    } else {
      inverted += update_rotations_one_by_one(model, positions, first, first + kLanes, rotations);
    }
  }
  return inverted + update_rotations_one_by_one(model, positions, in_lanes, model.tet_count(), rotations);
}

int internal_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                    std::span<const Eigen::Quaterniond> rotations, Eigen::Ref<Eigen::Matrix3Xd> forces,
                    std::span<const double> rest_size, bool with_barrier, std::span<const StrainMemory> memory) {
  int squeezed = 0;
  if (model.is_quadratic()) {
    squeezed = quadratic_forces(model, positions, rotations, forces, rest_size, !with_barrier, memory);
  } else {
    forces.setZero();
    squeezed = add_forces_one_by_one(model, positions, 0, model.tet_count(), rotations, rest_size, memory,
                                     !with_barrier, 0, forces);
  }
  add_membrane_forces(model, positions, !with_barrier, forces);
  return squeezed;
}

int internal_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                    std::span<const Eigen::Quaterniond> rotations, Eigen::Ref<Eigen::Matrix3Xd> forces,
                    std::span<const double> rest_size, std::span<const StrainMemory> memory,
                    ElementScratch& scratch) {
  if (!model.is_quadratic() || model.runs.size() == 1) {  // tetrahedra come here only when a cavity is filled
    return internal_forces(model, positions, rotations, forces, rest_size, true, memory);
  }
  const ElementCount all =
      sum_over_runs(model, forces, scratch, [&](const TetRun& run, Eigen::Ref<Eigen::Matrix3Xd> sum) {
        ElementCount count;
        count.squeezed = quadratic_forces(model, positions, rotations, run, sum, rest_size, memory);
        return count;
      });
  add_membrane_forces(model, positions, false, forces);
  return all.squeezed;
}

ElementCount update_rotations_and_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                                         std::span<Eigen::Quaterniond> rotations, Eigen::Ref<Eigen::Matrix3Xd> forces,
                                         std::span<const double> rest_size, std::span<const StrainMemory> memory,
                                         ElementScratch& scratch, const Relaxing& relaxing) {
  const std::span<const StrainMemory> of_forces = relaxing.after.empty() ? memory : relaxing.after;
  const ElementCount all =
      sum_over_runs(model, forces, scratch, [&](const TetRun& run, Eigen::Ref<Eigen::Matrix3Xd> sum) {
        if (model.is_quadratic()) {
          return update_quadratic_rotations_and_forces(model, positions, rotations, run, sum, rest_size, memory,
                                                       relaxing);
        }
        ElementCount count;
        for (int first = run.begin; first < run.end; first += kLanes) {
          const int end = std::min(first + kLanes, run.end);
          if (end == first + kLanes &&
              add_lanes(model, positions, first, rotations, rest_size, memory, relaxing, run.first_node, sum)) {
            continue;
          }
          count.inverted += update_rotations_one_by_one(model, positions, first, end, rotations);
          relax_lanes(model, first, memory, relaxing,
                      [&] { return strain_at(model, positions, rotations, rest_size, first).strain; });
          count.squeezed += add_forces_one_by_one(model, positions, first, end, rotations, rest_size, of_forces,
                                                  false, run.first_node, sum);
        }
        return count;
      });
  add_membrane_forces(model, positions, false, forces);
  return all;
}

void find_stiffening(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                     std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size,
                     std::span<PointStiffness> stiffness, Companion* companion) {
  in_parts(companion, static_cast<int>(model.runs.size()), [&](int r) {
    const int each = tets_a_group(model);
    for (int t = model.runs[r].begin; t < model.runs[r].end; t += each) {
      find_stiffening_of_group(model, positions, rotations, rest_size, t / each, stiffness);
    }
  });
}

void find_stiffening_around(std::span<const int> nodes, const TissueModel& model, const Eigen::Matrix3Xd& positions,
                            std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size,
                            std::span<PointStiffness> stiffness) {
  const int each = tets_a_group(model);
  std::vector<char> found(static_cast<std::size_t>((model.tet_count() + each - 1) / each), 0);
  for (const int node : nodes) {
    for (int k = model.incident_start[node]; k < model.incident_start[node + 1]; ++k) {
      const int group = model.incident_tets[k] / each;
      if (std::exchange(found[group], 1) != 0) continue;
      find_stiffening_of_group(model, positions, rotations, rest_size, group, stiffness);
    }
  }
}

void relax_strain(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                  std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size, double dt,
                  std::span<StrainMemory> memory, Companion* companion) {
  if (model.is_quadratic()) {
    relax_quadratic_strain(model, positions, rotations, rest_size, dt, memory, companion);
    return;
  }
  for_fours(model, companion,
            [&](int first) { relax_four(model, positions, rotations, rest_size, first, dt, memory); });
}

double elastic_energy(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                      std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size,
                      std::span<const StrainMemory> memory) {
  double energy = membrane_energy(model, positions);
  if (model.is_quadratic()) return energy + quadratic_energy(model, positions, rotations, rest_size, memory);
  for (int t = 0; t < model.tet_count(); ++t) {
    const TetRest& rest = model.tets[t];
    const Eigen::Matrix3d f = deformation_gradient(model, positions, t);
    const Eigen::Matrix3d m = rotations[t].toRotationMatrix().transpose() * f;
    const double size = rest_size.empty() ? 1 : rest_size[t];
    const Eigen::Matrix3d strain = 0.5 * (m + m.transpose()) - size * Eigen::Matrix3d::Identity();
    double squares = strain.squaredNorm();
    if (const StrainLaw* const law = law_of(model, t)) {
      squares = energy_of(*law, in_lane(strain, t % kLanes), memory_of(memory, t))[t % kLanes];
    }
    energy += rest.volume * (rest.mu * squares + 0.5 * rest.lambda * strain.trace() * strain.trace());
    if (size == 1) energy += rest.volume * barrier(rest, f.determinant()).energy;
  }
  return energy;
}

}  // namespace stylet::physics
