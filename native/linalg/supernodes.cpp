#include "linalg/supernodes.hpp"

#include <algorithm>
#include <numeric>

#include "linalg/amalgamation.hpp"
#include "linalg/elimination_tree.hpp"
#include "linalg/ordering.hpp"

namespace qlb {
namespace {

// The nodes that have a free degree of freedom, in elimination order.
struct FreeNodes {
  std::vector<std::int32_t> node, weight;  // weight: free degrees of freedom
};

FreeNodes free_nodes(std::span<const std::int32_t> node_order, std::span<const std::uint8_t> fixed) {
  FreeNodes free;
  for (const std::int64_t dof : free_dofs(node_order, fixed)) {
    const auto node = static_cast<std::int32_t>(dof / 3);
    if (free.node.empty() || free.node.back() != node) free.node.push_back(node), free.weight.push_back(0);
    ++free.weight.back();
  }
  return free;
}

Graph graph_of(const BlockPattern& pattern, std::span<const std::int32_t> nodes) {
  std::vector<std::int32_t> rank(pattern.nodes(), -1);
  for (std::size_t k = 0; k < nodes.size(); ++k) rank[nodes[k]] = static_cast<std::int32_t>(k);
  const auto for_each_edge = [&](auto&& visit) {
    for (std::int64_t j = 0; j < pattern.nodes(); ++j)
      for (std::int64_t k = pattern.column_begin()[j] + 1; k < pattern.column_begin()[j + 1]; ++k)
        if (rank[j] >= 0 && rank[pattern.rows()[k]] >= 0) visit(rank[j], rank[pattern.rows()[k]]);
  };
  Graph graph;
  graph.begin.assign(nodes.size() + 1, 0);
  for_each_edge([&](std::int32_t a, std::int32_t b) { ++graph.begin[a + 1], ++graph.begin[b + 1]; });
  std::partial_sum(graph.begin.begin(), graph.begin.end(), graph.begin.begin());
  graph.neighbour.resize(graph.begin.back());
  std::vector<std::int64_t> next(graph.begin.begin(), graph.begin.end());
  for_each_edge(
      [&](std::int32_t a, std::int32_t b) { graph.neighbour[next[a]++] = b, graph.neighbour[next[b]++] = a; });
  return graph;
}

void permute(FreeNodes& free, std::span<const std::int32_t> order) {
  FreeNodes result;
  for (const std::int32_t k : order) result.node.push_back(free.node[k]), result.weight.push_back(free.weight[k]);
  free = std::move(result);
}

void list_children(Supernodes& s) {
  const std::int32_t count = s.count();
  s.child_begin.assign(count + 1, 0);
  s.descendants.assign(count, 1);
  for (std::int32_t c = 0; c < count; ++c)
    if (s.parent[c] >= 0) ++s.child_begin[s.parent[c] + 1], s.descendants[s.parent[c]] += s.descendants[c];
  std::partial_sum(s.child_begin.begin(), s.child_begin.end(), s.child_begin.begin());
  s.child.resize(s.child_begin[count]);
  std::vector<std::int64_t> next(s.child_begin.begin(), s.child_begin.end());
  for (std::int32_t c = 0; c < count; ++c)
    if (s.parent[c] >= 0) s.child[next[s.parent[c]]++] = c;
}

// Rows of a supernode: the neighbours of its nodes in A and the rows of its children, as far as they come later.
// first_node: first node of each supernode; column: first column of each node.
void find_rows(Supernodes& s, const Graph& graph, std::span<const std::int32_t> first_node,
               std::span<const std::int32_t> column) {
  std::vector<std::vector<std::int32_t>> nodes_below(s.count());
  std::vector<std::int32_t> seen(graph.size(), -1);
  s.row_begin.push_back(0);
  for (std::int32_t k = 0; k < s.count(); ++k) {
    std::vector<std::int32_t>& below = nodes_below[k];
    const auto add = [&](std::int32_t node) {
      if (node >= first_node[k + 1] && seen[node] != k) seen[node] = k, below.push_back(node);
    };
    for (std::int32_t node = first_node[k]; node < first_node[k + 1]; ++node)
      for (const std::int32_t other : graph.of(node)) add(other);
    for (const std::int32_t c : s.children(k)) {
      for (const std::int32_t node : nodes_below[c]) add(node);
      std::vector<std::int32_t>().swap(nodes_below[c]);
    }
    std::sort(below.begin(), below.end());
    for (const std::int32_t node : below)
      for (std::int32_t c = column[node]; c < column[node + 1]; ++c) s.row.push_back(c);
    s.row_begin.push_back(static_cast<std::int64_t>(s.row.size()));
  }
}

void find_positions(Supernodes& s) {
  s.relative.resize(s.row.size());
  s.run_begin.push_back(0);
  for (std::int32_t k = 0; k < s.count(); ++k) {
    const std::int32_t p = s.parent[k];
    std::int32_t below = 0;  // place among the parent's rows
    for (std::int64_t i = s.row_begin[k]; i < s.row_begin[k + 1]; ++i) {
      if (s.row[i] < s.first[p + 1]) {
        s.relative[i] = s.row[i] - s.first[p];
      } else {
        while (s.rows(p)[below] != s.row[i]) ++below;
        s.relative[i] = below + static_cast<std::int32_t>(s.columns(p));
      }
      const auto start = static_cast<std::int32_t>(i - s.row_begin[k]);
      if (start > 0 && s.relative[i] == s.relative[i - 1] + 1 && s.relative[i] != s.columns(p))
        ++s.run.back().length;
      else
        s.run.push_back({start, s.relative[i], 1});
    }
    s.run_begin.push_back(static_cast<std::int64_t>(s.run.size()));
  }
}

}  // namespace

double Supernodes::flops(std::int32_t s) const {
  return front_flops(columns(s), rows_below(s));
}

std::int64_t Supernodes::nonzeros(std::int32_t s) const {
  return columns(s) * (columns(s) + 1) / 2 + columns(s) * rows_below(s);
}

Supernodes find_supernodes(const BlockPattern& pattern, std::span<const std::uint8_t> fixed,
                           std::span<const std::int32_t> node_order) {
  FreeNodes free = free_nodes(node_order, fixed);
  Graph graph = graph_of(pattern, free.node);
  {
    const std::vector<std::int32_t> order = postorder(elimination_tree(graph), {});
    permute(free, order);
    graph = renumbered(graph, order);
  }
  const Partition partition = amalgamate(graph, free.weight);
  permute(free, partition.order);
  graph = renumbered(graph, partition.order);

  Supernodes s;
  s.parent = partition.parent;
  std::vector<std::int32_t> column(1, 0);
  for (std::size_t k = 0; k < free.node.size(); ++k) {
    column.push_back(column.back() + free.weight[k]);
    for (std::int64_t dof = 3 * free.node[k]; dof < 3 * free.node[k] + 3; ++dof)
      if (!fixed[dof]) s.dof.push_back(dof);
  }
  for (const std::int32_t node : partition.first) s.first.push_back(column[node]);
  list_children(s);
  find_rows(s, graph, partition.first, column);
  find_positions(s);
  return s;
}

}  // namespace qlb
