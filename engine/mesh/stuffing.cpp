#include "engine/mesh/stuffing.h"

#include "engine/mesh/tet_smoothing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace stylet::mesh {
namespace {

// A cut closer to a lattice point than this share of the edge pulls the point onto the surface (Labelle and Shewchuk,
// table 1, the choice with the best guaranteed angles: 10.78 to 164.74 degrees).
constexpr double kWarpLong = 0.24999;   // edges along an axis
constexpr double kWarpShort = 0.41189;  // half diagonals of a cell

constexpr int kSmallBlock = 4;   // cells along an axis of a block whose points are all measured
constexpr double kFarBlock = 2;  // half diagonals from its middle to the surface: distances may be steeper than 1

using Corners = std::array<int, 4>;

// Body-centred cubic lattice: cell corners first, then cell centres.
class Lattice {
public:
  Lattice(const Eigen::AlignedBox3d& box, double cell) : cell_(cell) {
    // One cell of margin, so that everything outside has an outside neighbour; the solid sits in the middle.
    for (int axis = 0; axis < 3; ++axis) cells_[axis] = static_cast<int>(std::ceil(box.sizes()[axis] / cell)) + 2;
    origin_ = box.center() - cell / 2 * cells_.cast<double>();
  }

  int corner(int i, int j, int k) const { return i + (cells_.x() + 1) * (j + (cells_.y() + 1) * k); }
  int centre(int i, int j, int k) const { return corners() + i + cells_.x() * (j + cells_.y() * k); }
  int corners() const { return (cells_.x() + 1) * (cells_.y() + 1) * (cells_.z() + 1); }
  int size() const { return corners() + cells_.prod(); }
  const Eigen::Vector3i& cells() const { return cells_; }
  bool same_kind(int a, int b) const { return (a < corners()) == (b < corners()); }

  Eigen::Vector3d position(int point) const {
    const Eigen::Vector3d shift = Eigen::Vector3d::Constant(is_corner(point) ? 0.0 : 0.5);
    return origin_ + cell_ * (index(point).cast<double>() + shift);
  }
  // Neighbours along an axis differ in it.
  bool even(int point) const { return index(point).sum() % 2 == 0; }

private:
  bool is_corner(int point) const { return point < corners(); }
  Eigen::Vector3i index(int point) const {
    const int nx = cells_.x() + (is_corner(point) ? 1 : 0);
    const int ny = cells_.y() + (is_corner(point) ? 1 : 0);
    const int local = is_corner(point) ? point : point - corners();
    return {local % nx, local / nx % ny, local / (nx * ny)};
  }

  double cell_;
  Eigen::Vector3i cells_;
  Eigen::Vector3d origin_;
};

// Calls visit(corners) for every tetrahedron of the lattice: the centres on both sides of a cell face, and an edge of
// it.
template <typename Visit>
void for_each_tet(const Lattice& lattice, Visit visit) {
  const Eigen::Vector3i& n = lattice.cells();
  for (int k = 0; k < n.z(); ++k) {
    for (int j = 0; j < n.y(); ++j) {
      for (int i = 0; i < n.x(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
          Eigen::Vector3i next(i, j, k);
          if (++next[axis] == n[axis]) continue;
          const Eigen::Vector3i u = Eigen::Vector3i::Unit((axis + 1) % 3);
          const Eigen::Vector3i v = Eigen::Vector3i::Unit((axis + 2) % 3);
          // The face between the two cells starts at the corner `next`.
          const std::array<Eigen::Vector3i, 4> face{next, next + u, next + u + v, next + v};
          for (int e = 0; e < 4; ++e) {
            const Eigen::Vector3i& a = face[e];
            const Eigen::Vector3i& b = face[(e + 1) % 4];
            visit(Corners{lattice.centre(i, j, k), lattice.centre(next.x(), next.y(), next.z()),
                          lattice.corner(a.x(), a.y(), a.z()), lattice.corner(b.x(), b.y(), b.z())});
          }
        }
      }
    }
  }
}

struct Cut {
  int a;  // lattice points, a < b
  int b;
  double fraction;  // from a
  Eigen::Vector3d point;
  int node = -1;  // in the output
};

// Root of the distance between two points of opposite sign: regula falsi, Illinois variant.
double root_fraction(const SignedDistance& distance, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double fa,
                     double fb) {
  double low = 0;
  double high = 1;
  int last_side = 0;  // an end that stays twice is halved, so that the other cannot creep
  const double tolerance = 1e-7 * (b - a).norm();
  for (int i = 0; i < 40; ++i) {
    const double t = (low * fb - high * fa) / (fb - fa);
    const double f = distance(a + t * (b - a));
    if (std::abs(f) < tolerance || high - low < 1e-9) return t;
    if ((f < 0) == (fb < 0)) {
      high = t;
      fb = f;
      if (last_side > 0) fa /= 2;
      last_side = 1;
    } else {
      low = t;
      fa = f;
      if (last_side < 0) fb /= 2;
      last_side = -1;
    }
  }
  return (low + high) / 2;
}

class Stuffing {
public:
  Stuffing(const SignedDistance& distance, const Eigen::AlignedBox3d& box, double cell, const files::Pulse& pulse)
      : distance_(distance),
        pulse_(pulse),
        lattice_(box, cell),
        value_(lattice_.size()),
        node_of_(lattice_.size(), -1) {
    position_.reserve(lattice_.size());
    for (int p = 0; p < lattice_.size(); ++p) {
      pulse_();
      position_.push_back(lattice_.position(p));
    }
    measure({0, 0, 0}, lattice_.cells());
    for_each_tet(lattice_, [&](const Corners& tet) {
      pulse_();
      for (const int p : tet) {
        if (value_[p] < 0) {
          tets_.push_back(tet);
          return;
        }
      }
    });
    find_cuts();
    warp();
  }

