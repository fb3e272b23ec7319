// The point of a triangle nearest to another.
#pragma once

#include <Eigen/Core>

#include <cstdint>

namespace stylet::mesh {

/// Where on a triangle a point lies.
enum class TriangleFeature : std::uint8_t { face, edge, vertex };

struct TrianglePoint {
  Eigen::Vector3d point;
  TriangleFeature feature;
  int index;  ///< of the vertex or edge; edge i runs from corner i to i+1
};

/// The point of triangle abc nearest to p. Ericson, "Real-Time Collision Detection", 5.1.5: the Voronoi region of the
/// triangle decides. A degenerate triangle gives its first corner.
inline TrianglePoint nearest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                         const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d ac = c - a;
  const Eigen::Vector3d ap = p - a;
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {a, TriangleFeature::vertex, 0};
  const Eigen::Vector3d bp = p - b;
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {b, TriangleFeature::vertex, 1};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {a + ab * (d1 / (d1 - d3)), TriangleFeature::edge, 0};
  const Eigen::Vector3d cp = p - c;
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {c, TriangleFeature::vertex, 2};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {a + ac * (d2 / (d2 - d6)), TriangleFeature::edge, 2};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return {b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), TriangleFeature::edge, 1};
  }
  const double sum = va + vb + vc;
  if (!(sum > 0)) return {a, TriangleFeature::vertex, 0};
  return {a + ab * (vb / sum) + ac * (vc / sum), TriangleFeature::face, 0};
}

}  // namespace stylet::mesh
