#include "engine/render/rod_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace stylet::render {

using Eigen::Vector3f;

RodMesh::RodMesh(std::size_t most) : vertices_(most * kRings * kSides) {
  for (std::uint32_t rod = 0; rod < most; ++rod) {
    for (std::uint32_t ring = 0; ring + 1 < kRings; ++ring) {
      for (std::uint32_t i = 0; i < kSides; ++i) {
        const std::uint32_t first = (rod * kRings + ring) * kSides;
        const std::uint32_t a = first + i, b = first + (i + 1) % kSides;
        for (const std::uint32_t index : {a, b, b + kSides, a, b + kSides, a + kSides}) indices_.push_back(index);
      }
    }
  }
}

std::span<const DrawnVertex> RodMesh::shape(std::span<const Rod> rods) {
  std::size_t v = 0;
  for (const Rod& rod : rods.first(std::min(rods.size(), vertices_.size() / (kRings * kSides)))) {
    const Vector3f along = rod.to - rod.from;
    const bool empty = along.norm() < 1e-6F;  // has no direction: drawn as a point
    const Vector3f z = empty ? Vector3f::UnitZ() : Vector3f(along.normalized());
    const Vector3f x = z.unitOrthogonal();
    const Vector3f y = z.cross(x);
    for (std::uint32_t ring = 0; ring < kRings; ++ring) {
      const Vector3f& middle = ring < kRings / 2 ? rod.from : rod.to;
      const float taper = ring < kRings / 2 ? 1 : rod.taper;
      const float radius = empty || ring == 0 || ring + 1 == kRings ? 0 : taper * rod.radius;
      for (std::uint32_t side = 0; side < kSides; ++side) {
        const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(side) / kSides;
        const Vector3f across = std::cos(angle) * x + std::sin(angle) * y;
        const Vector3f n = ring < 2 ? Vector3f(-z) : ring + 2 >= kRings ? z : across;
        const Vector3f p = middle + radius * across;
        vertices_[v++] = {{p.x(), p.y(), p.z(), 0}, {n.x(), n.y(), n.z(), 0}};
      }
    }
  }
  return std::span(vertices_).first(v);
}

std::vector<Rod> core_rods(std::span<const state::CoreTrack> cores) {
  std::vector<Rod> rods;
  for (const state::CoreTrack& core : cores) rods.push_back({core.from, core.to, core.radius});
  return rods;
}

std::array<Rod, kShotParts> shot_rods(const state::BiopsyShot& shot, const Vector3f& tip,
                                      const Eigen::Quaternionf& orientation, float radius) {
  // The bore leaves the stylet less than the cannula's width; half of it is cut away along the notch.
  constexpr float kStylet = 0.84F, kFloor = 0.5F, kPoint = 0.0025F;
  const float inside = 6 * radius;  // begins behind the bevel
  const Vector3f z = orientation * Vector3f::UnitZ(), x = orientation * Vector3f::UnitX();
  const auto rod = [&](float from, float to, float r, float taper = 1, float aside = 0) {
    from = std::max(from, -inside);
    to = std::max(to, from);
    return Rod{tip + from * z + aside * x, tip + to * z + aside * x, r, taper};
  };
  const float thick = kStylet * radius, notch = shot.stylet - shot.notch_behind, front = notch + shot.notch;
  return {rod(-inside, notch, thick), rod(notch, front, kFloor * thick, 1, -(1 - kFloor) * thick),
          rod(front, shot.stylet - kPoint, thick), rod(shot.stylet - kPoint, shot.stylet, thick, 0.05F),
          rod(-inside, shot.cannula > 0 ? shot.cannula : -inside, radius)};
}

std::array<Rod, kControllerParts> controller_rods(const Eigen::Isometry3d& patient_from_grip) {
  const Eigen::Isometry3f pose = patient_from_grip.cast<float>();
  const auto rod = [&](const Vector3f& from, const Vector3f& to, float radius) {
    return Rod{pose * from, pose * to, radius};
  };
  return {rod({0, 0, 0.055F}, {0, 0, -0.045F}, 0.016F), rod({0, 0.004F, -0.045F}, {0, 0.004F, -0.068F}, 0.024F),
          rod({0, -0.014F, -0.056F}, {0, -0.034F, -0.050F}, 0.006F)};
}

std::array<Rod, kSyringeParts> syringe_rods(const state::SyringeState& syringe, const Vector3f& hub,
                                            const Eigen::Quaternionf& orientation) {
  constexpr float kHub = 0.0225F, kNozzle = 0.011F, kWall = 0.0012F, kSeal = 0.006F;  // m
  const float radius = std::cbrt(syringe.capacity / (8 * std::numbers::pi_v<float>));
  const float area = std::numbers::pi_v<float> * radius * radius;
  const float length = syringe.capacity / area + kSeal + 0.004F;
  const float filled = std::clamp(syringe.held, 0.0F, syringe.capacity) / area;
  const Vector3f back = orientation * -Vector3f::UnitZ();
  const auto rod = [&](float from, float to, float width) {
    return Rod{hub + (kHub + from) * back, hub + (kHub + to) * back, width};
  };
  const float front = kNozzle + kWall;
  const float thumb = front + filled + length;
  return {rod(front, front + filled, radius),
          rod(front + filled, front + filled + kSeal, radius),
          rod(front + filled + kSeal, thumb, 0.4F * radius),
          rod(thumb, thumb + 0.003F, radius),
          rod(0, kNozzle, 0.0032F),
          rod(kNozzle, kNozzle + length, radius + kWall)};
}

}  // namespace stylet::render