  physics::TetMesh fill() {
    for (const Corners& tet : tets_) {
      pulse_();
      fill(tet);
    }
    return std::move(mesh_);
  }

private:
  bool inside(int p) const { return value_[p] < 0; }
  bool outside(int p) const { return value_[p] > 0; }

  // The distance at the lattice points of a block of cells, corners on all its faces included. Where the surface is
  // far from the block, only the sign counts, and that is the sign in its middle: a thin organ in a large box has few
  // points near it.
  void measure(const Eigen::Vector3i& first, const Eigen::Vector3i& last) {
    const Eigen::Vector3i cells = last - first;
    if (cells.minCoeff() <= 0) return;
    const Eigen::Vector3d low = position_[lattice_.corner(first.x(), first.y(), first.z())];
    const Eigen::Vector3d high = position_[lattice_.corner(last.x(), last.y(), last.z())];
    if (cells.maxCoeff() > kSmallBlock) {
      const double middle = distance_((low + high) / 2);
      if (std::abs(middle) > kFarBlock * (high - low).norm() / 2) {
        for_each_point(first, last, [&](int p) { value_[p] = middle; });
        return;
      }
      Eigen::Index axis = 0;
      cells.maxCoeff(&axis);
      Eigen::Vector3i end = last, begin = first;
      end[axis] = begin[axis] = first[axis] + cells[axis] / 2;
      measure(first, end);
      measure(begin, last);
      return;
    }
    for_each_point(first, last, [&](int p) {
      pulse_();
      value_[p] = distance_(position_[p]);
    });
  }

  template <typename Visit>
  void for_each_point(const Eigen::Vector3i& first, const Eigen::Vector3i& last, Visit visit) const {
    // A corner between two blocks belongs to the one that begins with it.
    const Eigen::Vector3i& n = lattice_.cells();
    const auto end = [&](int axis) { return last[axis] + (last[axis] == n[axis] ? 1 : 0); };
    for (int k = first.z(); k < end(2); ++k) {
      for (int j = first.y(); j < end(1); ++j) {
        for (int i = first.x(); i < end(0); ++i) {
          visit(lattice_.corner(i, j, k));
          if (i < last.x() && j < last.y() && k < last.z()) visit(lattice_.centre(i, j, k));
        }
      }
    }
  }

