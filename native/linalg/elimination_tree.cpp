#include "linalg/elimination_tree.hpp"

#include <algorithm>

namespace qlb {

Graph renumbered(const Graph& graph, std::span<const std::int32_t> order) {
  std::vector<std::int32_t> rank(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) rank[order[k]] = static_cast<std::int32_t>(k);
  Graph result;
  result.begin.reserve(graph.begin.size());
  result.neighbour.reserve(graph.neighbour.size());
  result.begin.push_back(0);
  for (const std::int32_t i : order) {
    for (const std::int32_t j : graph.of(i)) result.neighbour.push_back(rank[j]);
    result.begin.push_back(static_cast<std::int64_t>(result.neighbour.size()));
  }
  return result;
}

std::vector<std::int32_t> elimination_tree(const Graph& graph) {
  std::vector<std::int32_t> parent(graph.size(), -1), ancestor(graph.size(), -1);  // ancestor: with shortened paths
  for (std::int32_t i = 0; i < graph.size(); ++i)
    for (std::int32_t j : graph.of(i)) {
      if (j > i) continue;
      while (ancestor[j] >= 0 && ancestor[j] != i) {
        const std::int32_t next = ancestor[j];
        ancestor[j] = i;
        j = next;
      }
      if (ancestor[j] < 0 && j != i) ancestor[j] = parent[j] = i;
    }
  return parent;
}

std::vector<std::int32_t> postorder(std::span<const std::int32_t> parent, std::span<const double> weight) {
  const auto count = static_cast<std::int32_t>(parent.size());
  std::vector<std::vector<std::int32_t>> children(count + 1);  // those of the root -1 at the end
  for (std::int32_t j = 0; j < count; ++j) children[parent[j] < 0 ? count : parent[j]].push_back(j);
  if (!weight.empty())
    for (auto& siblings : children)
      std::stable_sort(siblings.begin(), siblings.end(),
                       [&](std::int32_t a, std::int32_t b) { return weight[a] > weight[b]; });

  // Depth first without recursion: written parents first and last children first, then turned round.
  std::vector<std::int32_t> order, stack(children[count].begin(), children[count].end());
  order.reserve(count);
  while (!stack.empty()) {
    const std::int32_t j = stack.back();
    stack.pop_back();
    order.push_back(j);
    stack.insert(stack.end(), children[j].begin(), children[j].end());
  }
  std::reverse(order.begin(), order.end());
  return order;
}

namespace {

// Least common ancestors by union and find, for vertices visited in postorder.
class Ancestors {
 public:
  explicit Ancestors(std::int32_t count) : up_(count) {
    for (std::int32_t j = 0; j < count; ++j) up_[j] = j;
  }
  void join(std::int32_t j, std::int32_t parent) { up_[j] = parent; }
  std::int32_t root(std::int32_t j) {
    std::int32_t top = j;
    while (up_[top] != top) top = up_[top];
    while (up_[j] != top) {
      const std::int32_t next = up_[j];
      up_[j] = top;
      j = next;
    }
    return top;
  }

 private:
  std::vector<std::int32_t> up_;
};

}  // namespace

// Row i of L is a subtree of the tree, rooted at i; its leaves are entries of A. Column j's count is the number of row
// subtrees that hold j. With +1 at each leaf, -1 where two of its paths meet and -1 above its root, summing `change`
// over the descendants of j counts each such subtree once.
std::vector<std::int64_t> column_counts(const Graph& graph, std::span<const std::int32_t> parent,
                                        std::span<const std::int32_t> weight) {
  const std::int32_t count = graph.size();
  std::vector<std::int32_t> first(count, -1), last_first(count, -1), last_leaf(count, -1);
  std::vector<std::int64_t> change(count, 0);
  for (std::int32_t j = 0; j < count; ++j) {
    if (first[j] < 0) change[j] = weight[j];  // a leaf of the tree: its row holds the diagonal only
    for (std::int32_t k = j; k >= 0 && first[k] < 0; k = parent[k]) first[k] = j;
  }
  Ancestors ancestors(count);
  for (std::int32_t j = 0; j < count; ++j) {
    if (parent[j] >= 0) change[parent[j]] -= weight[j];
    for (const std::int32_t i : graph.of(j)) {
      if (i < j || first[j] <= last_first[i]) continue;  // not a new leaf of row i
      last_first[i] = first[j];
      change[j] += weight[i];
      if (last_leaf[i] >= 0) change[ancestors.root(last_leaf[i])] -= weight[i];
      last_leaf[i] = j;
    }
    if (parent[j] >= 0) ancestors.join(j, parent[j]);
  }
  for (std::int32_t j = 0; j < count; ++j)
    if (parent[j] >= 0) change[parent[j]] += change[j];
  return change;
}

}  // namespace qlb
