// Grouping of columns into supernodes large enough for dense kernels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "linalg/elimination_tree.hpp"

namespace qlb {

struct Partition {
  std::vector<std::int32_t> order;   // new order of the vertices: supernode after supernode
  std::vector<std::int32_t> first;   // first vertex of each supernode in that order, and one past the last
  std::vector<std::int32_t> parent;  // of each supernode, -1 at roots; in postorder
};

// Operations to eliminate the first `columns` of a front that has `below` rows more: the sum of l^2 over its columns'
// lengths l.
double front_flops(double columns, double below);

// Fundamental supernodes (Liu, Ng, Peyton 1993) of a graph numbered in postorder, then merged with their parents where
// the zeros this stores cost less than the front it saves (Ashcraft, Grimes 1989).
Partition amalgamate(const Graph& graph, std::span<const std::int32_t> weight);

}  // namespace qlb
