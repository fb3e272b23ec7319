#include "engine/render/needle_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::render {

namespace {

using Eigen::Quaternionf;
using Eigen::Vector3f;

DrawnVertex vertex(const Vector3f& position, float along, const Vector3f& normal) {
  return {{position.x(), position.y(), position.z(), along}, {normal.x(), normal.y(), normal.z(), 0}};
}

void join_rings(std::vector<std::uint32_t>& indices, std::uint32_t first, std::uint32_t second, std::uint32_t sides) {
  // Rings go round counter-clockwise seen from +z and `second` is further along +z.
  for (std::uint32_t i = 0; i < sides; ++i) {
    const std::uint32_t j = (i + 1) % sides;
    for (std::uint32_t index : {first + i, first + j, second + j, first + i, second + j, second + i})
      indices.push_back(index);
  }
}

}  // namespace

CurvePoint hermite(const Vector3f& x0, const Vector3f& t0, const Vector3f& x1, const Vector3f& t1, float length,
                   float u) {
  const float u2 = u * u, u3 = u2 * u;
  CurvePoint p;
  p.position =
      (2 * u3 - 3 * u2 + 1) * x0 + (u3 - 2 * u2 + u) * length * t0 + (3 * u2 - 2 * u3) * x1 + (u3 - u2) * length * t1;
  p.tangent = (6 * u2 - 6 * u) * (x0 - x1) + (3 * u2 - 4 * u + 1) * length * t0 + (3 * u2 - 2 * u) * length * t1;
  return p;
}

NeedleMesh::NeedleMesh(int nodes, double outer_diameter, double length)
    : nodes_(nodes), radius_(static_cast<float>(outer_diameter / 2)), length_(static_cast<float>(length)) {
  // Shaft: sections, the last one bevelled, then the bevel's flat face with normals of its own.
  const auto sides = static_cast<std::uint32_t>(kSides);
  const auto sections = static_cast<std::uint32_t>((nodes - 1) * kSectionsPerBeam + 1);
  for (std::uint32_t s = 0; s + 1 < sections; ++s) join_rings(shaft_indices_, s * sides, (s + 1) * sides, sides);
  const std::uint32_t face = sections * sides;
  for (std::uint32_t i = 1; i + 1 < sides; ++i)
    for (std::uint32_t index : {face, face + i, face + i + 1}) shaft_indices_.push_back(index);
  const std::uint32_t hub = face + sides;

  // Hub: a Luer cone and a grip, turned about the axis; z from the shaft's end backwards, radius. m
  hub_profile_ = {{0.0005F, radius_},  {0.0F, 0.0016F},     {-0.0055F, 0.0021F}, {-0.0065F, 0.0036F},
                  {-0.0085F, 0.0041F}, {-0.019F, 0.0037F},  {-0.0205F, 0.0052F}, {-0.0230F, 0.0052F},
                  {-0.0235F, 0.0048F}, {-0.0235F, 0.00002F}};
  // Each band of the profile has its own two rings: the edges of moulded plastic stay crisp.
  std::uint32_t ring = hub;
  for (std::size_t band = 0; band + 1 < hub_profile_.size(); ++band) {
    join_rings(hub_indices_, ring + sides, ring, sides);
    ring += 2 * sides;
  }
  vertices_.resize(ring);
}

std::span<const DrawnVertex> NeedleMesh::shape(std::span<const Vector3f> positions,
                                               std::span<const Quaternionf> orientations) {
  const float beam_length = length_ / static_cast<float>(nodes_ - 1);
  const auto angle = [](int side) { return 2 * std::numbers::pi_v<float> * static_cast<float>(side) / kSides; };
  const float bevel_slope = 1 / std::tan(static_cast<float>(kBevelAngle));
  std::size_t out = 0;
  for (int section = 0; section <= (nodes_ - 1) * kSectionsPerBeam; ++section) {
    const int beam = std::min(section / kSectionsPerBeam, nodes_ - 2);
    const float u = static_cast<float>(section - beam * kSectionsPerBeam) / kSectionsPerBeam;
    const auto a = static_cast<std::size_t>(beam), b = a + 1;
    const CurvePoint p = hermite(positions[a], orientations[a] * Vector3f::UnitZ(), positions[b],
                                 orientations[b] * Vector3f::UnitZ(), beam_length, u);
    // The section's x turns with the nodes; its plane is across the curve.
    const Vector3f z = p.tangent.normalized();
    const Vector3f x_of_nodes = orientations[a].slerp(u, orientations[b]) * Vector3f::UnitX();
    const Vector3f x = (x_of_nodes - x_of_nodes.dot(z) * z).normalized();
    const Vector3f y = z.cross(x);
    const float along = (static_cast<float>(beam) + u) * beam_length;
    const bool tip = section == (nodes_ - 1) * kSectionsPerBeam;
    for (int side = 0; side < kSides; ++side) {
      const float c = std::cos(angle(side)), s = std::sin(angle(side));
      const Vector3f normal = c * x + s * y;
      // The grind: the side at +X ends first, the point is at -X. A point beyond the plane slides back onto it.
      const float reach = length_ - (1 + c) * radius_ * bevel_slope;
      const float cut = std::max(along - reach, 0.0F);
      vertices_[out++] = vertex(p.position + radius_ * normal - cut * z, along - cut, normal);
    }
    if (tip) {
      const Vector3f normal =
          (std::cos(static_cast<float>(kBevelAngle)) * x + std::sin(static_cast<float>(kBevelAngle)) * z)
              .normalized();
      for (int side = 0; side < kSides; ++side) {
        vertices_[out] = vertices_[out - kSides];
        vertices_[out++].normal = {normal.x(), normal.y(), normal.z(), 0};
      }
    }
  }
  const auto in_patient = [&](const Vector3f& v) { return Vector3f(orientations[0] * v); };
  for (std::size_t band = 0; band + 1 < hub_profile_.size(); ++band) {
    const Eigen::Vector2f from = hub_profile_[band], to = hub_profile_[band + 1];
    const Eigen::Vector2f outward =
        Eigen::Vector2f(to.y() - from.y(), from.x() - to.x()).normalized();  // (z, radius)
    for (const Eigen::Vector2f& end : {from, to}) {
      for (int side = 0; side < kSides; ++side) {
        const float c = std::cos(angle(side)), s = std::sin(angle(side));
        vertices_[out++] = vertex(positions[0] + in_patient({end.y() * c, end.y() * s, end.x()}), 0,
                                  in_patient({outward.y() * c, outward.y() * s, outward.x()}));
      }
    }
  }
  return vertices_;
}

}  // namespace stylet::render
