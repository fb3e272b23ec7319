// The numbers of a large factor, by two threads: CHOLMOD's supernodes, left-looking. Internal to the factorisation.
#pragma once

#include "physics/tissue/companion.h"
#include "physics/tissue/dense_tiles.h"
#include "physics/tissue/stiffness.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

struct cholmod_factor_struct;

namespace stylet::physics {

/// P A P^T = L L^T in double, into the supernodes that CHOLMOD has analysed   (physics/README.md eq. 8d)
///
/// The elimination tree is cut: lower parts do not depend on each other; above them the rows of a panel of columns
/// are shared out. What is added to an entry, and in which order, is given by the supernodes alone: neither the
/// number of threads nor the processor's vectors change a bit.
class SupernodalCholesky {
public:
  /// Room to work. One a thread that factorises.
  struct Scratch {
    struct Part {
      std::vector<int> place;       // [DOFs] where a row is in the supernode in work
      std::vector<double> rows;     // packed
      std::vector<double> columns;  // packed
    };
    std::vector<Part> parts;
    std::vector<double> inverse;  // of the diagonal block of an upper panel, packed
  };

  /// Lists who updates whom and where the entries of A go.
  /// @param factor  supernodal, with storage for its numbers
  void analyse(const cholmod_factor_struct& factor, const StiffnessPattern& pattern);
  bool empty() const { return update_start_.empty(); }
  void clear() { update_start_.clear(); }

  /// @param factor   as analysed, with storage for its numbers
  /// @param values   lower triangle in the pattern's order
  /// @param product  one of dense_tiles.h: all give the same bits
  /// @return false if A is not positive definite: the factor must then not be used
  bool factorise(cholmod_factor_struct& factor, std::span<const double> values, Scratch& scratch,
                 Companion* companion, TileProduct product = tile_product()) const;
  /// Of a factorisation, multiplications and additions.
  double flops() const { return flops_; }

private:
  struct Update {
    int supernode = 0;
    int first_row = 0;  // the first of its rows that is in the columns updated
  };
  struct Entry {
    std::uint32_t value = 0;  // in the pattern's order
    std::uint32_t place = 0;  // from the start of the supernode
  };
  class Numbers;
  void cut(const cholmod_factor_struct& factor, std::span<const int> parent);

  double flops_ = 0;
  std::vector<int> update_start_;  // [supernodes + 1] in updates_
  std::vector<Update> updates_;    // of each supernode, from those before it
  std::vector<int> entry_start_;   // [supernodes + 1] in entries_
  std::vector<Entry> entries_;
  std::vector<std::vector<int>> parts_;  // supernodes, ascending
  std::vector<int> upper_;               // above all parts, ascending
};

}  // namespace stylet::physics
