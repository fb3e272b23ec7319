// L of a factorisation once more, laid out for the two passes of one right-hand side: read from one end to the other,
// in 8 to 16 bits or in single precision, by two threads. Internal to the factorisation.
#pragma once

#include "physics/tissue/companion.h"
#include "physics/tissue/factor_panels.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

struct cholmod_factor_struct;

namespace stylet::physics {

/// Of what L is read in. The fixed point of an iteration whose residuals are solved for does not know it.
enum class PassPrecision {
  twelve_bits,   ///< an entry is off by 2^-12 of the largest of its tile, in small tiles by 2^-8, at most
  sixteen_bits,  ///< by 2^-16
  single,
  full,  ///< double
};

/// The leading columns of P A P^T = L L^T   (physics/README.md eq. 8c)
///
/// Columns go in panels of eight. A panel holds the inverse of its diagonal block in single precision, then the rows
/// below in tiles of 8 x 8, entries of few bits times a number a column and one a tile: the wide tiles, then the
/// narrow ones, whose largest entry is small. The elimination tree is cut: its lower parts do not depend on each
/// other; what they do to the rows of the upper one is summed in their order, so the bits do not depend on who does
/// which part.
class CompactFactor {
public:
  /// Vectors of the passes. One a thread that solves.
  struct Scratch {
    std::vector<float> x;                    // [vector_size()]
    std::vector<std::vector<float>> panels;  // [parts] rows of one supernode
  };

  /// Reads a factor of CHOLMOD's (supernodal, double, finite), its first `leading` columns.
  /// @param precision  not full
  /// @param same_symbols  the factor has the same supernodes as the last time
  void read(const cholmod_factor_struct& factor, int leading, PassPrecision precision, bool same_symbols,
            Companion* companion = nullptr);
  void clear();
  bool empty() const { return nodes_.empty(); }
  PassPrecision precision() const { return precision_; }
  /// What a pass reads.
  std::size_t bytes() const;
  int part_count() const { return static_cast<int>(parts_.size()); }
  /// Share of the bytes that one thread has to read while the other has nothing to do.
  double serial_share() const;

  /// x <- L^-1 x of the leading columns, and x_S -= L_S x of the rows below them.
  /// @param scratch.x  [DOFs] in the order of elimination; room for more behind is taken
  void eliminate(Scratch& scratch, Companion* companion) const;
  /// x <- L^-T (x - L_S^T x_S) of the leading columns.
  void substitute_back(Scratch& scratch, Companion* companion) const;

private:
  struct Node {
    int first = 0;
    int columns = 0;
    int below = 0;                // rows below the columns
    std::size_t row_start = 0;    // of those, in rows_
    std::size_t panel_start = 0;  // of its panels, in wide_ and heads_
    std::size_t tile_start = 0;   // of its tiles, in tiles_
    std::size_t entry_start = 0;  // of their entries, if all are as wide
    std::size_t packed = 0;       // bytes that they take
  };
  struct Part {
    std::vector<int> nodes;  // ascending
    std::size_t entries = 0;
  };
  void analyse(const cholmod_factor_struct& factor, int leading);
  void cut(std::span<const int> parent);
  template <typename Entries>
  void read_entries(const cholmod_factor_struct& factor, Companion* companion);
  template <typename Entries>
  void eliminate_node(const Node& node, float* x, float* w) const;
  template <typename Entries>
  void substitute_back_node(const Node& node, float* x, float* w) const;
  template <typename Entries>
  void eliminate_in(Scratch& scratch, Companion* companion) const;
  template <typename Entries>
  void substitute_back_in(Scratch& scratch, Companion* companion) const;
  void make_room(Scratch& scratch) const;

  PassPrecision precision_ = PassPrecision::single;
  int dofs_ = 0;
  int leading_ = 0;
  int longest_ = 0;  // rows of the largest supernode
  std::size_t entry_count_ = 0;
  std::vector<Node> nodes_;          // those with leading columns, in the order of elimination
  std::vector<int> rows_;            // below their columns, as indices into Scratch::x
  std::vector<Part> parts_;          // lower: each reads and writes its own rows, and its own copy of the upper ones
  std::vector<int> upper_;           // nodes above all parts, ascending
  std::vector<int> upper_rows_;      // their columns, and S
  std::vector<float> heads_;         // [panels] inverse of the diagonal block, by columns; scales of the columns
  std::vector<int> wide_;            // [panels] tiles that are; the others are narrow
  std::vector<panels::Tile> tiles_;  // as their entries lie
  std::vector<std::uint8_t> entries_;  // of tiles, by columns, and room for more
};

}  // namespace stylet::physics
