#include "engine/render/cable_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::render {

namespace {

using Eigen::Vector3d;

constexpr double kRadius = 0.0034;    // m, as the probe's tail
constexpr double kTail = 0.170;       // m behind the face
constexpr double kOverCloth = 0.026;  // m over the trunk: the drape has folds
constexpr double kOverTable = 0.015;  // m
constexpr double kTableEdge = 0.31;   // m from the middle, where the sheet turns down
constexpr double kRound = 0.34;       // m towards the head, round the field
constexpr int kSmoothings = 24;

}  // namespace

CableMesh::CableMesh(const RoomLayout& layout) : layout_(layout), points_(kPoints) {
  for (std::uint32_t ring = 0; ring + 1 < kPoints; ++ring) {
    for (std::uint32_t i = 0; i < kSides; ++i) {
      const std::uint32_t a = ring * kSides + i, b = ring * kSides + (i + 1) % kSides;
      for (const std::uint32_t index : {a, b, b + kSides, a, b + kSides, a + kSides}) indices_.push_back(index);
    }
  }
  vertices_.resize(std::size_t{kPoints} * kSides);
}

Vector3d CableMesh::clear_of_patient(const Vector3d& at) const {
  const double x = std::abs(at.x() - layout_.trunk_centre.x());
  if (x > kTableEdge) return at;
  const double half = layout_.trunk_half.x() + kOverCloth, height = layout_.trunk_half.y() + kOverCloth;
  // The sheet: over the trunk its ellipse, beside it a short curve down to the table.
  double ground = kOverTable;
  if (x < half) {
    ground += layout_.trunk_centre.y() + height * std::sqrt(1 - x * x / (half * half));
  } else if (layout_.draped && half < kTableEdge) {
    ground += layout_.trunk_centre.y() * std::pow((kTableEdge - x) / (kTableEdge - half), 3.0);
  }
  return {at.x(), at.y(), std::max(at.z(), ground)};
}

std::span<const DrawnVertex> CableMesh::shape(const Eigen::Isometry3d& patient_from_probe) {
  const Eigen::Isometry3d table_from_probe = layout_.patient_from_table.inverse() * patient_from_probe;
  const Vector3d out = -table_from_probe.linear().col(2);
  const Vector3d from = table_from_probe.translation() + kTail * out;
  const Vector3d& to = layout_.cable_port;
  // A Bezier curve, then pushed out of what it goes through and smoothed in turn.
  const Vector3d second = from + 0.20 * out + Vector3d(0, layout_.draped ? kRound : 0.0, 0);
  const Vector3d third = to + 0.25 * layout_.cable_way - Vector3d(0, 0, 0.20);
  for (int i = 0; i < kPoints; ++i) {
    const double t = static_cast<double>(i) / (kPoints - 1), s = 1 - t;
    points_[i] = s * s * s * from + 3 * s * s * t * second + 3 * s * t * t * third + t * t * t * to;
  }
  for (int pass = 0; pass < kSmoothings; ++pass) {
    for (std::size_t i = 2; i + 2 < kPoints; ++i) {
      points_[i] = clear_of_patient(0.5 * points_[i] + 0.25 * (points_[i - 1] + points_[i + 1]));
    }
  }
  Vector3d across = out.unitOrthogonal();
  std::size_t v = 0;
  for (std::size_t i = 0; i < kPoints; ++i) {
    const Vector3d along = (points_[std::min<std::size_t>(i + 1, kPoints - 1)] - points_[i > 0 ? i - 1 : 0]);
    const Vector3d z = along.norm() > 1e-9 ? along.normalized() : out;
    across -= across.dot(z) * z;  // carried on without twist
    across = across.norm() > 1e-6 ? across.normalized() : z.unitOrthogonal();
    const Vector3d other = z.cross(across);
    for (int side = 0; side < kSides; ++side) {
      const double angle = 2 * std::numbers::pi * side / kSides;
      const Vector3d n = layout_.patient_from_table.linear() * (std::cos(angle) * across + std::sin(angle) * other);
      const Eigen::Vector3f p = (layout_.patient_from_table * points_[i] + kRadius * n).cast<float>();
      const Eigen::Vector3f normal = n.cast<float>();
      vertices_[v++] = {{p.x(), p.y(), p.z(), 0}, {normal.x(), normal.y(), normal.z(), 0}};
    }
  }
  return vertices_;
}

}  // namespace stylet::render