  void find_cuts() {
    for (const Corners& tet : tets_) {
      pulse_();
      for (int i = 0; i < 4; ++i) {
        for (int j = i + 1; j < 4; ++j) {
          if (value_[tet[i]] * value_[tet[j]] < 0) {
            cuts_.push_back({std::min(tet[i], tet[j]), std::max(tet[i], tet[j]), 0, Eigen::Vector3d::Zero()});
          }
        }
      }
    }
    const auto before = [this](const Cut& x, const Cut& y) {
      pulse_();
      return x.a != y.a ? x.a < y.a : x.b < y.b;
    };
    std::sort(cuts_.begin(), cuts_.end(), before);
    const auto same = [](const Cut& x, const Cut& y) { return x.a == y.a && x.b == y.b; };
    cuts_.erase(std::unique(cuts_.begin(), cuts_.end(), same), cuts_.end());
    for (Cut& cut : cuts_) {
      pulse_(8);
      cut.fraction = root_fraction(distance_, position_[cut.a], position_[cut.b], value_[cut.a], value_[cut.b]);
      cut.point = position_[cut.a] + cut.fraction * (position_[cut.b] - position_[cut.a]);
    }
  }

  Cut& cut_between(int p, int q) {
    const int a = std::min(p, q);
    const int b = std::max(p, q);
    return *std::lower_bound(cuts_.begin(), cuts_.end(), 0,
                             [&](const Cut& x, int) { return x.a != a ? x.a < a : x.b < b; });
  }

  // Each lattice point takes its nearest violating cut, unless the point at the other end has already gone to the
  // surface and taken the cut with it.
  void warp() {
    std::vector<std::vector<int>> cuts_at(lattice_.size());
    for (std::size_t c = 0; c < cuts_.size(); ++c) {
      cuts_at[cuts_[c].a].push_back(static_cast<int>(c));
      cuts_at[cuts_[c].b].push_back(static_cast<int>(c));
    }
    for (int p = 0; p < lattice_.size(); ++p) {
      pulse_();
      double nearest = std::numeric_limits<double>::infinity();
      const Cut* chosen = nullptr;
      for (const int c : cuts_at[p]) {
        const Cut& cut = cuts_[c];
        if (value_[cut.a] * value_[cut.b] >= 0) continue;
        const double fraction = cut.a == p ? cut.fraction : 1 - cut.fraction;
        if (fraction >= (lattice_.same_kind(cut.a, cut.b) ? kWarpLong : kWarpShort)) continue;
        const double distance = (cut.point - position_[p]).norm();
        if (distance < nearest) {
          nearest = distance;
          chosen = &cut;
        }
      }
      if (!chosen) continue;
      position_[p] = chosen->point;
      value_[p] = 0;
    }
  }

  int lattice_node(int p) {
    if (node_of_[p] < 0) {
      node_of_[p] = static_cast<int>(mesh_.nodes.size());
      mesh_.nodes.push_back(position_[p]);
    }
    return node_of_[p];
  }

  int cut_node(int p, int q) {
    Cut& cut = cut_between(p, q);
    if (cut.node < 0) {
      cut.node = static_cast<int>(mesh_.nodes.size());
      mesh_.nodes.push_back(cut.point);
    }
    return cut.node;
  }

  double volume6(const Corners& t) const {
    const Eigen::Vector3d& origin = mesh_.nodes[t[0]];
    return (mesh_.nodes[t[1]] - origin).dot((mesh_.nodes[t[2]] - origin).cross(mesh_.nodes[t[3]] - origin));
  }

  void emit(int a, int b, int c, int d) {
    Corners tet{a, b, c, d};
    if (volume6(tet) < 0) std::swap(tet[2], tet[3]);
    mesh_.tets.push_back(tet);
  }

  // The quadrilateral that a lattice face leaves when its corner `out` is cut off: does its diagonal start at `a`
  // (and end at the cut on b-out)? Depends on the face alone, so both tetrahedra at the face agree.
  bool diagonal_from(int a, int b, int out) const {
    const bool long_a = lattice_.same_kind(a, out);
    const bool long_b = lattice_.same_kind(b, out);
    if (long_a != long_b) return long_a;
    return lattice_.even(a);  // parity rule: a-b is then an edge along an axis, its ends differ
  }

  // Prism between the triangles p and q; from_p[i]: the diagonal of the side i, i+1 starts at p[i] (else at p[i+1]).
  // Not all three equal. Exactly one corner of p has the diagonals of both its sides: the prism is the cone from it.
  void emit_prism(const std::array<int, 3>& p, const std::array<int, 3>& q, const std::array<bool, 3>& from_p) {
    int i = 0;
    while (!(from_p[i] && !from_p[(i + 2) % 3])) ++i;
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    emit(p[i], q[0], q[1], q[2]);
    if (from_p[j]) {
      emit(p[i], p[j], p[k], q[k]);
      emit(p[i], p[j], q[k], q[j]);
    } else {
      emit(p[i], p[j], p[k], q[j]);
      emit(p[i], p[k], q[k], q[j]);
    }
  }

