// Supernodes of the Cholesky factor: what depends on the pattern alone.
//
// A supernode is a range of columns of L with the same rows below them, stored as one dense panel: its square diagonal
// block, then the rows below. Supernodes form a tree; the parent of one owns its first row below.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "assembly/block_pattern.hpp"

namespace qlb {

struct Supernodes {
  // Rows of a supernode that are neighbours in its parent's front too: rows `start` to `start + length` go to
  // `position` on.
  struct Run {
    std::int32_t start, position, length;
  };

  std::vector<std::int64_t> dof;        // degree of freedom (3 node + axis) of each column, in elimination order
  std::vector<std::int32_t> first;      // first column of each supernode, and one past the last
  std::vector<std::int32_t> parent;     // -1 at roots; descendants come before their ancestors, as one range
  std::vector<std::int64_t> row_begin;  // supernodes + 1
  std::vector<std::int32_t> row;        // columns that the rows below belong to, ascending
  std::vector<std::int32_t> relative;   // where each of these rows stands in the parent's front
  std::vector<std::int64_t> run_begin;  // supernodes + 1
  std::vector<Run> run;
  std::vector<std::int64_t> child_begin;  // supernodes + 1
  std::vector<std::int32_t> child;        // ascending
  std::vector<std::int32_t> descendants;  // how many each has, itself included

  std::int32_t count() const { return static_cast<std::int32_t>(parent.size()); }
  std::int64_t columns(std::int32_t s) const { return first[s + 1] - first[s]; }
  std::int64_t rows_below(std::int32_t s) const { return row_begin[s + 1] - row_begin[s]; }
  std::int64_t front(std::int32_t s) const { return columns(s) + rows_below(s); }
  const std::int32_t* rows(std::int32_t s) const { return row.data() + row_begin[s]; }
  const std::int32_t* positions(std::int32_t s) const { return relative.data() + row_begin[s]; }
  std::span<const Run> runs(std::int32_t s) const { return {run.data() + run_begin[s], run.data() + run_begin[s + 1]}; }
  std::span<const std::int32_t> children(std::int32_t s) const {
    return {child.data() + child_begin[s], child.data() + child_begin[s + 1]};
  }
  double flops(std::int32_t s) const;           // operations to factorise its front
  std::int64_t nonzeros(std::int32_t s) const;  // entries of its columns in the lower triangle
};

// fixed: (nodes, 3), nonzero where held; node_order: all nodes in the order of elimination, up to equivalent ones.
Supernodes find_supernodes(const BlockPattern& pattern, std::span<const std::uint8_t> fixed,
                           std::span<const std::int32_t> node_order);

}  // namespace qlb
