// The elimination tree of a symmetric pattern, and what follows from it without forming the factor.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace qlb {

// Neighbours of each vertex, both ways, no loops.
struct Graph {
  std::vector<std::int64_t> begin;  // vertices + 1
  std::vector<std::int32_t> neighbour;

  std::int32_t size() const { return static_cast<std::int32_t>(begin.size()) - 1; }
  std::span<const std::int32_t> of(std::int32_t i) const {
    return {neighbour.data() + begin[i], static_cast<std::size_t>(begin[i + 1] - begin[i])};
  }
};

// The same graph with vertex order[k] called k.
Graph renumbered(const Graph& graph, std::span<const std::int32_t> order);

// parent[j] = the first row below j in column j of L; -1 at a root (Liu 1990).
std::vector<std::int32_t> elimination_tree(const Graph& graph);

// Every vertex after all its descendants, which come as one range before it. `weight`: among siblings, the heaviest
// subtree comes first, so that least is pending while it is worked on; may be empty.
std::vector<std::int32_t> postorder(std::span<const std::int32_t> parent, std::span<const double> weight);

// Sum of the weights of the rows in each column of L, its diagonal included, for a graph numbered in postorder
// (Gilbert, Ng, Peyton 1994).
std::vector<std::int64_t> column_counts(const Graph& graph, std::span<const std::int32_t> parent,
                                        std::span<const std::int32_t> weight);

}  // namespace qlb
