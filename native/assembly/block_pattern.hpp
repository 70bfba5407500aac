// Which 3x3 node blocks of the Hessian can be nonzero: the lower triangle, by columns. Fixed for a whole run.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace qlb {

class BlockPattern {
 public:
  // Every row of `cliques` ((count, width), row by row) is a set of nodes that are all coupled; the diagonal
  // is always present. Throws std::invalid_argument on a node outside [0, nodes).
  BlockPattern(std::int64_t nodes, std::span<const std::int32_t> cliques, std::int64_t width);

  std::int64_t nodes() const { return nodes_; }
  std::int64_t blocks() const { return static_cast<std::int64_t>(row_.size()); }
  std::span<const std::int64_t> column_begin() const { return column_begin_; }
  std::span<const std::int32_t> rows() const { return row_; }

  // Index of block (i, j) or (j, i), whichever is in the lower triangle; throws std::out_of_range if it is
  // not there.
  std::int64_t find(std::int32_t i, std::int32_t j) const;
  // For each of the stencils (count, 4), whether all blocks between its nodes are there. Throws std::invalid_argument
  // on a node outside [0, nodes).
  void holds(std::span<const std::int32_t> stencils, std::uint8_t* held) const;

 private:
  std::int64_t look_up(std::int32_t i, std::int32_t j) const;  // -1 where there is none
  std::int64_t nodes_;
  std::vector<std::int64_t> column_begin_;  // nodes + 1
  std::vector<std::int32_t> row_;           // ascending in each column, the diagonal first
};

}  // namespace qlb