  void fill(const Corners& tet) {
    std::array<int, 4> in{};
    std::array<int, 4> out{};
    std::array<int, 4> zero{};
    int ins = 0;
    int outs = 0;
    int zeros = 0;
    for (const int p : tet) {
      if (inside(p)) {
        in[ins++] = p;
      } else if (outside(p)) {
        out[outs++] = p;
      } else {
        zero[zeros++] = p;
      }
    }
    if (ins == 0) return;
    if (outs == 0) {
      Corners corners{};  // numbered in a stated order, which the arguments of a call do not have
      for (int i = 3; i >= 0; --i) corners[i] = lattice_node(tet[i]);
      emit(corners[0], corners[1], corners[2], corners[3]);
    } else if (ins == 1) {
      Corners corners{};
      int count = 0;
      corners[count++] = lattice_node(in[0]);
      for (int i = 0; i < zeros; ++i) corners[count++] = lattice_node(zero[i]);
      for (int i = 0; i < outs; ++i) corners[count++] = cut_node(in[0], out[i]);
      emit(corners[0], corners[1], corners[2], corners[3]);
    } else if (ins == 2 && outs == 1) {
      const int a = lattice_node(in[0]);
      const int b = lattice_node(in[1]);
      const int cut_a = cut_node(in[0], out[0]);
      const int cut_b = cut_node(in[1], out[0]);
      const int apex = lattice_node(zero[0]);
      if (diagonal_from(in[0], in[1], out[0])) {
        emit(a, b, cut_b, apex);
        emit(a, cut_b, cut_a, apex);
      } else {
        emit(a, b, cut_a, apex);
        emit(b, cut_b, cut_a, apex);
      }
    } else if (ins == 3) {
      std::array<int, 3> p{};
      std::array<int, 3> q{};
      std::array<bool, 3> from_p{};
      for (int i = 0; i < 3; ++i) {
        p[i] = lattice_node(in[i]);
        q[i] = cut_node(in[i], out[0]);
        from_p[i] = diagonal_from(in[i], in[(i + 1) % 3], out[0]);
      }
      emit_prism(p, q, from_p);
    } else {
      // Two inside, two outside: a prism between the triangles at the two inner points. Its third side lies on the
      // surface, so its diagonal is free: the shorter one, where that leaves the prism divisible.
      const std::array<int, 3> p{lattice_node(in[0]), cut_node(in[0], out[0]), cut_node(in[0], out[1])};
      const std::array<int, 3> q{lattice_node(in[1]), cut_node(in[1], out[0]), cut_node(in[1], out[1])};
      const bool first = diagonal_from(in[0], in[1], out[0]);  // side 0-1: starts at p[0]
      const bool last = !diagonal_from(in[0], in[1], out[1]);  // side 2-0: starts at p[2] unless at p[0]
      bool middle = (mesh_.nodes[p[1]] - mesh_.nodes[q[2]]).squaredNorm() <
                    (mesh_.nodes[p[2]] - mesh_.nodes[q[1]]).squaredNorm();
      if (first == last) middle = !first;
      emit_prism(p, q, {first, middle, last});
    }
  }

  const SignedDistance& distance_;
  const files::Pulse& pulse_;
  Lattice lattice_;
  std::vector<Eigen::Vector3d> position_;  // of lattice points, warped
  std::vector<double> value_;              // distance there, 0 once warped
  std::vector<int> node_of_;
  std::vector<Corners> tets_;  // lattice tetrahedra with at least one point inside
  std::vector<Cut> cuts_;      // ascending by (a, b)
  physics::TetMesh mesh_;
};

}  // namespace

physics::TetMesh stuff(const SignedDistance& distance, const Eigen::AlignedBox3d& box, double cell, int smoothing,
                       Parts parts, const files::Pulse& pulse) {
  physics::TetMesh mesh = Stuffing(distance, box, cell, pulse).fill();
  keep_manifold_part(mesh, parts, pulse);
  smooth(mesh, distance, cell, smoothing);
  return mesh;
}

}  // namespace stylet::mesh
