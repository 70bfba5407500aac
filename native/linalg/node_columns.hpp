// Half-solves of the unit vectors of nodes, Z_i = L^-1 P E_i (rows x 3), and their products G_ij = Z_i^T Z_j, blocks of
// the inverse of L L^T.
//
// Z_i is zero but in the rows of the supernodes from the node's own up to the root, so two of them overlap in the last
// rows of both. A held axis has a column of zeros. The columns are kept; they hold as long as the factor does.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "linalg/supernodal_factor.hpp"
#include "simd/aligned.hpp"

namespace qlb {

template <class T>
class NodeColumns {
 public:
  // row_of_dof: -1 where held; owner: supernode of each row. All must outlive this.
  NodeColumns(const Supernodes& supernodes, const SupernodalFactor<T>& factor, std::span<const std::int32_t> row_of_dof,
              std::span<const std::int32_t> owner, int threads);

  // Makes the columns of those nodes that have none yet.
  void make(std::span<const std::int32_t> nodes);
  // Makes G among these columns, as far as it is not there yet.
  void join(std::span<const std::int32_t> columns);

  std::int32_t find(std::int32_t node) const { return column_of_node_[node]; }  // -1 where there is none
  bool held(std::int32_t node) const;                                           // whole
  std::int64_t first_row(std::int32_t column) const { return columns_[column].first; }
  std::int64_t count() const { return static_cast<std::int64_t>(columns_.size()); }
  std::int64_t bytes() const;
  // G u for up to kTermBlock terms whose columns were joined, as DenseKernels::multiply_terms; `work` and `out` have
  // room for kTermBlock gram_length(). What stands there for columns that were not joined does not matter.
  void gram_products(std::span<const NodeTerm* const> terms, T* work, T* out) const;
  std::int64_t gram_length() const { return 3 * capacity_; }
  const DenseKernels<T>& kernels() const { return factor_.kernels(); }

  void dots(std::span<const std::int32_t> columns, const T* y, double* t) const;      // t_k = Z^T y, each 3
  void subtract(std::span<const std::int32_t> columns, const double* c, T* y) const;  // y -= sum_k Z c_k

 private:
  struct Column {
    std::int32_t supernode;
    std::int64_t first, rows, ld;  // first row; how many up to the root; entries from one column to the next
    Aligned<T> values;             // (3, ld), the rows last: where two columns overlap, they are aligned alike
    T* end() { return values.data() + ld; }
    const T* end() const { return values.data() + ld; }
    T* begin() { return end() - rows; }
    const T* begin() const { return end() - rows; }
  };
  struct Side {  // one axis of a column
    std::int64_t row;
    std::int32_t column;
    int axis;
  };

  std::vector<Side> add_columns(std::span<const std::int32_t> nodes);
  void solve_sides(std::span<const Side> sides, typename SupernodalFactor<T>::PathWork& work);
  std::vector<std::int32_t> union_of_paths(std::span<const Side> sides) const;
  // Calls f(first row, place in the column, rows) for each range of rows of a column.
  template <class F>
  void for_each_range(const Column& column, const F& f) const;
  std::int64_t rows_in_common(std::int32_t s, std::int32_t t) const;
  void make_gram(std::span<const std::int32_t> few, std::int32_t j);
  void make_gram(std::span<const std::int32_t> few, std::int32_t j, std::int64_t rows);
  void reserve_gram();
  // Row d of the blocks G_ij, j = 0, 1, ...
  const T* gram_row(std::int32_t i, int d) const { return gram_.data() + (3 * std::int64_t{i} + d) * gram_length(); }

  const Supernodes& supernodes_;
  const SupernodalFactor<T>& factor_;
  std::span<const std::int32_t> row_of_dof_, owner_;
  int threads_;
  std::vector<std::int64_t> rows_to_root_;  // of each supernode and its ancestors
  std::vector<std::int32_t> column_of_node_;
  std::vector<Column> columns_;
  std::vector<std::uint8_t> joined_;                          // columns whose blocks among themselves are there
  std::vector<typename SupernodalFactor<T>::PathWork> work_;  // of each thread
  std::int64_t capacity_ = 0;
  Aligned<T> gram_;  // (3 capacity, 3 capacity), symmetric; NaN where not made
};

}  // namespace qlb
