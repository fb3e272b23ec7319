#include "engine/render/probe_mesh.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::render {

namespace {

using Eigen::Vector3f;

constexpr int kSides = 64;

/// Half extents of the housing at a distance behind the face, m.
struct Section {
  float behind;
  float half_width;      ///< lateral
  float half_thickness;  ///< elevation
};

/// Height of the face below its centre at a lateral position: 0 in the middle, negative at the sides of an arc.
float face_drop(const content::Probe& probe, float x) {
  if (!probe.convex) return 0;
  const auto radius = static_cast<float>(probe.radius);
  return std::sqrt(std::max(radius * radius - x * x, 0.0F)) - radius;
}

/// Point of a rounded rectangle (a superellipse of exponent 4).
Vector3f around(const Section& section, int side) {
  const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(side) / kSides;
  const float c = std::cos(angle), s = std::sin(angle);
  return {section.half_width * std::copysign(std::sqrt(std::abs(c)), c),
          section.half_thickness * std::copysign(std::sqrt(std::abs(s)), s), -section.behind};
}

void compute_normals(ProbeMesh& mesh) {
  mesh.normals.assign(mesh.positions.size(), Vector3f::Zero());
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const Vector3f& a = mesh.positions[mesh.indices[i]];
    const Vector3f& b = mesh.positions[mesh.indices[i + 1]];
    const Vector3f& c = mesh.positions[mesh.indices[i + 2]];
    const Vector3f area = (b - a).cross(c - a);
    for (std::size_t k = 0; k < 3; ++k) mesh.normals[mesh.indices[i + k]] += area;
  }
  for (Vector3f& normal : mesh.normals) normal.normalize();
}

/// Joins the last two rings; the older one is nearer the face (further along +z).
void join_last_rings(ProbeMesh& mesh) {
  const auto newer = static_cast<std::uint32_t>(mesh.positions.size()) - kSides;
  const std::uint32_t older = newer - kSides;
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t j = (i + 1) % kSides;
    for (std::uint32_t index : {newer + i, newer + j, older + j, newer + i, older + j, older + i})
      mesh.indices.push_back(index);
  }
}

}  // namespace

ProbeMesh probe_body(const content::Probe& probe) {
  const float half_face = probe.convex ? static_cast<float>(probe.radius * std::sin(probe.field_of_view / 2))
                                       : static_cast<float>(probe.width / 2);
  const float wide = half_face + 0.004F;  // the array sits inside its housing
  ProbeMesh mesh;
  // The face: rings shrinking towards its middle, each laid on the arc; then the housing back to the cable.
  constexpr int kFaceRings = 10;
  for (int ring = 0; ring <= kFaceRings; ++ring) {
    const float t = std::max(static_cast<float>(ring) / kFaceRings, 0.01F);
    // Rounded rim: the last ring of the face bends back.
    const float rim = ring == kFaceRings ? 0.0012F : 0.0F;
    for (int side = 0; side < kSides; ++side) {
      Vector3f p = around({0, wide * t, 0.0085F * t}, side);
      p.z() = face_drop(probe, p.x()) - rim;
      mesh.positions.push_back(p);
    }
    if (ring > 0) join_last_rings(mesh);
  }
  const Section housing[] = {
      {0.0025F, wide * 1.005F, 0.0092F}, {0.008F, wide * 1.01F, 0.0105F}, {0.020F, wide * 0.97F, 0.0120F},
      {0.036F, wide * 0.76F, 0.0128F},   {0.052F, wide * 0.53F, 0.0130F}, {0.070F, 0.0155F, 0.0128F},
      {0.095F, 0.0150F, 0.0125F},        {0.118F, 0.0142F, 0.0118F},      {0.129F, 0.0115F, 0.0095F},
      {0.136F, 0.0055F, 0.0050F},        {0.146F, 0.0038F, 0.0038F},      {0.170F, 0.0036F, 0.0036F},
      {0.1720F, 0.0032F, 0.0032F},       {0.1734F, 0.0018F, 0.0018F},     {0.1738F, 0.0001F, 0.0001F}};
  // Near the face the housing keeps the arc's shape, further back it is straight. Between the given sections it is
  // smooth (Catmull-Rom), as moulded housings are.
  constexpr int kBetween = 6;
  const int last = static_cast<int>(std::size(housing)) - 1;
  const auto section = [&](int i) { return housing[std::clamp(i, 0, last)]; };
  for (int i = 0; i < last; ++i) {
    for (int k = i == 0 ? 0 : 1; k <= kBetween; ++k) {
      const float t = static_cast<float>(k) / kBetween;
      const auto smooth = [&](float Section::*extent) {
        const float a = section(i - 1).*extent, b = section(i).*extent, c = section(i + 1).*extent,
                    d = section(i + 2).*extent;
        const float curve = b + 0.5F * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
        return std::clamp(curve, std::min(b, c), std::max(b, c));  // no overshoot
      };
      const Section at{smooth(&Section::behind), smooth(&Section::half_width), smooth(&Section::half_thickness)};
      const float follows_arc = std::clamp(1 - at.behind / 0.045F, 0.0F, 1.0F);
      for (int side = 0; side < kSides; ++side) {
        Vector3f p = around(at, side);
        p.z() += follows_arc * face_drop(probe, p.x());
        mesh.positions.push_back(p);
      }
      join_last_rings(mesh);
    }
  }
  compute_normals(mesh);
  return mesh;
}

ProbeMesh probe_fan(const content::Probe& probe) {
  ProbeMesh mesh;
  constexpr int kColumns = 32;
  for (int i = 0; i <= kColumns; ++i) {
    const double t = static_cast<double>(i) / kColumns - 0.5;
    for (double range : {0.0, probe.depth}) {
      Eigen::Vector3d p(t * probe.width, 0, range);
      if (probe.convex) {
        const double angle = t * probe.field_of_view;
        // The outer chord must hold the whole arc: the fragment shader cuts the sector out by range.
        const double r = probe.radius + range;
        const double reach = range > 0 ? r / std::cos(probe.field_of_view / kColumns / 2) : r;
        p = {reach * std::sin(angle), 0, reach * std::cos(angle) - probe.radius};
      }
      mesh.positions.push_back(p.cast<float>());
      mesh.normals.push_back(-Vector3f::UnitY());
    }
    if (i == 0) continue;
    const auto last = static_cast<std::uint32_t>(mesh.positions.size()) - 4;
    for (std::uint32_t index : {last, last + 2, last + 3, last, last + 3, last + 1}) mesh.indices.push_back(index);
  }
  return mesh;
}

}  // namespace stylet::render
