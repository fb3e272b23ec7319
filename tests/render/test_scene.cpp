#include "tests/render/test_scene.h"

#include "physics/needle/needle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

namespace stylet::tests {

namespace {

using content::Scene;
using content::Surface;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kCells = 6;
constexpr double kHalf = 0.1;
constexpr double kCell = 2 * kHalf / kCells;

int node_index(int i, int j, int k) {
  return (k * (kCells + 1) + j) * (kCells + 1) + i;
}

// Kuhn's six tetrahedra of a cell: walks from corner 0 to corner 7 along the axes in every order.
constexpr std::array<std::array<int, 3>, 6> kAxisOrders{
    {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};

std::array<int, 4> kuhn_tet(const Eigen::Vector3i& cell, const std::array<int, 3>& order) {
  Eigen::Vector3i at = cell;
  std::array<int, 4> nodes{node_index(at.x(), at.y(), at.z())};
  for (std::size_t step = 0; step < 3; ++step) {
    ++at[order[step]];
    nodes[step + 1] = node_index(at.x(), at.y(), at.z());
  }
  return nodes;
}

content::DeformableBody make_block() {
  content::DeformableBody body;
  body.name = "block";
  for (int k = 0; k <= kCells; ++k)
    for (int j = 0; j <= kCells; ++j)
      for (int i = 0; i <= kCells; ++i)
        body.mesh.nodes.emplace_back(kCell * i - kHalf, kCell * j - kHalf, kCell * k - kHalf);
  for (int k = 0; k < kCells; ++k)
    for (int j = 0; j < kCells; ++j)
      for (int i = 0; i < kCells; ++i)
        for (const auto& order : kAxisOrders) {
          auto tet = kuhn_tet({i, j, k}, order);
          const auto& x = body.mesh.nodes;
          const Vector3d a = x[tet[1]] - x[tet[0]], b = x[tet[2]] - x[tet[0]], c = x[tet[3]] - x[tet[0]];
          if (a.cross(b).dot(c) < 0) std::swap(tet[2], tet[3]);
          body.mesh.tets.push_back(tet);
        }
  return body;
}

/// In a Kuhn cell the tetrahedron of a point is found by sorting its fractional coordinates, largest first.
content::Embedding embed(const Vector3f& p) {
  Eigen::Vector3i cell;
  std::array<std::pair<double, int>, 3> fraction;
  for (int axis = 0; axis < 3; ++axis) {
    const double g = (static_cast<double>(p[axis]) + kHalf) / kCell;
    cell[axis] = std::clamp(static_cast<int>(std::floor(g)), 0, kCells - 1);
    fraction[axis] = {g - cell[axis], axis};
  }
  std::sort(fraction.begin(), fraction.end(), std::greater<>());
  const auto nodes = kuhn_tet(cell, {fraction[0].second, fraction[1].second, fraction[2].second});
  const std::array<double, 4> weights{1 - fraction[0].first, fraction[0].first - fraction[1].first,
                                      fraction[1].first - fraction[2].first, fraction[2].first};
  content::Embedding e;
  for (std::size_t i = 0; i < 4; ++i) {
    e.nodes[i] = static_cast<std::uint32_t>(nodes[i]);
    e.weights[i] = static_cast<float>(weights[i]);
  }
  return e;
}

/// A closed surface of two parameters on a grid, u round and v from one pole or end to the other.
Surface sweep(const char* name, int tissue, content::SurfaceRole role, int body, int around, int along,
              const std::function<Vector3d(double, double)>& point) {
  Surface s;
  s.name = name;
  s.tissue = tissue;
  s.role = role;
  s.body = body;
  for (int j = 0; j <= along; ++j)
    for (int i = 0; i < around; ++i)
      s.positions.push_back(point(2 * std::numbers::pi * i / around, static_cast<double>(j) / along).cast<float>());
  const auto index = [&](int i, int j) { return static_cast<std::uint32_t>(j * around + i % around); };
  for (int j = 0; j < along; ++j)
    for (int i = 0; i < around; ++i)
      for (std::uint32_t k :
           {index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j), index(i + 1, j + 1), index(i, j + 1)})
        s.indices.push_back(k);
  s.normals.assign(s.positions.size(), Vector3f::Zero());
  for (std::size_t t = 0; t < s.indices.size(); t += 3) {
    const Vector3f &a = s.positions[s.indices[t]], &b = s.positions[s.indices[t + 1]],
                   &c = s.positions[s.indices[t + 2]];
    for (std::size_t k = 0; k < 3; ++k) s.normals[s.indices[t + k]] += (b - a).cross(c - a);
  }
  for (Vector3f& n : s.normals) n = n.norm() > 0 ? n.normalized() : Vector3f::UnitZ();
  if (body >= 0)
    for (const Vector3f& p : s.positions) s.embedding.push_back(embed(p));
  return s;
}

Vector3d spherical(double u, double v) {  // counter-clockwise outside with v from the -y to the +y pole
  const double polar = std::numbers::pi * (0.002 + 0.996 * v);
  return {std::sin(polar) * std::cos(u), -std::cos(polar), -std::sin(polar) * std::sin(u)};
}

const Vector3d kTumour(0.018, 0.012, 0.015);

}  // namespace

Scene make_test_scene() {
  Scene scene;
  scene.name = "test scene";
  scene.tissues.resize(5);
  scene.tissues[0] = {.name = "outside", .colour = {0, 0, 0, 0}};
  scene.tissues[1] = {.name = "skin", .colour = {0.8F, 0.52F, 0.4F, 0.35F}};
  scene.tissues[2] = {.name = "liver", .colour = {0.36F, 0.07F, 0.05F, 0.6F}};
  scene.tissues[3] = {.name = "portal_blood", .colour = {0.16F, 0.16F, 0.55F, 1.0F}};
  scene.tissues[4] = {.name = "tumour", .colour = {0.75F, 0.62F, 0.38F, 1.0F}};
  scene.bodies.push_back(make_block());

  const auto organ = [](double u, double v) {
    const Vector3d d = spherical(u, v);
    const double lobes = 1 + 0.13 * std::sin(2.3 * d.x() + 0.7) + 0.08 * std::cos(3 * d.y() + 2 * d.z());
    return Vector3d(0.070 * lobes * d.x(), 0.046 * lobes * d.y(), 0.044 * lobes * d.z());
  };
  const auto vessel = [](double radius, const std::function<Vector3d(double)>& axis) {
    return [=](double u, double v) {
      const double end = std::sqrt(std::max(0.0, 1 - std::pow(2 * v - 1, 8.0)));  // closed, rounded ends
      const double r = std::max(radius * (1.25 - 0.8 * v) * end, 1e-5);
      const Vector3d t = (axis(v + 1e-3) - axis(v - 1e-3)).normalized();
      const Vector3d x = t.cross(Vector3d::UnitZ()).normalized(), y = t.cross(x);
      return Vector3d(axis(v) + r * (std::cos(u) * x + std::sin(u) * y));
    };
  };
  using content::SurfaceRole;
  scene.surfaces.push_back(sweep("skin", 1, SurfaceRole::visual, -1, 64, 32, [](double u, double v) {
    const Vector3d d = spherical(u, v);
    return Vector3d(0.135 * d.x(), 0.100 * d.y(), 0.085 * d.z() - 0.005);
  }));
  scene.surfaces.push_back(sweep("liver", 2, SurfaceRole::boundary, 0, 96, 64, organ));
  scene.surfaces.push_back(sweep("portal_vein", 3, SurfaceRole::vessel, 0, 20, 48, vessel(0.0055, [](double v) {
                                   return Vector3d(-0.055 + 0.1 * v, -0.025 + 0.03 * v + 0.010 * std::sin(5 * v),
                                                   -0.004 + 0.008 * std::cos(4 * v));
                                 })));
  scene.surfaces.push_back(sweep("portal_branch", 3, SurfaceRole::vessel, 0, 20, 32, vessel(0.0040, [](double v) {
                                   return Vector3d(-0.022 + 0.01 * v, -0.012 + 0.045 * v, 0.004 - 0.012 * v * v);
                                 })));
  scene.surfaces.push_back(sweep("tumour", 4, SurfaceRole::target, 0, 32, 16,
                                 [](double u, double v) { return Vector3d(kTumour + 0.011 * spherical(u, v)); }));
  scene.targets.push_back({"tumour", kTumour, 0.011});
  scene.needle = {.name = "18G", .length = 0.150, .beams = 8};
  scene.probe.name = "convex";
  scene.probe.depth = 0.12;
  scene.probe.pose.position = Vector3d(-0.03, 0.108, 0.02);
  scene.probe.pose.orientation = physics::orientation_along(kTumour - scene.probe.pose.position);
  scene.camera = {
      .eye = {0.10, 0.10, 0.42}, .look_at = {0.005, 0.025, 0}, .up = Vector3d::UnitY(), .vertical_fov = 0.56};
  return scene;
}

state::FrameState rest_state(const Scene& scene) {
  state::FrameState state;
  for (const auto& body : scene.bodies) {
    auto& nodes = state.bodies.emplace_back();
    for (const Vector3d& x : body.mesh.nodes) nodes.push_back(x.cast<float>());
  }
  const Vector3d tip = scene.targets.front().centre;
  const Vector3d into = Vector3d(-0.62, -0.42, -0.55).normalized();
  const Vector3d hub = tip - scene.needle.length * into;
  const auto turn = physics::orientation_along(into);
  for (int i = 0; i <= scene.needle.beams; ++i) {
    const double along = scene.needle.length * i / scene.needle.beams;
    state.needle_positions.push_back((hub + along * into).cast<float>());
    state.needle_orientations.push_back(turn.cast<float>());
  }
  state.probe_position = scene.probe.pose.position.cast<float>();
  state.probe_orientation = scene.probe.pose.orientation.cast<float>();
  return state;
}

void deform(state::FrameState& state) {
  const auto move = [](const Vector3f& x) {
    return Vector3f(0.25F * (x.y() + 0.1F) * (x.y() + 0.1F), -0.10F * x.x() - 0.5F * x.x() * x.x(), 0.05F * x.y());
  };
  for (auto& body : state.bodies)
    for (Vector3f& x : body) x += move(x);
  // A circular bow towards +x of the needle: deflection and slope of the same arc.
  const std::size_t last = state.needle_positions.size() - 1;
  for (std::size_t i = 0; i <= last; ++i) {
    const float s = static_cast<float>(i) / static_cast<float>(last);
    const Eigen::Quaternionf straight = state.needle_orientations[i];
    state.needle_positions[i] += straight * Vector3f(0.014F * s * s, 0, -0.0004F * s);
    const float slope = std::atan(2 * 0.014F * s / 0.150F);
    state.needle_orientations[i] = straight * Eigen::Quaternionf(Eigen::AngleAxisf(slope, Vector3f::UnitY()));
  }
}

}  // namespace stylet::tests
